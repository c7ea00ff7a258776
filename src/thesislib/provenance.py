"""What a process has used: the project's folders, its data files, its modules, and their hashes.

A run is *current* as long as everything it used is unchanged. Python tells which files were opened
(an audit hook on ``open``) and which modules were imported (``sys.modules``), so that no chapter has
to list its own inputs. Only the standard library is imported here: every process of a run, also the
ones that must stay light, can afford this module.
"""

from __future__ import annotations

import fnmatch
import hashlib
import json
import os
import sys
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

__all__ = [
    "ABSENT",
    "DRAWING_MODULES",
    "LOCK",
    "PACKAGE",
    "Usage",
    "data_files",
    "digest",
    "file_hash",
    "hashes",
    "loaded_modules",
    "merge",
    "opened_data_files",
    "project_root",
    "source_files",
    "source_hash",
    "usage",
    "watch",
    "write_atomically",
]

PACKAGE = Path(__file__).resolve().parent
"""The folder of this package's sources."""

LOCK = "environment-pip.txt"
"""The locked environment, relative to the project's root."""

ABSENT = "absent"
"""Stands for the hash of a file that does not exist."""

RESULTS = ("data/expected/", "data/thesis/")
"""Data folders that no computation may depend on: a run is compared with them."""

STUDIES = ("data/studies/", "data/benchmarks/")
"""Data folders with results of this project's own: a page shows them, no solution depends on them."""

DRAWING_MODULES = (
    "__main__",
    "companion",
    "companion.*",
    "*.drawings",
    "*.figures",
    "*.figures_*",
    "*.linked",
    "*.maps",
    "*.palette",
    "*.sketching",
    "*.style",
    "*.views",
)
"""Modules (patterns, without the package's name) that show results and cannot change one."""


@dataclass(frozen=True)
class Usage:
    """Names of the modules a process imported and of the data files it opened.

    Attributes
    ----------
    modules : frozenset of str
        Full module names, all of this package.
    data_files : frozenset of str
        Paths relative to the project's root, with forward slashes.
    """

    modules: frozenset[str] = frozenset()
    data_files: frozenset[str] = frozenset()

    def __or__(self, other: Usage) -> Usage:
        return Usage(self.modules | other.modules, self.data_files | other.data_files)

    def as_lists(self) -> dict[str, list[str]]:
        """Return the names as sorted lists, ready for JSON."""
        return {"modules": sorted(self.modules), "data_files": sorted(self.data_files)}

    @classmethod
    def from_lists(cls, lists: Mapping[str, Iterable[str]]) -> Usage:
        """Return the usage that `as_lists` wrote."""
        return cls(frozenset(lists["modules"]), frozenset(lists["data_files"]))


class _Watch:
    """The audit hook's memory: one per process, because an audit hook cannot be taken off again."""

    def __init__(self) -> None:
        self.installed = False
        self.data = ""
        self.opened: set[str] = set()
        self.elsewhere = Usage()
        self.own = threading.local()

    @contextmanager
    def looking_away(self) -> Iterator[None]:
        """Not count what this thread opens: hashing a file is not using it."""
        self.own.hashing = True
        try:
            yield
        finally:
            self.own.hashing = False

    def __call__(self, event: str, arguments: tuple[object, ...]) -> None:
        if event != "open" or getattr(self.own, "hashing", False):
            return
        path = arguments[0]
        if isinstance(path, bytes):
            path = os.fsdecode(path)
        if not isinstance(path, str | os.PathLike):
            return  # a file descriptor: whoever opened it has been seen before
        full = os.path.realpath(path)
        if full.startswith(self.data):
            self.opened.add(full)


_watch = _Watch()


def project_root() -> Path:
    """Return the project's root folder: the one with ``book/`` and the locked environment.

    ``THESIS_ROOT`` decides if it is set; then the working directory and its parents are looked at;
    then the folder this package is installed from.

    Raises
    ------
    FileNotFoundError
        If there is no such folder, or ``THESIS_ROOT`` names none.
    """
    named = os.environ.get("THESIS_ROOT")
    if named:
        if not (Path(named) / "book").is_dir():
            raise FileNotFoundError(f"THESIS_ROOT = {named} is not a project: it has no folder book/.")
        return Path(named).resolve()
    here = Path.cwd().resolve()
    for folder in (here, *here.parents, *PACKAGE.parents):
        if (folder / "book").is_dir() and (folder / LOCK).is_file():
            return folder
    raise FileNotFoundError(
        f"No project found in {here} or above it: a project has a folder book/ and a file {LOCK}."
    )


