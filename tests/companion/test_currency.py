"""A run is current as long as everything it used is unchanged, and no longer.

The record here is written down rather than run; `test_runs` does the same with a run.
"""

import json
import platform
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from thesislib import provenance
from thesislib.companion import currency
from thesislib.provenance import Usage

USED = Usage(
    frozenset({"thesislib", "thesislib.provenance", "thesislib.companion.records"}),
    frozenset({"data/tracks/short.csv", "data/vehicles/car.toml"}),
)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of the package, to be edited."""
    copy = tmp_path / "src" / "thesislib"
    shutil.copytree(provenance.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


@pytest.fixture
def record(project: Any, package: Path) -> dict[str, Any]:
    """The record of a run that used one TOML file, one CSV file and three modules."""
    project.add("01", "x = mass", parameters="mass: float = 1.0  # 0 .. 2, mass")
    project.chapter("01").executed.parent.mkdir(parents=True)
    project.chapter("01").executed.write_text("{}")
    ingredients = currency.ingredients(project.chapter("01"), USED, package=package)
    run = {"status": "finished", "hash": ingredients.hash, **asdict(ingredients)}
    return {"run": run | {"notebook": provenance.file_hash(project.chapter("01").executed)}}


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("data/vehicles/car.toml", "660.0", "660.1", "data file data/vehicles/car.toml has changed"),
        ("data/tracks/short.csv", "0.5", "0.6", "data file data/tracks/short.csv has changed"),
        ("book/01_small.md", "x = mass", "x = 2 * mass", "its code cells have changed"),
        ("book/01_small.md", "= 1.0", "= 1.5", "its code cells have changed"),
        ("environment-pip.txt", "2.4.6", "2.4.7", "the locked environment environment-pip.txt has changed"),
        ("src/thesislib/provenance.py", '"""', '"""\n', "module thesislib.provenance has changed"),
    ],
)
def test_editing_what_the_run_used_makes_it_stale(
    project: Any, record: dict[str, Any], package: Path, file: str, old: str, new: str, said: str
) -> None:
    assert currency.staleness(project.chapter("01"), record, package=package) is None
    replace(project.root / file, old, new)
    stale = currency.staleness(project.chapter("01"), record, package=package)
    assert stale == f"Since the run of chapter 01, {said}."


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("book/01_small.md", "Prose.", "Better prose."),
        ("book/01_small.md", "wall_limit_s: 120", "wall_limit_s: 240"),
        ("data/vehicles/unused.toml", "1.0", "2.0"),
        ("data/thesis/01.json", "2.0", "3.0"),
        ("src/thesislib/companion/checks.py", '"""', '"""\n'),
    ],
)
def test_editing_prose_or_what_the_run_did_not_use_does_not(
    project: Any, record: dict[str, Any], package: Path, file: str, old: str, new: str
) -> None:
    replace(project.root / file, old, new)
    assert currency.staleness(project.chapter("01"), record, package=package) is None


def test_another_python_makes_a_run_stale(
    project: Any, record: dict[str, Any], package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    was = platform.python_version()
    monkeypatch.setattr(platform, "python_version", lambda: "3.99.0")
    stale = currency.staleness(project.chapter("01"), record, package=package)
    assert stale == f"Since the run of chapter 01, Python has become 3.99.0 (it was {was})."


def test_what_is_gone_is_said_to_be_gone(project: Any, record: dict[str, Any], package: Path) -> None:
    (project.root / "data/tracks/short.csv").unlink()
    (package / "companion/records.py").unlink()
    stale = currency.staleness(project.chapter("01"), record, package=package)
    assert stale is not None
    assert "module thesislib.companion.records is gone" in stale
    assert "data file data/tracks/short.csv is gone" in stale


def test_many_changes_are_summed_up(project: Any, package: Path) -> None:
    names = [f"data/tracks/{i}.csv" for i in range(5)]
    project.add("01", "1")
    for name in names:
        (project.root / name).write_text(name)
    used = Usage(frozenset(), frozenset(names))
    ingredients = currency.ingredients(project.chapter("01"), used, package=package)
    for name in names:
        (project.root / name).write_text("")
    run = {"status": "finished", "hash": ingredients.hash, **asdict(ingredients)}
    stale = currency.staleness(project.chapter("01"), {"run": run}, package=package)
    assert stale is not None and stale.endswith("2 more data files have changed.")


def test_a_last_run_that_failed_is_told_though_the_record_before_it_is_good(
    project: Any, record: dict[str, Any], package: Path
) -> None:
    marker = currency.failure_file(project.chapter("01"))
    marker.parent.mkdir(parents=True)
    marker.write_text(json.dumps({"failure": "code cell 2 raised ValueError: no"}))
    stale = currency.staleness(project.chapter("01"), record, package=package)
    assert stale == "The last run of chapter 01 failed: code cell 2 raised ValueError: no"
    record["run"]["changed"] = True
    assert currency.staleness(project.chapter("01"), record, package=package) is None, "of another run"


def test_a_notebook_of_another_run_is_not_current(
    project: Any, record: dict[str, Any], package: Path
) -> None:
    project.chapter("01").executed.write_text("{} ")
    stale = currency.staleness(project.chapter("01"), record, package=package)
    assert stale == "The executed notebook of chapter 01 is not that of its record."


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"status": "running"}, "has the status 'running', not 'finished'"),
        ({"hash": "0" * 64}, "does not belong to what its run has used"),
        ({"lock": "0" * 64}, "does not belong to what its run has used"),
        ({"modules": None}, "does not say what its run has used"),
    ],
)
def test_a_record_that_was_tampered_with_is_not_current(
    project: Any, record: dict[str, Any], package: Path, changes: dict[str, Any], said: str
) -> None:
    record["run"] |= changes
    assert said in str(currency.staleness(project.chapter("01"), record, package=package))


def test_what_was_edited_during_a_run_counts_as_it_was_before(project: Any, package: Path) -> None:
    project.add("01", "1")
    before = currency.ingredients(project.chapter("01"), package=package)
    replace(project.root / "data/vehicles/car.toml", "660.0", "700.0")
    (project.root / "data/made_during_the_run.csv").write_text("1")
    used = Usage(USED.modules, USED.data_files | {"data/made_during_the_run.csv"})
    now = currency.ingredients(project.chapter("01"), used, package=package)
    ran = before.only(used, now)
    assert ran.data_files["data/vehicles/car.toml"] != now.data_files["data/vehicles/car.toml"]
    assert set(ran.data_files) == set(used.data_files)
    run = {"status": "finished", "hash": ran.hash, **asdict(ran)}
    stale = currency.staleness(project.chapter("01"), {"run": run}, package=package)
    assert stale is not None and "data/vehicles/car.toml has changed" in stale
