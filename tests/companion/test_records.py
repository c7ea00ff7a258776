"""Records hold what a chapter shows, in full precision; what cannot be checked later is refused."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from matplotlib.figure import Figure

from thesislib.companion import Record, Series, documents
from thesislib.companion.quantities import RecordError

SCHEMA = json.loads((Path(__file__).resolve().parents[2] / "docs" / "record-schema.json").read_text())

SUMMARY: dict[str, Any] = {
    "status": "Solve_Succeeded",
    "error_estimate": np.float64(9e-6),
    "tolerance": 1e-5,
    "points": np.int64(3400),
    "intervals": 800,
    "meshes": 7,
    "iterations": 300,
    "seconds": 60.0,
    "stored": False,
}


class Solution:
    def __init__(self, **changes: Any) -> None:
        self.changes = changes

    def summary(self) -> dict[str, Any]:
        return {name: value for name, value in (SUMMARY | self.changes).items() if value is not ...}


@pytest.fixture
def record(project: Any, monkeypatch: pytest.MonkeyPatch) -> Record:
    """The record of a run."""
    monkeypatch.setenv("THESIS_RUN_DIR", str(project.root / "_build/run/.01.unfinished"))
    monkeypatch.setenv("THESIS_CHAPTER", "01")
    return Record("01")


def drawn() -> Figure:
    figure = Figure()
    figure.add_subplot().plot([0, 1], [1, 2])
    return figure


def content(record: Record) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((record.folder / "record.json").read_text())
    return read


def test_everything_recorded_comes_back_to_the_last_bit(record: Record) -> None:
    s = np.linspace(0.0, 1.0, 7) / 3.0
    u = np.sqrt(s + 0.1)
    record.figure("4.7", drawn(), series={"speed": Series(s, u, "m", "m/s", period=0.5)})
    record.table("4.1", {"input": (["front", "rear"], ""), "C_L": (u[:2], "1/m")})
    record.value("lap_time", np.float64(84.5) / 3, "s")
    record.value("gears", 7, "")
    record.solve("row C", Solution(compiled=True, converged=True, objective=84.5, regularisation=1e-4))
    record.solve("row A", Solution(stored=...), stored=True)
    read = content(record)
    series = read["figures"]["4.7"]["series"]["speed"]
    assert series["abscissa"] == s.tolist() and series["ordinate"] == u.tolist()
    assert (series["abscissa_unit"], series["unit"], series["period"]) == ("m", "m/s", 0.5)
    assert read["figures"]["4.7"]["picture"] == "figure_4.7.png"
    assert read["tables"]["4.1"]["columns"]["C_L"] == {"values": u[:2].tolist(), "unit": "1/m"}
    assert read["tables"]["4.1"]["columns"]["input"]["values"] == ["front", "rear"]
    assert read["values"] == {"lap_time": {"value": 84.5 / 3, "unit": "s"}, "gears": {"value": 7, "unit": ""}}
    row_c, row_a = read["solves"]
    more = {"compiled": True, "converged": True, "objective": 84.5, "regularisation": 1e-4}
    assert row_c == {"name": "row C", **SUMMARY, **more}
    assert row_a == {"name": "row A", **SUMMARY, "stored": True}
    with (record.folder / "figure_4.7_speed.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["abscissa [m]", "speed [m/s]"]
    assert [float(row[1]) for row in rows[1:]] == u.tolist()
    with (record.folder / "table_4.1.csv").open() as file:
        assert next(csv.reader(file)) == ["input []", "C_L [1/m]"]
    jsonschema.validate(read, SCHEMA)


def series(*, s: Any = (0.0, 1.0), u: Any = (1.0, 2.0), **options: Any) -> Series:
    return Series(s, u, **{"abscissa_unit": "m", "unit": "m/s", **options})


@pytest.mark.parametrize(
    ("curve", "said"),
    [
        (series(u=[1.0, math.nan]), "series u is nan at point 2; only finite"),
        (series(s=[0.0, math.inf]), "series u, abscissa is inf at point 2; only finite"),
        (series(u=[1.0, 2.0, 3.0]), "has 2 abscissae and 3 ordinates"),
        (series(s=[1.0], u=[1.0]), "has 1 points; a curve needs at least two"),
        (series(s=[0.0, 0.0]), "has the abscissa 0.0 after 0.0 (point 2): it must increase"),
        (series(s=[0.0, 2.0, 1.0], u=[1, 2, 3]), "has the abscissa 1.0 after 2.0 (point 3)"),
        (series(u=[[1.0, 2.0]]), "has shape (1, 2)"),
        (series(u=["a", "b"]), "must be a list of real numbers"),
        (series(u=[1.0, 2.0j]), "must be a list of real numbers"),
        (series(u=[True, False]), "must be a list of real numbers"),
        (series(period=0.5), "spans 1.0, which is more than its period 0.5"),
        (series(period=math.nan), "period of Figure 4.7, series u is nan"),
        (series(unit=None), "has the unit None"),
        (series(unit="m/s "), "has the unit 'm/s '"),
        (series(abscissa_unit=1), "abscissa has the unit 1"),
        (([0.0, 1.0], [1.0, 2.0]), "is a tuple, not a Series"),
    ],
)
def test_a_series_that_cannot_be_checked_is_refused(record: Record, curve: Any, said: str) -> None:
    with pytest.raises(RecordError) as info:
        record.figure("4.7", series={"u": curve})
    assert said in str(info.value) and "Figure 4.7, series u" in str(info.value)
    assert content(record)["figures"] == {}, "nothing of it is recorded"


@pytest.mark.parametrize("number", ["", "4", "4.7.1", "Fig 4.7", "G-G", 4.7, "../x"])
def test_a_figure_is_named_by_the_thesis_number_or_a_slug(record: Record, number: Any) -> None:
    with pytest.raises(RecordError, match="does not match"):
        record.figure(number, series={"u": series()})
    with pytest.raises(RecordError, match="does not match"):
        record.table(number, {"u": ([1.0], "")})


@pytest.mark.parametrize("name", ["", "a b", "a/b", "2nd", "picture"])
def test_a_malformed_name_of_a_series_is_refused(record: Record, name: str) -> None:
    with pytest.raises(RecordError, match=r"does not match|kept for the figure's picture"):
        record.figure("4.7", series={name: series()})


def test_a_quantity_is_recorded_once_in_a_run(record: Record) -> None:
    record.figure("g-g", series={"u": series()})
    record.table("4.1", {"u": ([1.0], "")})
    record.value("mass", 1.0, "kg")
    record.solve("row C", Solution())
    for again in (
        lambda: record.figure("g-g", series={"u": series()}),
        lambda: record.table("4.1", {"u": ([1.0], "")}),
        lambda: record.value("mass", 1.0, "kg"),
        lambda: record.solve("row C", Solution()),
    ):
        with pytest.raises(RecordError, match="is recorded twice"):
            again()


def test_a_cell_executed_again_in_a_session_replaces_what_it_recorded(project: Any) -> None:
    record = Record("01")
    assert record.folder == project.root / "_build/interactive/01"
    for mass in (1.0, 2.0):
        record.value("mass", mass, "kg")
        record.solve("row C", Solution(seconds=mass))
    read = content(record)
    assert read["values"]["mass"]["value"] == 2.0
    assert [solve["seconds"] for solve in read["solves"]] == [2.0]
    assert read["run"] == {"status": "interactive"}


def test_a_record_of_another_chapter_is_refused(record: Record) -> None:
    with pytest.raises(RecordError, match="a run of chapter '01', and it opens a record of '02'"):
        Record("02")


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({}, "Table 4.1 has no columns"),
        ({"a": ([1.0, 2.0], ""), "b": ([1.0], "")}, "different lengths: a 2, b 1"),
        ({"a": ([1.0, "x"], "")}, "column a has shape"),
        ({"a": (["x", 1.0], "")}, "column a has shape"),
        ({"a": ([1.0, math.inf], "")}, "column a is inf at point 2"),
        ({"a": ([], "")}, "column a has no rows"),
        ({"a": ([1.0], 5)}, "has the unit 5"),
        ({"a b": ([1.0], "")}, "does not match"),
    ],
)
def test_a_table_that_cannot_be_checked_is_refused(record: Record, columns: Any, said: str) -> None:
    with pytest.raises(RecordError) as info:
        record.table("4.1", columns)
    assert said in str(info.value)
    assert content(record)["tables"] == {}


@pytest.mark.parametrize("value", [math.nan, math.inf, "1.0", None, [1.0, 2.0], 1j, True])
def test_a_value_is_one_finite_number(record: Record, value: Any) -> None:
    with pytest.raises(RecordError, match=r"Value mass is .*(not one real number|only finite)"):
        record.value("mass", value, "kg")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"points": ...}, "lacks points"),
        ({"colour": 1}, "has the unknown entries colour"),
        ({"error_estimate": math.nan}, "error_estimate = nan; only finite"),
        ({"stored": 0}, "stored = 0, which is not a truth value"),
        ({"points": 3.5}, "points = 3.5, which is not a whole number"),
        ({"points": True}, "points = True, which is not a whole number"),
        ({"status": None}, "status = None, which is not a text"),
    ],
)
def test_a_solve_says_what_is_documented(record: Record, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(RecordError) as info:
        record.solve("row C", Solution(**changes))
    assert said in str(info.value)


def test_a_blank_figure_is_refused(record: Record) -> None:
    empty = Figure()
    empty.add_subplot()
    hidden = drawn()
    hidden.axes[0].set_visible(False)
    for figure, said in (
        (Figure(), "none of its 0 axes shows anything"),
        (empty, "none of its 1 axes shows anything"),
        (hidden, "one colour only"),
        ("figure", "is a str, not a matplotlib figure"),
    ):
        with pytest.raises(RecordError, match=said):
            record.figure("4.7", figure, series={"u": series()})
    with pytest.raises(RecordError, match="neither a picture nor a series"):
        record.figure("4.7", series={})
    assert content(record)["figures"] == {}


def test_documents_keep_every_bit_and_refuse_what_json_has_not(tmp_path: Path) -> None:
    value = {"x": [0.1 + 0.2, 1e-300, -0.0, 2**60, *np.linspace(0, 1, 9).tolist()], "e": [], "n": {"ä": None}}
    documents.write(tmp_path / "a.json", value)
    assert documents.read(tmp_path / "a.json") == value
    with pytest.raises(ValueError, match="not JSON compliant"):
        documents.formatted({"x": [math.nan]})


def test_one_changed_number_changes_one_line() -> None:
    numbers = np.linspace(0, 1, 400)
    before = documents.formatted({"x": numbers.tolist()}).splitlines()
    numbers[200] += 1e-9
    after = documents.formatted({"x": numbers.tolist()}).splitlines()
    assert sum(old != new for old, new in zip(before, after, strict=True)) == 1
    assert max(map(len, after)) <= 110


@pytest.mark.parametrize(
    ("text", "said"),
    [("{", "is not JSON"), ("[1]", "holds a list"), ('{"schema": 2}', "has schema 2; this program knows 1")],
)
def test_a_document_that_is_none_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(ValueError, match=said):
        documents.read(tmp_path / "a.json")
