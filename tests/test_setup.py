"""Set-up: the lock, the bootstrap that installs it, and the commands.

The environments made here hold one small package that is written on the spot, so that no test needs
a network; where uv is not to be had, as here, pip does the work, and that is the way under test.
"""

import ast
import hashlib
import importlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
LOCK = (ROOT / "environment-pip.txt").read_text(encoding="utf-8")
PYTHONS = ("3.11", "3.12", "3.13")

BACKEND = '''\
"""A build backend that makes an editable wheel of the package `tiny` and needs nothing."""
import zipfile
from pathlib import Path

META = "Metadata-Version: 2.1\\nName: tiny\\nVersion: 1\\n"
KIND = "Wheel-Version: 1.0\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n"

def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    name = "tiny-1-py3-none-any.whl"
    with zipfile.ZipFile(Path(wheel_directory, name), "w") as wheel:
        wheel.writestr("tiny.pth", str(Path.cwd() / "src"))
        wheel.writestr("tiny-1.dist-info/METADATA", META)
        wheel.writestr("tiny-1.dist-info/WHEEL", KIND)
        wheel.writestr("tiny-1.dist-info/RECORD", "")
    return name
'''


def pins(lock: str = LOCK) -> list[Requirement]:
    return [Requirement(line.rstrip(" \\")) for line in lock.splitlines() if re.match(r"[\w.-]+==", line)]


def direct_dependencies() -> list[Requirement]:
    lines = (ROOT / "environment.in").read_text(encoding="utf-8").splitlines()
    stripped = (line.partition("#")[0].strip() for line in lines)
    return [Requirement(line) for line in stripped if line]


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


# -- the lock ---------------------------------------------------------------------------


def test_every_pin_of_the_lock_has_a_hash() -> None:
    entries = re.split(r"\n(?=[\w.-]+==)", "\n" + LOCK)[1:]
    assert len(entries) == len(pins()) > 100
    assert not [entry.splitlines()[0] for entry in entries if "--hash=sha256:" not in entry]


def test_lock_names_no_host_and_no_folder() -> None:
    assert not re.findall(r"\w+://|--index-url|--extra-index-url|--find-links| @ |(?:-r|via) +\S*/", LOCK)


@pytest.mark.parametrize("python", PYTHONS)
def test_lock_has_one_pin_of_each_direct_dependency_for(python: str) -> None:
    here = {"python_version": python, "python_full_version": f"{python}.0"}
    applying = [pin for pin in pins() if pin.marker is None or pin.marker.evaluate(here)]
    for wanted in direct_dependencies():
        found = [pin for pin in applying if canonical(pin.name) == canonical(wanted.name)]
        assert len(found) == 1, wanted
        assert wanted.specifier.contains(str(found[0].specifier).removeprefix("=="), prereleases=True), wanted


def test_lock_holds_what_the_package_needs_and_its_build_backend() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    needed = list(project["project"]["dependencies"])
    for extra in project["project"]["optional-dependencies"].values():
        needed += extra
    needed += [*project["build-system"]["requires"], "uv", "editables"]
    versions = {canonical(pin.name): str(pin.specifier).removeprefix("==") for pin in pins()}
    for requirement in map(Requirement, needed):
        assert requirement.specifier.contains(versions[canonical(requirement.name)]), requirement


# -- the bootstrap ----------------------------------------------------------------------


def project(root: Path) -> Path:
    """A project with the bootstrap, one locked package (a wheel beside it) and one of its own."""
    shutil.copytree(ROOT / "scripts", root / "scripts", ignore=shutil.ignore_patterns("__pycache__"))
    (root / "src").mkdir()
    (root / "src" / "tiny.py").write_text("import locked\n")
    (root / "backend.py").write_text(BACKEND)
    (root / "pyproject.toml").write_text(
        '[build-system]\nrequires = []\nbuild-backend = "backend"\nbackend-path = ["."]\n'
        '[project]\nname = "tiny"\nversion = "1"\n'
    )
    lock(root, wheel(root, "locked", "1"))
    return root


def wheel(root: Path, name: str, version: str) -> Path:
    path = root / "wheels" / f"{name}-{version}-py3-none-any.whl"
    path.parent.mkdir(exist_ok=True)
    info = f"{name}-{version}.dist-info"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{name}.py", f"version = {version!r}\n")
        archive.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        archive.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        archive.writestr(f"{info}/RECORD", "")
    return path


