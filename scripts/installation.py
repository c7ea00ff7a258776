"""The virtual environment of the project, made from the lock with nothing but the standard library.

``.venv`` is complete when, and only when, it holds a stamp that names what it was made from. The
stamp is taken away before anything is changed and written after everything is in place, so that an
interrupted installation is started afresh by the next call instead of being taken for a whole one.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

LOCK = "environment-pip.txt"
PROJECT = "pyproject.toml"
STAMP = "installed-from.txt"


class InstallationError(RuntimeError):
    """The environment cannot be made; the message says which step and what to do."""


def main(arguments: list[str] | None = None) -> int:
    """Bring ``.venv`` up to date; return the exit status.

    Parameters
    ----------
    arguments
        Command line without the program's name, by default that of the process.
    """
    parser = argparse.ArgumentParser(prog="bootstrap.py", description="Make the project's environment.")
    parser.add_argument(
        "--installer",
        choices=("uv", "pip"),
        default="uv",
        help="what installs the lock; uv gives way to pip where it is not to be had",
    )
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parent.parent)
    options = parser.parse_args(arguments)
    try:
        install(options.root.resolve(), installer=options.installer)
    except InstallationError as failure:
        print(f"environment: {failure}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("environment: interrupted; the next call starts it afresh", file=sys.stderr)
        return 130
    return 0


def install(root: Path, installer: str = "uv") -> None:
    """Make ``root/.venv`` what the lock and the project file say; do nothing if it is that already.

    Parameters
    ----------
    root
        Folder with the lock and the project file.
    installer
        ``"uv"`` or ``"pip"``.

    Raises
    ------
    InstallationError
        If a step fails. The environment is then without its stamp.
    """
    folder = root / ".venv"
    stamp = folder / STAMP
    found = stamp.read_text(encoding="utf-8").splitlines() if stamp.is_file() else []
    wanted = fingerprint(root)
    if found == wanted:
        return
    stamp.unlink(missing_ok=True)
    python = folder / "bin" / "python"
    # The project file is the stamp's last line: where it alone has changed, the packages can stay.
    if found[:-1] != wanted[:-1] or not python.exists():
        create(folder)
        install_lock(python, root / LOCK, installer)
    install_project(python, root)
    draft = stamp.with_suffix(".new")
    draft.write_text("\n".join(wanted) + "\n", encoding="utf-8")
    draft.replace(stamp)
    print(f"environment: {folder} is complete", flush=True)


def fingerprint(root: Path) -> list[str]:
    """What an environment depends on, one line each: Python, the place, the lock, the project file.

    The place counts because an environment that has been moved holds scripts and an editable
    install that point to where it was.
    """
    return [
        f"python {platform.python_version()} {platform.machine()}",
        f"root {root}",
        *(f"{name} {hashlib.sha256((root / name).read_bytes()).hexdigest()}" for name in (LOCK, PROJECT)),
    ]


def create(folder: Path) -> None:
    """Make an empty environment with pip in ``folder``, in the place of whatever is there."""
    print(f"environment: making {folder} with Python {platform.python_version()}", flush=True)
    try:
        venv.EnvBuilder(clear=True, with_pip=True, symlinks=True).create(folder)
    except (subprocess.CalledProcessError, OSError) as error:
        raise InstallationError(
            f"{sys.executable} cannot make a virtual environment in {folder} ({error}). On Debian and "
            "Ubuntu the package python3-venv is missing then; install it, or name another Python: "
            "make book PYTHON=python3.12"
        ) from error


def install_lock(python: Path, lock: Path, installer: str) -> None:
    """Install every pinned package of ``lock`` that applies, each checked against its hash.

    uv is itself one of the pinned packages: pip fetches it first, and it fetches the rest, about
    ten times faster. Where uv is not to be had, or fails for whatever reason, pip does without it.
    """
    uv_pinned, others = split_off("uv", lock.read_text(encoding="utf-8"))
    if installer == "uv":
        if uv_pinned and installed_by_pip(python, uv_pinned, quiet=True) and python.with_name("uv").exists():
            print(f"environment: installing {lock.name} with uv", flush=True)
            uv = [str(python.with_name("uv")), "pip", "install", "--quiet", "--python", str(python)]
            if succeeds([*uv, "--require-hashes", "--requirement", str(lock)]):
                return
        print("environment: uv is not to be had here or does not work", flush=True)
    print(f"environment: installing {lock.name} with pip, which takes a minute or two", flush=True)
    if not installed_by_pip(python, others):
        raise InstallationError(
            f"the packages of {lock.name} could not be installed; the messages above say which one and "
            "why. Call the same command again when that is mended"
        )


def split_off(name: str, lock: str) -> tuple[str, str]:
    """Part the text of a lock into the entry of ``name``, hashes included, and all others."""
    entry: list[str] = []
    others: list[str] = []
    within = False
    for line in lock.splitlines(keepends=True):
        if not line.startswith((" ", "#")):
            within = line.startswith(f"{name}==")
        (entry if within else others).append(line)
    return "".join(entry), "".join(others)


def installed_by_pip(python: Path, requirements: str, quiet: bool = False) -> bool:
    """Install the text of a requirements file with pip, hashes required; tell whether it worked."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "requirements.txt"
        file.write_text(requirements, encoding="utf-8")
        command = [*pip_install(python), "--no-deps", "--require-hashes", "--requirement", str(file)]
        return succeeds(command, quiet=quiet)


def install_project(python: Path, root: Path) -> None:
    """Install the package itself, editable, with the build backend that the lock has brought."""
    backend_of_the_lock = ["--no-index", "--no-deps", "--no-build-isolation"]
    if not succeeds([*pip_install(python), *backend_of_the_lock, "--editable", str(root)]):
        raise InstallationError(f"the package in {root} could not be installed; see the messages above")


def pip_install(python: Path) -> list[str]:
    """The first words of a quiet ``pip install`` into the environment of ``python``."""
    return [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]


def succeeds(command: list[str], quiet: bool = False) -> bool:
    """Run ``command`` and tell whether its exit status was 0; ``quiet`` hides what it prints."""
    # PIP_USER=1 in somebody's shell would make pip refuse to write into a virtual environment.
    surroundings = {name: value for name, value in os.environ.items() if name != "PIP_USER"}
    sink = subprocess.DEVNULL if quiet else None
    return subprocess.run(command, env=surroundings, stdout=sink, stderr=sink, check=False).returncode == 0
