"""The picture of the benchmark table."""

import pytest
from matplotlib.figure import Figure

from thesislib.classical.benchmarks.figures import STYLES, cpu_seconds
from thesislib.classical.benchmarks.results import Results, Row


def row(package, objective, seconds, status="solved"):
    return Row(package, "Bryson-Denham", status, "", objective, 40, 10, 1, 1e-7, seconds)


def packages(*names):
    return {name: {"kind": "adaptive"} for name in names}


def markers(figure):
    (axes,) = figure.axes
    return [line for line in axes.lines if line.get_marker() not in ("None", None)]


def test_right_answers_are_filled_and_others_empty():
    rows = (row("thesislib", 4.0, 0.05), row("maptor", 3.0, 0.8))
    drawn = markers(cpu_seconds(Figure(), Results(packages("thesislib", "maptor"), rows)))
    assert [line.get_xdata()[0] for line in drawn] == [0.05, 0.8]
    assert [line.get_markerfacecolor() == "none" for line in drawn] == [False, True]


def test_package_without_an_answer_has_no_marker_but_a_place_in_the_legend():
    rows = (row("thesislib", 4.0, 0.05), row("maptor", None, None, "timeout"))
    figure = cpu_seconds(Figure(), Results(packages("thesislib", "maptor"), rows))
    assert len(markers(figure)) == 1
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["thesislib", "maptor", "not right"]


def test_markers_of_one_problem_do_not_cover_each_other():
    rows = (row("thesislib", 4.0, 0.05), row("maptor", 4.0, 0.05))
    heights = [
        line.get_ydata()[0]
        for line in markers(cpu_seconds(Figure(), Results(packages("thesislib", "maptor"), rows)))
    ]
    assert abs(heights[0] - heights[1]) > 0.1


def test_more_packages_than_styles_are_refused():
    names = [f"package {k}" for k in range(len(STYLES) + 1)]
    with pytest.raises(ValueError, match=f"{len(names)} packages, but only {len(STYLES)} styles"):
        cpu_seconds(Figure(), Results(packages(*names), ()))
