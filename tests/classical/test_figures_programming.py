"""The plots of section 2.2 show the numbers they are given."""

import numpy as np
from matplotlib.figure import Figure

from thesislib.classical import figures_programming
from thesislib.classical.ipopt import ipopt
from thesislib.classical.sqp import sqp


def test_iterates_and_violations_are_those_of_the_methods(hs14):
    figure = Figure(layout="constrained")
    optima = {"SQP": sqp(hs14, [2.0, 2.0]), "IPOPT": ipopt(hs14, [2.0, 2.0])}
    figures_programming.side_by_side(figure, hs14, optima, ((-0.2, 2.3), (0.2, 2.2)))
    plane, decay = figure.axes
    for way, path, fall in zip(optima.values(), plane.get_lines(), decay.get_lines(), strict=False):
        np.testing.assert_allclose(np.transpose(path.get_data()), way.points)
        np.testing.assert_allclose(fall.get_ydata(), way.residuals)
    assert decay.get_yscale() == "log"
    assert [text.get_text() for text in decay.get_legend().get_texts()] == ["SQP", "IPOPT"]


def test_equality_is_drawn_where_it_holds_and_the_inside_is_shaded(hs14):
    figure = Figure(layout="constrained")
    figures_programming.side_by_side(figure, hs14, {"SQP": sqp(hs14, [2.0, 2.0])}, ((-0.2, 2.3), (0.2, 2.2)))
    _, shade, line = figure.axes[0].collections
    vertices = line.get_paths()[0].vertices
    np.testing.assert_allclose(vertices[:, 0] - 2 * vertices[:, 1] + 1, 0.0, atol=1e-12)
    edge = shade.get_paths()[0].vertices
    # linear interpolation on a grid of 0.04 leaves the ellipse by less than a tenth of that
    assert (edge[:, 0] ** 2 / 4 + edge[:, 1] ** 2 - 1).max() < 4e-3


def test_hyperbolas_have_the_product_that_they_are_drawn_for():
    figure = Figure(layout="constrained")
    gammas = np.array([1.0, 0.1, 0.01])
    conditions = {"with": np.ones(3), "without": 1 / gammas}
    iterates = np.array([0.5, 0.2]), np.array([1.0, 2.0])
    figures_programming.central_path(figure, gammas, gammas, np.ones(3), conditions, iterates)
    left, right = figure.axes
    hyperbolas = left.get_lines()[1:4]
    for line, gamma in zip(hyperbolas, gammas, strict=True):
        np.testing.assert_allclose(line.get_xdata() * line.get_ydata(), gamma)
    np.testing.assert_allclose(left.get_lines()[4].get_data(), (gammas, np.ones(3)))
    np.testing.assert_allclose(left.get_lines()[5].get_data(), iterates)
    assert [line.get_label() for line in right.get_lines()] == ["with", "without"]
    assert right.get_xlim()[0] > right.get_xlim()[1]
