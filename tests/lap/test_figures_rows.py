"""The pictures of Table 4.2 show the numbers they are given, each at its own row."""

from __future__ import annotations

import re

import numpy as np
import pytest

from thesislib.lap import figures_rows

ROWS = {"C": "baseline", "D": "ride height", "Q": "balance along the lap"}
THESIS = {"C": 0.0, "D": -0.46, "Q": -2.01}
OURS = {"C": 0.0, "D": -0.47, "Q": -1.98}

TIMES = {
    "D": {"row C": 84.14, "row E": 84.14005, "finer mesh": 84.15},
    "Q": {"row C": 82.70, "row E": np.nan},
}


def test_each_rows_two_lap_times_stand_at_its_place(marks):
    axes = figures_rows.lap_times_beside_thesis(ROWS, THESIS, OURS).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == [f"{w}  {r}" for r, w in ROWS.items()]
    assert marks(axes, label="thesis") == [(0.0, 0), (-0.46, 1), (-2.01, 2)]
    assert marks(axes, label="this run") == [(0.0, 0), (-0.47, 1), (-1.98, 2)]
    # the first row is on top
    assert axes.yaxis_inverted()


def test_our_numbers_are_written_out_except_the_baselines():
    axes = figures_rows.lap_times_beside_thesis(ROWS, THESIS, OURS).axes[0]
    assert [text.get_text() for text in axes.texts] == ["−0.47", "−1.98"]


def test_the_right_panel_shows_the_distance_from_the_thesis_on_its_aim(marks):
    axes = figures_rows.lap_times_beside_thesis(ROWS, THESIS, OURS, aims_s={"D": 0.03, "Q": 0.02}).axes[1]
    off = [x for x, _ in marks(axes, marker="o")]
    np.testing.assert_allclose(off, [0.0, -0.01, 0.03], atol=1e-12)
    bands = [(bar.get_x(), bar.get_width(), bar.get_y() + 0.5 * bar.get_height()) for bar in axes.patches]
    np.testing.assert_allclose(bands, [(-0.03, 0.06, 1.0), (-0.02, 0.04, 2.0)], atol=1e-12)
    low, high = axes.get_xlim()
    assert low < -0.03 and high > 0.03


def test_a_table_that_agrees_to_the_digit_can_be_drawn():
    figure = figures_rows.lap_times_beside_thesis(ROWS, OURS, OURS)
    assert figure._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("thesis", "ours", "owner"),
    [
        ({"C": 0.0, "D": -0.46}, OURS, "the thesis"),
        (THESIS, OURS | {"Q": float("nan")}, "this run"),
    ],
)
def test_a_row_without_its_difference_is_refused(thesis, ours, owner):
    with pytest.raises(ValueError, match=f"row Q needs a lap-time difference of {owner}"):
        figures_rows.lap_times_beside_thesis(ROWS, thesis, ours)


def test_pictures_of_nothing_are_refused():
    with pytest.raises(ValueError, match="there is no row to draw"):
        figures_rows.lap_times_beside_thesis({}, {}, {})
    with pytest.raises(ValueError, match="there is no row to draw"):
        figures_rows.spread_of_starts({})


def test_starts_are_shown_by_their_excess_over_the_best_of_their_row(marks):
    axes = figures_rows.spread_of_starts(TIMES).axes[0]
    assert re.search(r"\(ms\)$", axes.get_xlabel())
    found = {}
    for name in ("row C", "row E", "finer mesh"):
        found[name] = {round(row): excess for excess, row in marks(axes, label=name)}
    # lap times of 84 s carry rounding errors of 1e-14 s, which 1e3 makes 1e-11 ms
    assert found["row C"] == {0: 0.0, 1: 0.0}
    assert found["row E"][0] == pytest.approx(0.05, abs=1e-10)
    assert found["finer mesh"] == {0: pytest.approx(10.0, abs=1e-10)}


def test_a_start_without_a_lap_is_a_cross_in_its_row(marks):
    axes = figures_rows.spread_of_starts(TIMES).axes[0]
    (cross,) = marks(axes, marker="x")
    assert round(cross[1]) == 1
    (line,) = [line for line in axes.get_lines() if line.get_marker() == "x" and len(line.get_xdata())]
    named = next(line for line in axes.get_lines() if line.get_label() == "row E")
    assert line.get_color() == named.get_color()


def test_a_row_without_any_lap_is_refused():
    with pytest.raises(ValueError, match="row D has no lap from any start"):
        figures_rows.spread_of_starts({"D": {"row C": float("nan")}})


def test_more_starts_than_markers_are_refused():
    with pytest.raises(ValueError, match="7 starts are more than the 6 that stay apart"):
        figures_rows.spread_of_starts({"D": {f"start {number}": 84.0 for number in range(7)}})
