"""Point functions as compiled C, kept between processes.

Compiled derivatives are about eight times faster than CasADi's virtual machine in the
Hessian. Without a compiler everything works all the same, which is said once.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import stat
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

import casadi as ca

logger = logging.getLogger(__name__)

# No -march=native and no -ffast-math: the numbers must not depend on the machine; and no
# contraction to fused multiply-add, which some targets would otherwise do at -O1.
FLAGS = ("-O1", "-ffp-contract=off", "-fPIC", "-shared")


def compiled(functions: list[ca.Function], wanted: bool | None = None) -> list[ca.Function]:
    """Return `functions` compiled from generated C, or as they are without a working compiler.

    Parameters
    ----------
    functions : list of casadi.Function
        SX functions with distinct names.
    wanted : bool, optional
        Whether to compile; by default yes, unless the environment variable
        `THESIS_COMPILE` is 0.

    Returns
    -------
    list of casadi.Function
        Functions of the same names and shapes. Compiled ones have no derivatives.
    """
    if wanted is None:
        wanted = os.environ.get("THESIS_COMPILE", "1") != "0"
    compiler = find_compiler() if wanted else None
    if compiler is None:
        if wanted:
            _say_once("no C compiler found")
        return functions
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator("points.c", {"with_header": False})
        for function in functions:
            generator.add(function)
        generator.generate(folder + os.sep)
        source = (Path(folder) / "points.c").read_text()
    built = library("points", source)
    return functions if built is None else [ca.external(f.name(), str(built)) for f in functions]


def library(name: str, source: str) -> Path | None:
    """Return a shared library of C source, from the cache if it is there, or None without a compiler.

    Parameters
    ----------
    name : str
        Beginning of its file's name.
    source : str
        What is compiled.
    """
    compiler = find_compiler()
    if compiler is None:
        return None
    key = hashlib.sha256((source + " ".join((compiler, *FLAGS))).encode()).hexdigest()[:32]
    kept = cache_folder() / f"{name}-{key}.so"
    if not _is_intact(kept):
        with tempfile.TemporaryDirectory() as folder:
            written, built = Path(folder) / f"{name}.c", Path(folder) / f"{name}.so"
            written.write_text(source)
            command = [compiler, *FLAGS, "-o", str(built), str(written), "-lm"]
            run = subprocess.run(command, capture_output=True, text=True)
            if run.returncode:
                # a compiler without the C library's headers is a usual sight
                words = run.stderr.strip().splitlines() or ["without a word"]
                _say_once(f"the C compiler {compiler} fails with status {run.returncode}: {words[0]}")
                return None
            _keep(built, kept)
    return kept


@lru_cache(maxsize=1)
def find_compiler() -> str | None:
    """Return the path of a C compiler, or None where there is none."""
    candidates = (os.environ.get("CC"), "cc", "gcc", "clang")
    found = (shutil.which(name) for name in candidates if name)
    return next((path for path in found if path), None)


def cache_folder() -> Path:
    """Return the folder of compiled functions, readable by its owner only.

    It lies in `XDG_CACHE_HOME` or the user's `.cache`; where that cannot be written,
    in `_build/cache` of the project that `THESIS_ROOT` names, else of the working directory.

    Raises
    ------
    PermissionError
        If neither folder can be created, or one belongs to somebody else.
    """
    home = os.environ.get("XDG_CACHE_HOME")
    wanted = Path(home) if home else Path.home() / ".cache"
    project = Path(os.environ.get("THESIS_ROOT", "."))
    for folder in (wanted / "thesislib", project / "_build" / "cache"):
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            if folder.stat().st_uid != os.getuid():
                raise PermissionError(f"the cache folder {folder} belongs to another user")
            folder.chmod(stat.S_IRWXU)
            return folder.resolve()
    raise PermissionError(f"neither {wanted} nor _build/cache can be written: no place for compiled code")


def _is_intact(library: Path) -> bool:
    """Check a kept library against the hash stored beside it, before it is loaded."""
    digest = library.with_suffix(".sha256")
    if not (library.is_file() and digest.is_file()):
        return False
    return digest.read_text() == hashlib.sha256(library.read_bytes()).hexdigest()


def _keep(built: Path, library: Path) -> None:
    """Move a new library into the cache in one step, its hash last."""
    content = built.read_bytes()
    for path, data in (
        (library, content),
        (library.with_suffix(".sha256"), hashlib.sha256(content).hexdigest().encode()),
    ):
        handle, name = tempfile.mkstemp(dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(name).chmod(stat.S_IRWXU)
        Path(name).replace(path)


@lru_cache(maxsize=1)
def _say_once(why: str) -> None:
    logger.warning("%s; derivatives run on CasADi's virtual machine, more slowly", why)
