"""Tables a chapter shows about its own run."""

import json
import time
from pathlib import Path
from typing import Any

import pytest

from thesislib.companion import Record, pages
from thesislib.companion.quantities import RecordError


@pytest.fixture
def record(project: Any) -> Record:
    return Record("01")


def row(record: Record, name: str) -> tuple[str, ...]:
    return record.compare([name]).rows[0]


@pytest.mark.parametrize(
    ("mass", "shown", "difference", "within"),
    [
        (2.0, "2.00 kg", "+0.00 kg", "yes"),
        (2.05, "2.05 kg", "+0.05 kg", "yes"),
        (1.95, "1.95 kg", "-0.05 kg", "yes"),
        (2.0501, "2.05 kg", "+0.05 kg", "no"),
        (1.99999, "2.00 kg", "+0.00 kg", "yes"),
        (1.9, "1.90 kg", "-0.10 kg", "no"),
    ],
)
def test_a_value_is_within_if_it_would_be_printed_as_in_the_thesis(
    record: Record, mass: float, shown: str, difference: str, within: str
) -> None:
    record.value("mass", mass, "kg")
    assert row(record, "mass") == ("mass", "2.0 kg", shown, difference, within, "Table 1.1, p. 7")


@pytest.mark.parametrize(
    ("sine", "difference", "within"),
    [(0.3, "+0.00", "yes"), (1.05, "+0.05", "yes"), (1.2, "+0.20", "no"), (-1.3, "-0.30", "no")],
)
def test_a_printed_range_counts_as_wide_as_it_is_printed(
    record: Record, sine: float, difference: str, within: str
) -> None:
    record.value("sine", sine, "")
    assert row(record, "sine")[1:5] == ("-1.0 to 1.0", f"{sine:.2f}", difference, within)


def test_only_values_of_both_sides_and_in_one_unit_are_compared(record: Record) -> None:
    with pytest.raises(RecordError, match=r"Value mass is not in this run \(known: none\)"):
        record.compare(["mass"])
    record.value("mass", 2000.0, "g")
    with pytest.raises(RecordError, match="Value mass is in 'g' here and in 'kg' in the thesis"):
        record.compare(["mass"])
    record.value("time", 1.0, "s")
    with pytest.raises(RecordError, match=r"Value time is not in data/thesis/01\.json \(known: mass, sine\)"):
        record.compare(["time"])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"value": None}, "has for mass the entries"),
        ({"page": None}, "has for mass the entries"),
        ({"low": 1.0}, "has for mass the entries"),
        ({"half_digit": 0.0}, "half_digit = 0.0, not above 0"),
    ],
)
def test_a_malformed_thesis_value_is_refused(project: Any, changes: dict[str, Any], said: str) -> None:
    path: Path = project.root / "data/thesis/01.json"
    printed = json.loads(path.read_text())
    mass = printed["values"]["mass"] | changes
    printed["values"]["mass"] = {name: value for name, value in mass.items() if value is not None}
    path.write_text(json.dumps(printed))
    with pytest.raises(RecordError) as info:
        pages.thesis_values(project.root, "01")
    assert said in str(info.value)


def test_missing_thesis_values_are_refused(project: Any) -> None:
    with pytest.raises(RecordError, match="no thesis values of chapter 02"):
        pages.thesis_values(project.root, "02")


def test_the_stamp_says_versions_time_and_solves() -> None:
    solve = {
        "name": "row C",
        "status": "Solve_Succeeded",
        "error_estimate": 9.1e-6,
        "tolerance": 1e-5,
        "points": 3400,
        "intervals": 800,
        "meshes": 7,
        "iterations": 300,
        "seconds": 60.0,
    }
    stamp = dict(pages.stamp([{**solve, "stored": False}], time.time() - 100.0).rows)
    assert {"Python", "thesislib", "numpy", "casadi", "time so far"} <= set(stamp)
    assert stamp["time so far"] in ("100.0 s", "100.1 s")
    assert float(stamp["peak memory so far"].removesuffix(" MB")) > 20
    assert "error estimate 9.1e-06 (tolerance 1e-05), 3400 points" in stamp["row C"]
    assert stamp["row C"].endswith("60.0 s")
    assert dict(pages.stamp([{**solve, "stored": True}], 0.0).rows)["row C"].endswith("stored")


def test_a_table_is_html_and_markdown_without_markup_from_its_cells() -> None:
    table = pages.Table(("a", "b"), (("<i>", "x | y"),))
    assert "<td>&lt;i&gt;</td><td>x | y</td>" in table._repr_html_()
    assert table._repr_markdown_().splitlines() == ["| a | b |", "| --- | --- |", r"| <i> | x \| y |"]
