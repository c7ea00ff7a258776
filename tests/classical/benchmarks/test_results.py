"""Kept measurements: what is read from them, and what is refused."""

import json
import re

import pytest

from thesislib.classical.benchmarks.results import HEADINGS, ResultsError, Row, read


def entry(package, problem="Bryson-Denham", objective=4.0, seconds=0.1, status="solved", **changes):
    numbers = {"points": 40, "intervals": 10, "meshes": 1, "error": 1e-7}
    row = {"package": package, "problem": problem, "status": status, "reason": "", "objective": objective}
    return {**row, **numbers, "cpu_seconds": seconds, "compiler_seconds": 0.0, **changes}


@pytest.fixture
def keep(tmp_path):
    def write(rows, schema=1, packages=("thesislib", "maptor", "yapss")):
        kinds = {"yapss": "fixed mesh"}
        about = {name: {"kind": kinds.get(name, "adaptive"), "versions": {}} for name in packages}
        path = tmp_path / "published.json"
        path.write_text(json.dumps({"schema": schema, "packages": about, "rows": rows}), encoding="utf-8")
        return path

    return write


def test_ratio_is_the_peers_time_over_ours(keep):
    results = read(keep([entry("thesislib", seconds=0.05), entry("maptor", seconds=0.8)]))
    row = results.row("maptor", "Bryson-Denham")
    assert row is not None and results.ratio(row) == pytest.approx(16)
    assert results.columns()["ours = 1"] == ["1.0", "16.0"]


def test_fastest_adaptive_peer_is_neither_wrong_nor_on_a_fixed_mesh_nor_ourselves(keep):
    rows = [
        entry("thesislib", seconds=0.01),
        entry("maptor", seconds=0.8),
        entry("yapss", seconds=0.02),
    ]
    fastest = read(keep(rows)).fastest_adaptive("Bryson-Denham")
    assert fastest is not None and fastest.package == "maptor"
    rows[1]["objective"] = 4.1
    assert read(keep(rows)).fastest_adaptive("Bryson-Denham") is None


def test_content_with_another_optimum_is_not_right(keep):
    results = read(keep([entry("thesislib", objective=3.9)]))
    assert results.rows[0].relative_error == pytest.approx(-0.025)
    assert not results.rows[0].is_right
    assert results.columns()["verdict"] == ["another optimum"]


def test_package_that_did_not_answer_keeps_its_row_with_the_reason(keep):
    silent = entry("maptor", objective=None, seconds=None, status="timeout", reason="no answer within 60 s")
    silent |= dict.fromkeys(("points", "intervals", "meshes", "error"))
    results = read(keep([entry("thesislib"), silent]))
    columns = results.columns()
    assert columns["verdict"] == ["solved", "timeout"] and columns["CPU s"][1] == ""
    assert results.ratio(results.rows[1]) is None
    assert tuple(columns) == HEADINGS


def test_rows_stand_in_the_order_of_the_problems(keep):
    rows = [entry("maptor", "Goddard", 18550.87), entry("maptor"), entry("thesislib")]
    assert [(row.problem, row.package) for row in read(keep(rows)).rows] == [
        ("Bryson-Denham", "thesislib"),
        ("Bryson-Denham", "maptor"),
        ("Goddard", "maptor"),
    ]


def test_missing_file_says_how_to_make_it(tmp_path):
    said = "published.json is not there; make bench KEEP=--keep measures it"
    with pytest.raises(ResultsError, match=re.escape(said)):
        read(tmp_path / "published.json")


@pytest.mark.parametrize(
    ("rows", "schema", "said"),
    [
        ([], 2, "published.json has schema 2, not 1"),
        (
            [entry("maptor", "brachistochron")],
            1,
            "names the problem 'brachistochron'; known: brachistochrone",
        ),
        ([entry("pycollo")], 1, "has a row of 'pycollo', of which it says nothing else"),
    ],
)
def test_other_schema_unknown_problem_and_unknown_package_are_refused(keep, rows, schema, said):
    with pytest.raises(ResultsError, match=re.escape(said)):
        read(keep(rows, schema))


def test_row_without_an_objective_has_no_error():
    row = Row("maptor", "Goddard", "failed", "", None, None, None, None, None, 1.0)
    assert row.relative_error is None and not row.is_right
