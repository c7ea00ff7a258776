"""Claims about the figures of sections 2.3 to 2.6: that they show what they are given, with units."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from thesislib.classical import figures_control as figures
from thesislib.classical import hypersensitive as rest
from thesislib.classical.comparison import Measurement
from thesislib.classical.control_problem import NecessaryConditions
from thesislib.classical.indirect_collocation import wall
from thesislib.classical.indirect_shooting import propagate
from thesislib.classical.minimum_principle import FastestStop


@pytest.fixture
def figure():
    return Figure(figsize=(6.4, 3.4), layout="constrained")


def texts(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_growth_of_the_functional_is_drawn_as_given(figure):
    epsilon = np.logspace(-3, -1, 5)
    growth = {"best": epsilon**2, "other": -epsilon}
    curves = {"best": (epsilon, epsilon), "other": (epsilon, 2 * epsilon)}
    left, right = figures.growth_of_functional(figure, epsilon, growth, curves).axes
    assert texts(right) == ["best", "other"]
    np.testing.assert_allclose(right.get_lines()[1].get_ydata(), epsilon)
    assert left.yaxis_inverted()
    assert all("(" in axes.get_xlabel() for axes in (left, right))


def test_stop_is_drawn_in_two_colours_that_meet_at_the_switch(figure):
    stop = FastestStop.by_hand(1.0, 0.0, 1.0)
    t = np.linspace(0.0, 2.0, 41)
    p, u = stop.integrated(t)
    left, right = figures.bang_bang(figure, stop, t, p, u, -np.ones(41)).axes
    _, braking, driving, _ = left.get_lines()
    held = [np.isfinite(line.get_ydata()) for line in (braking, driving)]
    np.testing.assert_array_equal(held[0], ~held[1])
    assert texts(right)[0] == "control u (m/s²)"


def test_errors_that_grow_are_drawn_beside_the_area_that_does_not(figure):
    conditions = NecessaryConditions(rest.hypersensitive(4.0, 1.0))
    t = np.linspace(0.0, 4.0, 21)
    start = np.array([1.0, np.sqrt(2) - 1])
    astray = {e: propagate(conditions, start + np.array([0, e]), t) for e in (1e-1, 1e-2)}
    left, right = figures.growth_of_errors(
        figure, t, rest.state(t, 1.0), astray, propagate(conditions, start, t)
    ).axes
    assert texts(left) == ["1e-01", "1e-02", "0"]
    np.testing.assert_allclose(right.get_lines()[2].get_ydata(), 1.0, rtol=1e-6)


def test_figure_2_2_has_the_penalty_for_each_depth(figure):
    s = np.linspace(-0.3, 0.1, 9)
    (axes,) = figures.penalties(figure, s, (0.1, 0.2), 10).axes
    assert texts(axes) == ["h = 0.1", "h = 0.2"]
    np.testing.assert_allclose(axes.get_lines()[1].get_ydata(), wall(s, 0.2, 10))


def test_error_under_the_ceiling_is_the_largest_difference(figure):
    t = np.linspace(0.0, 1.0, 11)
    heights = {h: (t, t * (1 - t) + h) for h in (0.1, 0.01)}
    _, right = figures.under_the_ceiling(figure, t, t * (1 - t), heights, 0.2).axes
    np.testing.assert_allclose(right.get_lines()[0].get_ydata(), [0.1, 0.01])


def test_convergence_has_a_line_for_each_name(figure):
    steps = np.array([10, 20])
    (axes,) = figures.convergence(
        figure, steps, {"a": 1 / steps, "b": 2 / steps}, abscissa="steps", ordinate="error"
    ).axes
    assert texts(axes) == ["a", "b"]
    np.testing.assert_allclose(axes.get_lines()[1].get_ydata(), [0.2, 0.1])


def test_basin_stands_beside_the_exponential(figure):
    (axes,) = figures.basin(figure, np.array([1.0, 2.0]), np.array([0.5, 0.2])).axes
    np.testing.assert_allclose(axes.get_lines()[1].get_ydata(), np.exp([-1.0, -2.0]))


def test_methods_are_drawn_once_each_with_one_legend(figure):
    def of(method, n):
        return Measurement(method, n, 3, 1.0 / n, 1.0, 1.0, 0.01 * n)

    drawn = figures.error_against_time(figure, [of("a", 10), of("a", 20), of("b", 10)])
    left, right = drawn.axes
    assert [text.get_text() for text in drawn.legends[0].get_texts()] == ["a", "b"]
    np.testing.assert_allclose(left.get_lines()[0].get_xdata(), [10, 20])
    np.testing.assert_allclose(right.get_lines()[0].get_xdata(), [0.1, 0.2])
