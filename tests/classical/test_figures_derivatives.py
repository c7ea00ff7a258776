"""The plot of section 2.2.3 shows the errors it is given."""

import numpy as np
from matplotlib.figure import Figure

from thesislib.classical.figures_derivatives import error_against_step


def test_errors_are_drawn_and_a_vanished_one_stays_visible():
    figure = Figure(layout="constrained")
    steps = np.array([1e-8, 1e-4, 1e-1])
    errors = {"difference": np.array([1e-8, 1e-4, 1e-1]), "complex": np.array([0.0, 1e-8, 1e-2])}
    (axes,) = error_against_step(figure, steps, errors, 2e-16).axes
    difference, complex_step, automatic = axes.get_lines()[:3]
    np.testing.assert_allclose(difference.get_ydata(), errors["difference"])
    drawn = complex_step.get_ydata()
    np.testing.assert_allclose(drawn[1:], errors["complex"][1:])
    assert 0.0 < drawn[0] < np.finfo(float).eps
    assert set(automatic.get_ydata()) == {2e-16}
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "difference",
        "complex",
        "automatic",
    ]
    assert axes.get_xscale() == axes.get_yscale() == "log"
