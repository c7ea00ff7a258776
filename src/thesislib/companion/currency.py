"""Whether a run is current: everything it used is still what it was.

What counts is the chapter's code cells, every module of this package loaded at the end of the run,
every file opened below ``data/`` (but for ``data/expected`` and ``data/thesis``), the locked
environment and Python's version. Prose does not count, and neither do modules and data files that the
run has not used.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from thesislib import provenance
from thesislib.companion.chapters import Chapter

__all__ = ["Ingredients", "failure", "failure_file", "ingredients", "staleness"]


@dataclass(frozen=True)
class Ingredients:
    """Hashes of everything a run has used.

    Attributes
    ----------
    code : str
        Hash of the chapter's code cells.
    modules, data_files : dict
        Hash by full module name, and by path relative to the project's root.
    lock : str
        Hash of the locked environment.
    python : str
        Python's version, ``"3.11.9"``.
    """

    code: str
    modules: dict[str, str]
    data_files: dict[str, str]
    lock: str
    python: str

    @property
    def hash(self) -> str:
        """One hash of all ingredients; the record carries it."""
        return provenance.digest(asdict(self))

    def only(self, used: provenance.Usage, now: Ingredients) -> Ingredients:
        """Return these ingredients reduced to what was used.

        `now` supplies what did not exist yet when these were taken.
        """
        return Ingredients(
            self.code,
            {name: self.modules.get(name, now.modules[name]) for name in sorted(used.modules)},
            {name: self.data_files.get(name, now.data_files[name]) for name in sorted(used.data_files)},
            self.lock,
            self.python,
        )


def ingredients(
    chapter: Chapter, used: provenance.Usage | None = None, *, package: Path = provenance.PACKAGE
) -> Ingredients:
    """Return the hashes, as of now, of what a run of a chapter uses.

    Parameters
    ----------
    chapter : Chapter
        The chapter.
    used : Usage, optional
        Names of the modules and data files; without it, all there are. What no longer exists has the
        hash `thesislib.provenance.ABSENT`.
    package : Path
        Folder of the package's sources.
    """
    modules = provenance.hashes(provenance.source_files(package))
    if used is None:
        files = provenance.hashes(provenance.data_files(chapter.root))
    else:
        modules = {name: modules.get(name, provenance.ABSENT) for name in sorted(used.modules)}
        files = provenance.hashes({name: chapter.root / name for name in sorted(used.data_files)})
    return Ingredients(
        code=provenance.digest(chapter.code),
        modules=modules,
        data_files=files,
        lock=provenance.file_hash(chapter.root / provenance.LOCK),
        python=platform.python_version(),
    )


def failure_file(chapter: Chapter) -> Path:
    """Return the file that says that the last published run of a chapter failed."""
    return chapter.root / "_build" / "failed" / f"{chapter.stem}.json"


def failure(chapter: Chapter) -> str | None:
    """Return the sentence saying how the last run of a chapter failed; None if it did not."""
    try:
        said = json.loads(failure_file(chapter).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    return str(said["failure"])


def staleness(
    chapter: Chapter, record: Mapping[str, Any], *, package: Path = provenance.PACKAGE
) -> str | None:
    """Return the sentence saying why a chapter's record is not current; None if it is.

    Parameters
    ----------
    chapter : Chapter
        The chapter as it is now.
    record : mapping
        The content of a ``record.json``.
    package : Path
        Folder of the package's sources.
    """
    run = record.get("run", {})
    if run.get("status") != "finished":
        return f"The run of chapter {chapter.id} has the status {run.get('status')!r}, not 'finished'."
    try:
        then = Ingredients(
            run["code"], dict(run["modules"]), dict(run["data_files"]), run["lock"], run["python"]
        )
        stored = run["hash"]
    except (KeyError, TypeError, ValueError):
        return f"The record of chapter {chapter.id} does not say what its run has used."
    if stored != then.hash:
        return f"The hash in the record of chapter {chapter.id} does not belong to what its run has used."
    if not run.get("changed", False):
        failed = failure(chapter)
        if failed is not None:
            return f"The last run of chapter {chapter.id} failed: {failed}"
        if "notebook" in run and run["notebook"] != provenance.file_hash(chapter.executed):
            return f"The executed notebook of chapter {chapter.id} is not that of its record."
    used = provenance.Usage(frozenset(then.modules), frozenset(then.data_files))
    now = ingredients(chapter, used, package=package)
    if now.hash == stored:
        return None
    return f"Since the run of chapter {chapter.id}, {'; '.join(_differences(then, now))}."


def _differences(then: Ingredients, now: Ingredients) -> list[str]:
    """Name what has changed, a few of each kind."""
    said = []
    if then.code != now.code:
        said.append("its code cells have changed")
    for kind, before, after in (
        ("module", then.modules, now.modules),
        ("data file", then.data_files, now.data_files),
    ):
        changed = [name for name in before if before[name] != after[name]]
        for name in changed[:3]:
            verb = "is gone" if after[name] == provenance.ABSENT else "has changed"
            said.append(f"{kind} {name} {verb}")
        if len(changed) > 3:
            said.append(f"{len(changed) - 3} more {kind}s have changed")
    if then.lock != now.lock:
        said.append(f"the locked environment {provenance.LOCK} has changed")
    if then.python != now.python:
        said.append(f"Python has become {now.python} (it was {then.python})")
    return said
