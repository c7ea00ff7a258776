"""The check: one line per miss, and nothing that is broken slips through."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from PIL import Image

from thesislib.companion import checks
from thesislib.companion.checks import misses

TOLERANCE = {"absolute": 0.01, "relative": 0.001, "reason": "The spread over two start meshes is 0.002."}
S = np.linspace(0.0, 10.0, 21)


def document() -> dict[str, Any]:
    """A record; with tolerances, its stored values."""
    return {
        "schema": 1,
        "chapter": "01",
        "figures": {
            "4.7": {
                "series": {
                    "speed": {
                        "abscissa": S.tolist(),
                        "ordinate": (10.0 + S).tolist(),
                        "abscissa_unit": "m",
                        "unit": "m/s",
                    }
                },
                "picture": "figure_4.7.png",
            }
        },
        "tables": {
            "4.1": {
                "columns": {
                    "input": {"values": ["front", "rear"], "unit": ""},
                    "C_L": {"values": [1.5, 1.3], "unit": ""},
                }
            }
        },
        "values": {"lap_time": {"value": 84.5, "unit": "s"}},
    }


@pytest.fixture
def stored() -> dict[str, Any]:
    made = document()
    for entry in (
        made["figures"]["4.7"]["series"]["speed"],
        made["tables"]["4.1"]["columns"]["C_L"],
        made["values"]["lap_time"],
    ):
        entry["tolerance"] = dict(TOLERANCE)
    return made


@pytest.fixture
def record() -> dict[str, Any]:
    return document()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    picture = Image.new("RGB", (4, 4), "white")
    picture.putpixel((1, 1), (0, 0, 0))
    picture.save(tmp_path / "figure_4.7.png")
    return tmp_path


def lines(record: dict[str, Any], stored: dict[str, Any], folder: Path) -> list[str]:
    return [str(miss) for miss in misses(record, stored, folder)]


def speed(document: dict[str, Any]) -> dict[str, Any]:
    entry: dict[str, Any] = document["figures"]["4.7"]["series"]["speed"]
    return entry


def test_a_record_agrees_with_itself_and_within_its_tolerances(
    record: dict[str, Any], stored: dict[str, Any], folder: Path
) -> None:
    schema = Path(__file__).resolve().parents[2] / "docs" / "record-schema.json"
    jsonschema.validate(stored, json.loads(schema.read_text()))
    assert lines(record, stored, folder) == []
    record["values"]["lap_time"]["value"] += 0.0945  # the limit is 0.01 + 0.001 * 84.5
    speed(record)["ordinate"] = (10.0 + S + 0.0199).tolist()
    assert lines(record, stored, folder) == []


def test_each_miss_is_one_line_with_place_numbers_and_limit(
    record: dict[str, Any], stored: dict[str, Any], folder: Path
) -> None:
    record["values"]["lap_time"]["value"] += 0.095
    speed(record)["ordinate"][4] += 0.5
    speed(record)["ordinate"][6] -= 0.6
    record["tables"]["4.1"]["columns"]["C_L"]["values"][1] = 1.2
    assert lines(record, stored, folder) == [
        "figures/4.7/speed at 3 m: expected 13 m/s, got 12.4 m/s, difference -0.6, limit 0.023; "
        "2 of 21 are out",
        "tables/4.1/C_L in row 2 (rear): expected 1.3, got 1.2, difference -0.1, limit 0.0113; "
        "1 of 2 are out",
        "values/lap_time expected 84.5 s, got 84.595 s, difference +0.095, limit 0.0945",
    ]


def test_another_mesh_is_no_difference(record: dict[str, Any], stored: dict[str, Any], folder: Path) -> None:
    other = np.unique(np.random.default_rng(1).uniform(0.0, 10.0, 57))
    assert other[0] > 0.0 and other[-1] < 10.0, "collocation points do not include the ends"
    speed(record).update(abscissa=other.tolist(), ordinate=(10.0 + other).tolist())
    speed(stored)["tolerance"] |= {"absolute": 1e-12, "relative": 0.0}
    assert lines(record, stored, folder) == []


def test_a_periodic_series_is_continued_over_its_ends(
    record: dict[str, Any], stored: dict[str, Any], folder: Path
) -> None:
    for each, s in ((stored, S[:-1]), (record, S[:-1] + 0.25)):
        speed(each).update(
            abscissa=s.tolist(), ordinate=np.sin(0.2 * np.pi * s).tolist(), period=10.0, unit="m/s"
        )
    speed(stored)["tolerance"] |= {"absolute": 0.013, "relative": 0.0}  # linear interpolation over 0.5
    assert lines(record, stored, folder) == []
    speed(record)["ordinate"][-1] += 0.1  # felt at s = 0 too, over the end of the lap
    assert "2 of 20 are out" in lines(record, stored, folder)[0]


def change(document: dict[str, Any], path: str, value: Any) -> None:
    *parents, last = path.split("/")
    for name in parents:
        document = document[name]
    if value is ...:
        del document[last]
    else:
        document[last] = value


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("values/lap_time", ..., "values/lap_time is stored and was not recorded"),
        ("values/top_speed", {"value": 1.0, "unit": ""}, "values/top_speed was recorded and is not stored"),
        ("figures/4.7/series/speed", ..., "figures/4.7/speed is stored and was not recorded"),
        ("figures/4.7", ..., "figures/4.7/picture is stored and was not recorded"),
        ("figures/4.7/picture", ..., "figures/4.7/picture is stored and was not recorded"),
        ("figures/4.7/picture", "gone.png", "figures/4.7/picture is missing: there is no gone.png"),
        ("figures/4.7/picture", "blank.png", "figures/4.7/picture is blank: blank.png has one colour only"),
        ("tables/4.1/columns/C_L", ..., "tables/4.1/C_L is stored and was not recorded"),
        ("values/lap_time/unit", "min", "values/lap_time has the unit 'min', and stored is 's'"),
        ("figures/4.7/series/speed/unit", "km/h", "speed has the unit 'km/h', and stored is 'm/s'"),
        ("figures/4.7/series/speed/abscissa_unit", "km", "has the abscissa unit 'km', and stored is 'm'"),
        ("figures/4.7/series/speed/period", 10.0, "has the period 10.0, and stored is None"),
        ("figures/4.7/series/speed/abscissa", (S + 1).tolist(), "reaches from 1 to 11 m, and stored is 0"),
        ("figures/4.7/series/speed/abscissa", (S - 1).tolist(), "reaches from -1 to 9 m, and stored is 0"),
        ("tables/4.1/columns/C_L/values", [1.5], "tables/4.1/C_L has 1 rows, and stored are 2"),
        ("tables/4.1/columns/C_L/values", ["1.5", "1.3"], "in row 1 (front): expected 1.5, got '1.5'"),
        ("tables/4.1/columns/input/values", ["front", "top"], "in row 2 (rear): expected 'rear', got 'top'"),
    ],
)
def test_whatever_is_broken_in_a_record_is_a_miss(
    record: dict[str, Any], stored: dict[str, Any], folder: Path, path: str, value: Any, said: str
) -> None:
    Image.new("RGB", (4, 4), "white").save(folder / "blank.png")
    change(record, path, value)
    assert any(said in line for line in lines(record, stored, folder)), lines(record, stored, folder)


@pytest.mark.parametrize(
    ("tolerance", "said"),
    [
        (..., "it has no tolerance"),
        (TOLERANCE | {"reason": " "}, "has no reason"),
        ({"absolute": 1.0, "relative": 0.0}, "has no reason"),
        ({"absolute": 1.0, "reason": "None."}, "relative = None, which is not a number"),
        (TOLERANCE | {"absolute": -1.0}, "absolute = -1.0, not a finite number from 0 up"),
        (TOLERANCE | {"absolute": float("inf")}, "absolute = inf, not a finite number"),
        (TOLERANCE | {"absolute": True}, "absolute = True, which is not a number"),
        (TOLERANCE | {"spread": 0.2}, "allows 0.0945, less than the measured spread 0.2"),
        (TOLERANCE | {"because": "x"}, "unknown entries: because"),
    ],
)
def test_a_tolerance_that_does_not_count_is_a_miss(
    record: dict[str, Any], stored: dict[str, Any], folder: Path, tolerance: Any, said: str
) -> None:
    change(stored, "values/lap_time/tolerance", tolerance)
    (line,) = lines(record, stored, folder)
    assert line.startswith("values/lap_time is stored without a tolerance that counts: ")
    assert said in line


def test_a_stored_value_that_is_not_a_number_is_a_miss(
    record: dict[str, Any], stored: dict[str, Any], folder: Path
) -> None:
    change(stored, "values/lap_time/value", float("nan"))
    assert "expected nan s, got 84.5 s" in lines(record, stored, folder)[0]


def break_nothing(project: Any) -> None:
    pass


def remove_record(project: Any) -> None:
    (project.root / "_build/run/01/record.json").unlink()


def fail_last_run(project: Any) -> None:
    remove_record(project)
    (project.root / "_build/failed").mkdir()
    (project.root / "_build/failed/01_small.json").write_text('{"failure": "code cell 1 raised E: e"}')


def leave_unfinished(project: Any) -> None:
    path = project.root / "_build/run/01/record.json"
    path.write_text(path.read_text().replace('"finished"', '"running"'))


def spoil_stored_values(project: Any) -> None:
    (project.root / "data/expected/01.json").write_text("{")


@pytest.mark.parametrize(
    ("breaking", "said"),
    [
        (break_nothing, "chapter 01 has no stored values"),
        (remove_record, "chapter 01 has not been run"),
        (fail_last_run, "chapter 01 failed in its last run: code cell 1 raised E: e"),
        (spoil_stored_values, "01.json is not JSON"),
        (leave_unfinished, "has the status 'running', not 'finished'"),
    ],
)
def test_a_run_or_stored_values_that_are_missing_are_a_miss(
    project: Any, finished: Callable[..., None], breaking: Callable[[Any], None], said: str
) -> None:
    finished(project, document())
    breaking(project)
    (miss,) = checks.check(project.chapter("01"))
    assert said in str(miss)


def test_stored_values_are_found_by_the_chapters_id(
    project: Any, finished: Callable[..., None], stored: dict[str, Any], folder: Path
) -> None:
    finished(project, document())
    path = project.root / "data/expected/01.json"
    path.write_text(json.dumps(stored))
    (folder / "figure_4.7.png").rename(project.root / "_build/run/01/figure_4.7.png")
    assert checks.check(project.chapter("01")) == []
    other = copy.deepcopy(stored)
    other["values"]["lap_time"]["value"] = 80.0
    path.write_text(json.dumps(other))
    assert len(checks.check(project.chapter("01"))) == 1
