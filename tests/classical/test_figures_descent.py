"""The plots of section 2.1 show the numbers they are given."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from thesislib.classical import descent, figures_descent
from thesislib.classical.programme import Programme


@pytest.fixture
def figure():
    return Figure(figsize=(6.4, 4.0), layout="constrained")


def test_starts_have_the_colour_of_the_point_they_lead_to(figure):
    # x^4 / 4 - x^2 / 2 + x / 10: minima near -1.05 and 0.95, a maximum near 0.1
    places = [
        figures_descent.Stationary(x, x**4 / 4 - x**2 / 2 + x / 10, 3 * x**2 - 1)
        for x in (-1.0467, 0.1010, 0.9456)
    ]
    x = np.linspace(-1.5, 1.5, 31)
    starts = np.array([-1.0, 0.1, 1.0, 2.0])
    figures_descent.valley(
        figure, x, x**4 / 4, places, starts, {"a": np.array([0, 1, 2, -1]), "b": np.array([2, 2, 2, 2])}
    )
    top, bottom = figure.axes
    assert [text.get_text() for text in top.texts] == ["global minimum", "local maximum", "local minimum"]
    marks = [to_hex(line.get_color()) for line in top.get_lines()[1:]]
    rows = [[to_hex(colour) for colour in row.get_colors()] for row in bottom.collections]
    assert rows[0][:3] == marks
    assert rows[0][3] not in marks
    assert set(rows[1]) == {marks[2]}
    assert [label.get_text() for label in bottom.get_yticklabels()] == ["a", "b"]


def test_paths_begin_and_end_where_the_descents_do(figure, valley):
    ways = {"BFGS": descent.bfgs(valley, [-1.0, 1.5]), "Newton": descent.guarded_newton(valley, [-1.0, 1.5])}
    figures_descent.paths(figure, valley, ways, ((-2.0, 2.0), (-1.0, 2.0)))
    for axes, (name, way) in zip(figure.axes, ways.items(), strict=True):
        np.testing.assert_allclose(np.transpose(axes.get_lines()[0].get_data()), way.points)
        assert axes.get_title() == f"{name}\n{way.iterations} steps"


def test_errors_below_rounding_are_left_out(figure):
    errors = {"Newton": np.array([1.0, 0.1, 1e-2, 1e-4, 1e-8, 1e-16, 0.0])}
    figures_descent.convergence(figure, errors)
    left, right = figure.axes
    np.testing.assert_allclose(left.get_lines()[0].get_ydata(), [1.0, 0.1, 1e-2, 1e-4, 1e-8])
    np.testing.assert_allclose(right.get_lines()[0].get_data(), ([0.1, 1e-2, 1e-4], [1e-2, 1e-4, 1e-8]))
    first, second = right.get_lines()[1:]
    np.testing.assert_allclose(first.get_ydata(), first.get_xdata())
    np.testing.assert_allclose(second.get_ydata(), second.get_xdata() ** 2)
    assert all(axes.get_xlabel() and axes.get_ylabel() for axes in figure.axes)


def test_single_variable_is_enough_for_destinations():
    hill = Programme(lambda x: x[0] ** 4 / 4 - x[0] ** 2 / 2, 1)
    found = descent.destinations(descent.newton, hill, [[-2.0], [0.1], [0.9]], [[-1.0], [0.0], [1.0]])
    assert list(found) == [0, 1, 2]