def lock(root: Path, package: Path, digest: str | None = None) -> None:
    name, version = package.name.split("-")[:2]
    digest = digest or hashlib.sha256(package.read_bytes()).hexdigest()
    unobtainable = "uv==0.13.9 \\\n    --hash=sha256:" + 64 * "0" + "\n    # via -r environment.in\n"
    entry = f"{name}=={version} \\\n    --hash=sha256:{digest}\n"
    (root / "environment-pip.txt").write_text(unobtainable + entry)


def bootstrap(root: Path) -> subprocess.CompletedProcess[str]:
    surroundings = {
        **os.environ,
        "PIP_CONFIG_FILE": os.devnull,
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": str(root / "wheels"),
    }
    return subprocess.run(
        [sys.executable, "scripts/bootstrap.py"],
        cwd=root,
        env=surroundings,
        capture_output=True,
        text=True,
        check=False,
    )


def imported(root: Path) -> str:
    """The version of the locked package as the project's own package sees it in its environment."""
    command = [str(root / ".venv" / "bin" / "python"), "-c", "import tiny; print(tiny.locked.version)"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


class Installed(NamedTuple):
    """A project, its environment made over what an interrupted installation had left."""

    root: Path
    call: subprocess.CompletedProcess[str]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    root = project(tmp_path_factory.mktemp("setup") / "project")
    (root / ".venv" / "bin").mkdir(parents=True)
    (root / ".venv" / "bin" / "python").symlink_to(sys.executable)
    (root / ".venv" / "half").write_text("left by what was interrupted")
    return Installed(root, bootstrap(root))


@pytest.fixture
def installation(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(ROOT / "scripts")
    return importlib.import_module("installation")


def test_pip_installs_the_lock_where_uv_is_not_to_be_had(installed: Installed) -> None:
    assert installed.call.returncode == 0, installed.call.stderr
    assert "uv is not to be had" in installed.call.stdout
    assert "installing environment-pip.txt with pip" in installed.call.stdout
    assert imported(installed.root) == "1"


def test_environment_without_a_stamp_is_made_afresh(installed: Installed) -> None:
    assert not (installed.root / ".venv" / "half").exists()


def test_second_call_does_nothing(installed: Installed) -> None:
    again = bootstrap(installed.root)
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")


def test_edited_project_file_installs_the_project_alone(installed: Installed) -> None:
    with (installed.root / "pyproject.toml").open("a") as file:
        file.write("# edited\n")
    again = bootstrap(installed.root)
    assert "is complete" in again.stdout
    assert "installing environment-pip.txt" not in again.stdout


def test_package_that_does_not_match_its_hash_is_not_installed(
    installed: Installed,
    installation: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(installed.root / "wheels"))
    newer = wheel(installed.root, "locked", "2")
    lock(installed.root, newer, digest=64 * "1")
    python = installed.root / ".venv" / "bin" / "python"
    with pytest.raises(installation.InstallationError, match=r"environment-pip\.txt could not be installed"):
        installation.install_lock(python, installed.root / "environment-pip.txt", "pip")
    assert "DO NOT MATCH THE HASHES" in capfd.readouterr().err
    assert imported(installed.root) == "1"


@pytest.mark.parametrize("step", ["create", "install_lock", "install_project"])
def test_installation_interrupted_at_any_step_is_not_taken_for_a_whole_one(
    step: str, installation: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    root = project(tmp_path / "project")
    stamp = root / ".venv" / installation.STAMP
    stamp.parent.mkdir()
    stamp.write_text("made from another lock\n")
    for name in ("create", "install_lock", "install_project"):
        monkeypatch.setattr(installation, name, interrupt if name == step else lambda *_: None)
    with pytest.raises(KeyboardInterrupt):
        installation.install(root)
    assert not stamp.exists()


def test_moved_project_and_other_python_and_other_lock_are_noticed(
    installation: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    root = project(tmp_path / "project")
    before = installation.fingerprint(root)
    monkeypatch.setattr(platform, "python_version", lambda: "3.12.99")
    assert installation.fingerprint(root) != before
    monkeypatch.undo()
    assert installation.fingerprint(root) == before
    moved = root.rename(tmp_path / "moved")
    assert installation.fingerprint(moved) != before
    moved.rename(root)
    lock(root, wheel(root, "locked", "2"))
    assert installation.fingerprint(root) != before


def test_bootstrap_can_be_read_by_every_python_since_3_4() -> None:
    ast.parse((ROOT / "scripts" / "bootstrap.py").read_text(encoding="utf-8"), feature_version=(3, 4))


@pytest.mark.parametrize("version", ["(2, 7, 18)", "(3, 10, 13)", "(3, 14, 0)"])
def test_unsuitable_python_is_refused_with_a_sentence(version: str) -> None:
    pretend = f"import runpy, sys; sys.version_info = {version}; "
    pretend += "runpy.run_path('scripts/bootstrap.py', run_name='__main__')"
    done = subprocess.run(
        [sys.executable, "-c", pretend], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    named = ".".join(map(str, ast.literal_eval(version)))
    assert f"needs Python 3.11, 3.12 or 3.13, and this is Python {named}" in done.stderr
    assert "Traceback" not in done.stderr


# -- the commands -----------------------------------------------------------------------


def make(*words: str) -> subprocess.CompletedProcess[str]:
    # These tests may themselves be called by make, whose options are not theirs.
    surroundings = {
        name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))
    }
    return subprocess.run(
        ["make", *words], cwd=ROOT, env=surroundings, capture_output=True, text=True, check=False
    )


@dataclass
class Rehearsal:
    """`make` with stand-ins for the tools, which write down that they were called."""

    folder: Path

    def __call__(self, target: str, failing: str = "nothing") -> tuple[int, list[str]]:
        """Exit status of `make`, and the tools it called; a call that holds `failing` fails."""
        called = self.folder / "called"
        called.write_text("")
        for tool in ("ruff", "mypy", "lint-imports", "thesis", "python"):
            script = self.folder / tool
            script.write_text(
                f'#!/bin/sh\ncall="{tool} $*"\necho "$call" >> "{called}"\n'
                f'case "$call" in *"{failing}"*) exit 1;; esac\n'
            )
            script.chmod(0o755)
        done = make(f"BIN={self.folder}", f"PYTHON={self.folder / 'python'}", target)
        return done.returncode, called.read_text().splitlines()


@pytest.fixture
def rehearsal(tmp_path: Path) -> Rehearsal:
    return Rehearsal(tmp_path)


INSTALL = ["python scripts/bootstrap.py"]
COLLECT = "python -m pytest --collect-only -qq"
LINT = ["ruff check .", "ruff format --check .", "mypy ", "lint-imports ", COLLECT]
BOOK = ["thesis run --all", "thesis check", "thesis site"]


def test_make_book_installs_runs_checks_and_builds(rehearsal: Rehearsal) -> None:
    assert rehearsal("book") == (0, INSTALL + BOOK)


def test_make_test_lints_runs_checks_builds_and_ends_with_one_pytest(rehearsal: Rehearsal) -> None:
    pytest_call = ["python -m pytest --cov --cov-report=term"]
    assert rehearsal("test") == (0, INSTALL + LINT + BOOK + pytest_call)


def test_make_test_fast_leaves_only_the_chapters_out(rehearsal: Rehearsal) -> None:
    assert rehearsal("test-fast") == (0, [*INSTALL, *LINT, "python -m pytest -m not book"])


@pytest.mark.parametrize("step", [*INSTALL, *LINT, *BOOK, "python -m pytest --cov"])
def test_failed_step_fails_make_test_and_ends_it(rehearsal: Rehearsal, step: str) -> None:
    status, called = rehearsal("test", failing=step)
    assert status != 0
    assert step in called[-1]
    assert all(step not in call for call in called[:-1])


def test_continuous_integration_is_make_test_and_nothing_else() -> None:
    script = ROOT / ".ci" / "run"
    assert os.access(script, os.X_OK)
    assert script.read_text(encoding="utf-8").splitlines()[-1] == "exec make test"


def test_help_lists_every_command() -> None:
    listed = make("help").stdout
    for target in ("book", "test", "test-fast", "lint", "lock", "clean", "help"):
        assert re.search(rf"^make {target} ", listed, re.MULTILINE), target
