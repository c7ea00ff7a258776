"""What a process has used, and the hashes that tell whether it is still the same."""

import fnmatch
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from thesislib import provenance
from thesislib.provenance import Usage


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("book", "data/tracks", "data/expected", "data/thesis"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / provenance.LOCK).write_text("numpy==2.4\n")
    (tmp_path / "data/tracks/short.csv").write_text("1,2\n3,4\n")
    (tmp_path / "data/expected/01.json").write_text("{}")
    (tmp_path / "data/thesis/01.json").write_text("{}")
    monkeypatch.delenv("THESIS_ROOT", raising=False)
    monkeypatch.setattr(provenance._watch, "elsewhere", Usage())
    return tmp_path


def test_files_opened_below_data_are_remembered_however_they_are_opened(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (root / "data/a.bin").write_bytes(b"a")
    (root / "data/b.toml").write_text("b = 1")
    provenance.watch(root)
    monkeypatch.chdir(root / "book")
    assert np.loadtxt("../data/tracks/short.csv", delimiter=",").shape == (2, 2)
    os.close(os.open(root / "data/a.bin", os.O_RDONLY))
    os.close(os.open(os.fsencode(root / "data/b.toml"), os.O_RDONLY))
    assert provenance.opened_data_files() == {"data/tracks/short.csv", "data/a.bin", "data/b.toml"}


def test_stored_values_and_files_outside_data_do_not_count_as_used(root: Path) -> None:
    provenance.watch(root)
    (root / "data/expected/01.json").read_text()
    (root / "data/thesis/01.json").read_text()
    (root / provenance.LOCK).read_text()
    assert provenance.opened_data_files() == frozenset()


def test_hashing_a_file_is_not_using_it(root: Path) -> None:
    provenance.watch(root)
    provenance.source_hash(root=root)
    assert provenance.opened_data_files() == frozenset()
    (root / "data/tracks/short.csv").read_text()
    assert provenance.opened_data_files() == {"data/tracks/short.csv"}


def test_another_root_forgets_what_was_opened_below_the_first(root: Path, tmp_path: Path) -> None:
    provenance.watch(root)
    (root / "data/tracks/short.csv").read_text()
    assert provenance.opened_data_files()
    (tmp_path / "other/data").mkdir(parents=True)
    provenance.watch(tmp_path / "other")
    assert provenance.opened_data_files() == frozenset()


def test_what_another_process_has_used_is_added(root: Path) -> None:
    provenance.watch(root)
    provenance.merge(Usage(frozenset({"thesislib.elsewhere"}), frozenset({"data/elsewhere.csv"})))
    used = provenance.usage()
    assert {"thesislib.elsewhere", "thesislib.provenance"} <= used.modules
    assert used.data_files == {"data/elsewhere.csv"}
    assert Usage.from_lists(used.as_lists()) == used


def test_loaded_modules_are_this_packages_and_no_others() -> None:
    loaded = provenance.loaded_modules()
    assert "thesislib.provenance" in loaded
    assert all(name.partition(".")[0] == "thesislib" for name in loaded)


def test_importing_provenance_loads_nothing_but_the_standard_library() -> None:
    script = (
        "import sys; import thesislib.provenance;"
        "print(*sorted({name.partition('.')[0] for name in sys.modules} - set(sys.stdlib_module_names)))"
    )
    done = subprocess.run([sys.executable, "-I", "-c", script], capture_output=True, text=True, check=True)
    beyond = {name for name in done.stdout.split() if not name.startswith("_")}
    assert beyond == {"thesislib"}


def test_source_files_are_named_as_they_are_imported() -> None:
    files = provenance.source_files()
    assert files["thesislib"] == provenance.PACKAGE / "__init__.py"
    assert files["thesislib.companion.records"] == provenance.PACKAGE / "companion" / "records.py"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package whose modules a test may edit."""
    package = tmp_path / "src" / "thesislib"
    (package / "lap").mkdir(parents=True)
    for name in ("__init__", "provenance", "lap/__init__", "lap/figures", "lap/minimum_time"):
        (package / f"{name}.py").write_text(f"# {name}\n")
    return package


@pytest.mark.parametrize(
    ("edited", "moves"),
    [
        ("src/thesislib/lap/minimum_time.py", True),
        ("src/thesislib/lap/figures.py", False),
        ("data/tracks/short.csv", True),
        ("data/expected/01.json", False),
        ("data/thesis/01.json", False),
        ("environment-pip.txt", True),
        ("book/01_page.md", False),
    ],
)
def test_source_hash_moves_with_what_a_solution_may_depend_on(
    root: Path, package: Path, edited: str, moves: bool
) -> None:
    before = provenance.source_hash(root=root, package=package)
    with (root / edited).open("a") as file:
        file.write("# edited\n")
    assert (provenance.source_hash(root=root, package=package) != before) is moves


def test_modules_that_draw_and_none_that_solve_are_excluded_from_the_source_hash() -> None:
    """One that is forgotten would have every lap solved again for a colour."""
    for module, path in provenance.source_files().items():
        name = module.partition(".")[2]
        if name.partition(".")[0] in ("companion", "__main__"):
            continue
        draws = (
            re.search(r"^\s*(import|from) (matplotlib|plotly)", path.read_text(), re.MULTILINE) is not None
        )
        excluded = any(fnmatch.fnmatchcase(name, pattern) for pattern in provenance.DRAWING_MODULES)
        assert excluded or not draws, f"{module} draws"
        solves = re.search(r"^\s*(import|from) (casadi|thesislib.ocp)", path.read_text(), re.MULTILINE)
        assert not (excluded and solves), f"{module} solves"


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "record.json"
    provenance.write_atomically(path, "old")

    def full_disk(self: Path, content: bytes) -> int:
        shutil.copy(path, self)
        raise OSError("No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full_disk)
    with pytest.raises(OSError, match="No space"):
        provenance.write_atomically(path, "new")
    assert path.read_text() == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["record.json"]


def test_hash_of_a_missing_file_says_that_it_is_absent(tmp_path: Path) -> None:
    assert provenance.file_hash(tmp_path / "nothing") == provenance.ABSENT
    assert provenance.file_hash(tmp_path) == provenance.ABSENT


def test_digest_depends_on_content_and_not_on_order_of_names() -> None:
    assert provenance.digest({"a": 1, "b": 2.5}) == provenance.digest({"b": 2.5, "a": 1})
    assert provenance.digest({"a": 1}) != provenance.digest({"a": 1.5})
    with pytest.raises(TypeError):
        provenance.digest({"a": {1, 2}})


def test_root_is_the_named_folder_or_the_nearest_project_above(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(root / "data/tracks")
    assert provenance.project_root() == root.resolve()
    monkeypatch.setenv("THESIS_ROOT", str(root / "data"))
    with pytest.raises(FileNotFoundError, match="has no folder book/"):
        provenance.project_root()