def watch(root: Path | None = None) -> None:
    """Remember from now on which files below ``data/`` of the project this process opens.

    Parameters
    ----------
    root : Path, optional
        The project's root folder; `project_root` if not given. A later call changes the root and
        forgets what was opened below another one.
    """
    data = os.path.realpath((root or project_root()) / "data") + os.sep
    if data != _watch.data:
        _watch.data = data
        _watch.opened.clear()
    if not _watch.installed:
        _watch.installed = True
        sys.addaudithook(_watch)


def opened_data_files() -> frozenset[str]:
    """Return the data files this process has opened since `watch`, relative to the root.

    Files below ``data/expected`` and ``data/thesis`` are left out: a result is compared with them
    and does not depend on them.
    """
    relative = ("data/" + Path(path[len(_watch.data) :]).as_posix() for path in _watch.opened)
    return frozenset(path for path in relative if not path.startswith(RESULTS))


def loaded_modules() -> frozenset[str]:
    """Return the names of this package's modules that this process has imported."""
    name = __name__.partition(".")[0]
    return frozenset(
        module
        for module, loaded in list(sys.modules.items())
        if module.partition(".")[0] == name and getattr(loaded, "__file__", None)
    )


def merge(other: Usage) -> None:
    """Add what another process (a study's worker, a stored solution's run) has used to this one's."""
    _watch.elsewhere |= other


def usage() -> Usage:
    """Return what this process, and the processes merged into it, have used."""
    return Usage(loaded_modules(), opened_data_files()) | _watch.elsewhere


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal, or `ABSENT` if there is no such file.

    A file that is only hashed does not count as opened.
    """
    try:
        with _watch.looking_away():
            return hashlib.sha256(path.read_bytes()).hexdigest()
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError):
        return ABSENT


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write a file under a temporary name and rename it, so that no reader ever sees half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        unfinished.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def digest(value: object) -> str:
    """Return the SHA-256 of a value's canonical JSON (sorted keys, shortest exact numbers).

    Raises
    ------
    TypeError
        If the value is not made of mappings, lists, strings, numbers, booleans and None.
    """
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def source_files(package: Path = PACKAGE) -> dict[str, Path]:
    """Return the source file of every module of the package, by full module name."""
    files = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package).with_suffix("").parts
        if parts[-1] == "__init__":
            parts = parts[:-1]
        files[".".join((package.name, *parts))] = path
    return files


def data_files(root: Path) -> dict[str, Path]:
    """Return every data file a solution may depend on, by its path relative to the root."""
    found = {path.relative_to(root).as_posix(): path for path in sorted((root / "data").rglob("*"))}
    left_out = (*RESULTS, *STUDIES)
    return {name: path for name, path in found.items() if path.is_file() and not name.startswith(left_out)}


def hashes(files: Mapping[str, Path]) -> dict[str, str]:
    """Return the hash of each named file."""
    return {name: file_hash(path) for name, path in files.items()}


def source_hash(
    exclude: Iterable[str] = DRAWING_MODULES, *, root: Path | None = None, package: Path = PACKAGE
) -> str:
    """Return one hash of everything a solution may depend on besides its own inputs.

    That is every module of the package, every data file and the locked environment. It is coarser
    than what one run is seen to use, because it must be known before the solution is computed.

    Parameters
    ----------
    exclude : iterable of str
        Patterns of module names (without the package's name) that cannot change a solution.
    root : Path, optional
        The project's root folder; `project_root` if not given.
    package : Path
        Folder of the package's sources.
    """
    root = root or project_root()
    patterns = tuple(exclude)
    modules = {
        name: path
        for name, path in source_files(package).items()
        if not any(fnmatch.fnmatchcase(name.partition(".")[2], pattern) for pattern in patterns)
    }
    return digest([hashes(modules), hashes(data_files(root)), file_hash(root / LOCK)])
