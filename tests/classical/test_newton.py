"""Claims about the damped Newton method."""

import numpy as np
import pytest
import scipy.sparse

from thesislib.classical.control_problem import ConvergenceError
from thesislib.classical.newton import newton


def circle_and_line(x):
    return np.array([x[0] ** 2 + x[1] ** 2 - 2, x[0] - x[1]])


def slopes(x):
    return np.array([[2 * x[0], 2 * x[1]], [1.0, -1.0]])


NAMES = ["circle", "line"]


@pytest.mark.parametrize("form", [np.asarray, scipy.sparse.csc_matrix])
def test_root_is_found_with_dense_and_with_sparse_jacobians(form):
    root = newton(circle_and_line, lambda x: form(slopes(x)), np.array([3.0, 0.5]), NAMES, what="test")
    np.testing.assert_allclose(root.x, [1.0, 1.0], rtol=1e-14)  # the last step was below 1e-10, and squared


def test_convergence_is_quadratic():
    root = newton(circle_and_line, slopes, np.array([3.0, 0.5]), NAMES, what="test")
    digits = -np.log10(root.corrections[-3:-1])
    assert digits[1] > 1.8 * digits[0]  # digits double from step to step


def test_equations_may_be_multiplied_by_any_numbers():
    scale = np.array([1e8, 1e-6])
    plain = newton(circle_and_line, slopes, np.array([3.0, 0.5]), NAMES, what="test")
    scaled = newton(
        lambda x: scale * circle_and_line(x),
        lambda x: scale[:, None] * slopes(x),
        np.array([3.0, 0.5]),
        NAMES,
        what="test",
    )
    assert scaled.iterations == plain.iterations
    np.testing.assert_allclose(scaled.corrections, plain.corrections, rtol=1e-6)  # of rounding in the last


def test_damping_converges_where_full_steps_diverge():
    # from 3, Newton's full steps on the arc tangent grow without bound
    root = newton(np.arctan, lambda x: np.diag(1 / (1 + x**2)), np.array([3.0]), ["arc tangent"], what="test")
    assert abs(root.x[0]) < 1e-10


def test_failure_names_the_largest_residual():
    with pytest.raises(ConvergenceError, match=r"^test: .*largest residual is parabola, "):
        newton(
            lambda x: np.array([x[0] ** 2 + 1, 1e-3 * (x[1] - 1)]),
            lambda x: np.diag([2 * x[0], 1e-3]),
            np.array([2.0, 0.0]),
            ["parabola", "line"],
            what="test",
        )


def test_guess_without_a_residual_is_refused():
    with pytest.raises(ConvergenceError, match="test: line is not finite at the guess"):
        newton(lambda x: np.array([1.0, np.inf]), slopes, np.ones(2), NAMES, what="test")


@pytest.mark.parametrize("form", [np.asarray, scipy.sparse.csc_matrix])
def test_singular_jacobian_is_an_error(form):
    with pytest.raises(ConvergenceError, match="Jacobian has no inverse; the largest residual is circle"):
        newton(circle_and_line, lambda x: form(np.zeros((2, 2))), np.ones(2) * 2, NAMES, what="test")
