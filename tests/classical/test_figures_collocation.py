"""The plots of sections 2.6.4 to 2.8 show the numbers they are given."""

import numpy as np
from matplotlib.figure import Figure

from thesislib.classical import figures_collocation


def test_points_stand_on_a_line_for_each_rule_as_large_as_their_weights():
    rules = {"one": (np.array([-1.0, 0.5]), np.array([0.5, 1.5])), "two": (np.zeros(1), np.full(1, 2.0))}
    (axes,) = figures_collocation.points_of_rules(Figure(), rules).axes
    first, second = axes.collections
    np.testing.assert_allclose(first.get_offsets(), [[-1.0, 1.0], [0.5, 1.0]])
    np.testing.assert_allclose(second.get_offsets(), [[0.0, 0.0]])
    np.testing.assert_allclose(first.get_sizes() / first.get_sizes()[0], [1.0, 3.0])
    assert [label.get_text() for label in axes.get_yticklabels()] == ["one", "two"]


def test_errors_and_estimates_are_drawn_beside_the_diagonal():
    errors = {"p": (np.array([4, 8]), np.array([1e-2, 1e-4]))}
    estimates = {"slide": (np.array([1e-3, 1e-5]), np.array([1e-2, 1e-6]))}
    left, right = figures_collocation.refinement(Figure(), errors, estimates).axes
    np.testing.assert_allclose(left.get_lines()[0].get_xydata(), [[4, 1e-2], [8, 1e-4]])
    points, diagonal = right.get_lines()
    np.testing.assert_allclose(points.get_xydata(), [[1e-3, 1e-2], [1e-5, 1e-6]])
    np.testing.assert_allclose(diagonal.get_xydata(), [[1e-6, 1e-6], [1e-2, 1e-2]])
    assert left.get_xscale() == left.get_yscale() == right.get_yscale() == "log"


def test_functions_are_drawn_left_and_their_slopes_right():
    x = np.linspace(-1, 1, 5)
    functions = {"sharp": (np.maximum(x, 0), x > 0), "round": (x**2, 2 * x)}
    left, right = figures_collocation.smoothed(Figure(), x, functions).axes
    np.testing.assert_allclose(left.get_lines()[1].get_ydata(), x**2)
    np.testing.assert_allclose(right.get_lines()[1].get_ydata(), 2 * x)
    assert [text.get_text() for text in right.get_legend().get_texts()] == ["sharp", "round"]


def test_each_way_has_a_panel_with_all_its_phases_over_the_exact_control():
    t = np.array([0.0, 1.0])
    runs = {"raw": [(t, t)], "phases": [(t, 2 * t), (t + 1, 3 * t)]}
    figure = figures_collocation.histories(Figure(), runs, (t, 5 * t))
    raw, phases = figure.axes
    assert [raw.get_title(), phases.get_title()] == ["raw", "phases"]
    assert len(raw.get_lines()) == 2 and len(phases.get_lines()) == 3
    for axes in (raw, phases):
        np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), 5 * t)
    np.testing.assert_allclose(phases.get_lines()[2].get_xydata(), [[1.0, 0.0], [2.0, 3.0]])
