"""Accepting a run tells old and new first, and leaves tolerances alone unless told."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from thesislib.companion import checks
from thesislib.companion.acceptance import Wishes, accept
from thesislib.companion.chapters import InputError

SCHEMA = json.loads((Path(__file__).resolve().parents[2] / "docs" / "record-schema.json").read_text())
NEW = Wishes(new=1e-3, reason="Two start meshes agree to a tenth of it.")


def content(*, mass: float = 2.0, points: int = 1001, end: float = 10.0, **values: float) -> dict[str, Any]:
    s = np.linspace(0.0, end, points)
    named = {"mass": mass} | values
    curve = {"abscissa": s.tolist(), "ordinate": (mass * s).tolist(), "abscissa_unit": "m", "unit": "kg m"}
    return {
        "schema": 1,
        "chapter": "01",
        "figures": {"4.7": {"series": {"moment": curve}}},
        "tables": {
            "4.1": {
                "columns": {
                    "row": {"values": ["a", "b"], "unit": ""},
                    "m": {"values": [1.0, mass], "unit": "kg"},
                }
            }
        },
        "values": {name: {"value": value, "unit": "kg"} for name, value in named.items()},
    }


@pytest.fixture
def run(project: Any, finished: Callable[..., None]) -> Callable[..., list[str]]:
    """Write down a run of chapter 01 and accept it; return what was said."""

    def write_and_accept(wishes: Wishes, record: dict[str, Any], **changes: Any) -> list[str]:
        finished(project, record, **changes)
        said: list[str] = []
        accept(project.chapter("01"), wishes, said.append)
        return said

    return write_and_accept


def stored(project: Any) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((project.root / "data/expected/01.json").read_text())
    return read


def test_a_first_run_is_accepted_with_a_tolerance_and_then_agrees(
    project: Any, run: Callable[..., list[str]]
) -> None:
    said = run(NEW, content())
    assert "01 values/mass: is new, 2 kg" in said
    assert f"01 tables/4.1/m: tolerance (absolute:relative) 0.002:0.0 ({NEW.reason})" in said
    made = stored(project)
    jsonschema.validate(made, SCHEMA)
    assert made["values"]["mass"]["tolerance"] == {"absolute": 0.002, "relative": 0.0, "reason": NEW.reason}
    series = made["figures"]["4.7"]["series"]["moment"]
    assert len(series["abscissa"]) == 400, "stored series are thinned"
    assert (series["abscissa"][0], series["abscissa"][-1]) == (0.0, 10.0)
    assert series["tolerance"]["absolute"] == 0.02
    assert checks.check(project.chapter("01")) == []


def test_accepting_again_tells_each_difference_and_keeps_tolerances_and_abscissae(
    project: Any, run: Callable[..., list[str]]
) -> None:
    run(NEW, content())
    before = stored(project)
    said = run(Wishes(), content(mass=2.5, points=777))
    assert said == [
        "01 figures/4.7/moment: at 10 m, 20 becomes 25 kg m (difference +5)",
        "01 tables/4.1/m: in row 2, 2 becomes 2.5 kg (difference +0.5)",
        "01 values/mass: 2 becomes 2.5 kg (difference +0.5)",
    ]
    after = stored(project)
    assert after["values"]["mass"]["value"] == 2.5
    for kind in ("figures/4.7/moment", "tables/4.1/m", "values/mass"):
        old, new = checks.quantities(before)[kind], checks.quantities(after)[kind]
        assert new["tolerance"] == old["tolerance"]
        assert new.get("abscissa") == old.get("abscissa")
    assert checks.check(project.chapter("01")) == []


def test_nothing_is_written_when_nothing_changes(project: Any, run: Callable[..., list[str]]) -> None:
    run(NEW, content())
    path: Path = project.root / "data/expected/01.json"
    before = path.stat().st_mtime_ns
    assert run(Wishes(), content()) == ["01 nothing changes"]
    assert path.stat().st_mtime_ns == before


def test_differences_are_told_before_anything_is_written(
    project: Any, run: Callable[..., list[str]], finished: Callable[..., None]
) -> None:
    run(NEW, content())
    before = stored(project)
    finished(project, content(mass=2.5))

    def stop(line: str) -> None:
        assert stored(project) == before
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        accept(project.chapter("01"), Wishes(), stop)
    assert stored(project) == before


def test_a_tolerance_changes_only_when_told_and_is_told(project: Any, run: Callable[..., list[str]]) -> None:
    run(NEW, content())
    made = stored(project)
    made["values"]["mass"]["tolerance"]["spread"] = 0.001
    (project.root / "data/expected/01.json").write_text(json.dumps(made))
    said = run(Wishes({"values/mass": (0.5, 0.01)}, reason="The spread grew."), content())
    assert said == [
        "01 values/mass: tolerance (absolute:relative) 0.002:0.0 becomes 0.5:0.01 (The spread grew.)"
    ]
    tolerance = stored(project)["values"]["mass"]["tolerance"]
    assert tolerance == {"absolute": 0.5, "relative": 0.01, "reason": "The spread grew.", "spread": 0.001}
    with pytest.raises(InputError, match="less than the measured spread"):
        run(Wishes({"values/mass": (1e-4, 0.0)}, reason="Tight."), content())


def test_a_tolerance_from_agreeing_runs_is_three_times_their_largest_difference(
    project: Any, run: Callable[..., list[str]]
) -> None:
    others = [content(mass=2.01), content(mass=1.98, points=501)]
    run(Wishes(new=1e-6, reason="Measured over three runs.", agreeing=others), content())
    found = stored(project)
    assert found["values"]["mass"]["tolerance"]["absolute"] == pytest.approx(0.06)
    assert found["values"]["mass"]["tolerance"]["spread"] == pytest.approx(0.02)
    moment = found["figures"]["4.7"]["series"]["moment"]["tolerance"]
    assert moment["spread"] == pytest.approx(0.2), "the runs differ most at the end of the abscissa"


def test_a_quantity_that_no_agreeing_run_has_gets_the_new_tolerance(
    project: Any, run: Callable[..., list[str]]
) -> None:
    other = content(mass=2.01)
    del other["values"]["mass"]
    run(Wishes(new=1e-3, reason="Measured.", agreeing=[other]), content())
    found = stored(project)
    assert found["values"]["mass"]["tolerance"] == {"absolute": 0.002, "relative": 0.0, "reason": "Measured."}
    assert found["tables"]["4.1"]["columns"]["m"]["tolerance"]["spread"] == pytest.approx(0.01)


def test_agreeing_runs_with_another_number_of_rows_are_refused(
    project: Any, run: Callable[..., list[str]]
) -> None:
    other = content()
    other["tables"]["4.1"]["columns"]["m"]["values"] = [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match=r"tables/4\.1/m cannot be compared with a run that should agree"):
        run(Wishes(new=1e-6, reason="Measured.", agreeing=[other]), content())


def test_a_series_that_no_longer_reaches_as_far_gets_a_new_abscissa(
    project: Any, run: Callable[..., list[str]]
) -> None:
    run(NEW, content())
    said = run(Wishes(), content(end=5.0))
    assert "01 figures/4.7/moment: the abscissa changes (400 points)" in said
    assert checks.check(project.chapter("01")) == []


def test_quantities_come_and_go_with_the_run(project: Any, run: Callable[..., list[str]]) -> None:
    run(NEW, content(ballast=1.0))
    record = content()
    record["tables"]["4.1"]["columns"]["row"]["values"] = ["a", "c"]
    record["tables"]["4.1"]["columns"]["m"]["values"].append(3.0)
    record["tables"]["4.1"]["columns"]["row"]["values"].append("d")
    record["values"]["mass"]["unit"] = "t"
    assert run(Wishes(), record) == [
        "01 tables/4.1/row: changes",
        "01 tables/4.1/m: 2 numbers become 3",
        "01 values/mass: unit 'kg' becomes 't'",
        "01 values/ballast: is not recorded any more, and is dropped",
    ]
    assert set(stored(project)["values"]) == {"mass"}
    assert checks.check(project.chapter("01")) == []


def test_a_quantity_that_is_zero_gets_the_tolerance_as_it_stands(
    project: Any, run: Callable[..., list[str]]
) -> None:
    run(NEW, content(zero=0.0))
    assert stored(project)["values"]["zero"]["tolerance"]["absolute"] == 1e-3


@pytest.mark.parametrize(
    ("wishes", "changes", "said"),
    [
        (NEW, {"changed": True}, "has changed parameters and cannot be accepted"),
        (NEW, {"from_solution": True}, "used stored solutions and cannot be accepted"),
        (NEW, {"status": "running"}, "has the status 'running', not 'finished'. It cannot be accepted"),
        (NEW, {"hash": "0" * 64}, "cannot be accepted"),
        (Wishes(), {}, "without a stored tolerance: figures/4.7/moment, tables/4.1/m, values/mass"),
        (Wishes(new=1e-3), {}, "set with its reason only"),
        (Wishes(new=1e-3, reason=" "), {}, "set with its reason only"),
        (Wishes({"values/mass": (1.0, 0.0)}, new=1e-3), {}, "set with its reason only"),
        (Wishes({"values/mess": (1.0, 0.0)}, reason="r"), {}, "records no number named 'values/mess'"),
        (Wishes({"tables/4.1/row": (1.0, 0.0)}, reason="r"), {}, "no number named 'tables/4.1/row'"),
        (Wishes(new=-1.0, reason="r"), {}, "not a finite number from 0 up"),
        (Wishes(new=float("nan"), reason="r"), {}, "not a finite number from 0 up"),
        (Wishes({"values/mass": (-1.0, 0.0)}, new=1e-3, reason="r"), {}, "not a finite number from 0 up"),
    ],
)
def test_what_may_not_be_stored_is_refused_and_nothing_is_written(
    project: Any, run: Callable[..., list[str]], wishes: Wishes, changes: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError) as info:
        run(wishes, content(), **changes)
    assert said in str(info.value)
    assert not (project.root / "data/expected/01.json").exists()


def test_a_stale_run_and_a_run_that_failed_are_refused(
    project: Any, run: Callable[..., list[str]], finished: Callable[..., None]
) -> None:
    finished(project, content())
    (project.root / "data/vehicles/car.toml").write_text("mass = 700.0\n")
    with pytest.raises(InputError, match=r"car\.toml has changed\. It cannot be accepted"):
        accept(project.chapter("01"), NEW, print)
    finished(project, content())
    (project.root / "_build/failed").mkdir()
    (project.root / "_build/failed/01_small.json").write_text('{"failure": "its kernel died"}')
    with pytest.raises(InputError, match="The last run of chapter 01 failed: its kernel died"):
        accept(project.chapter("01"), NEW, print)


def test_a_chapter_that_has_not_been_run_cannot_be_accepted(project: Any) -> None:
    project.add("01", "1")
    with pytest.raises(InputError, match="has not been run; there is nothing to accept"):
        accept(project.chapter("01"), NEW, print)


def test_printed_thesis_values_are_never_written(project: Any, run: Callable[..., list[str]]) -> None:
    path: Path = project.root / "data/thesis/01.json"
    before = path.read_bytes(), path.stat().st_mtime_ns
    run(NEW, content())
    assert (path.read_bytes(), path.stat().st_mtime_ns) == before
