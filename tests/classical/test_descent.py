"""Convergence as theory has it, against analytic rates and scipy."""

import numpy as np
import pytest
from scipy.optimize import minimize

from thesislib.classical import descent
from thesislib.classical.programme import NotConvergedError, Programme

METHODS = (descent.steepest_descent, descent.newton, descent.guarded_newton, descent.bfgs)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_reaches_the_minimum(valley, method):
    way = method(valley, [-1.2, 1.0], tolerance=1e-7)
    # the gradient's tolerance over the smaller eigenvalue of the Hessian, 0.39
    np.testing.assert_allclose(way.x, [1.0, 1.0], atol=3e-7)
    assert np.abs(way.gradients[-1]).max() <= 1e-7
    assert len(way.points) == way.iterations + 1


def test_bfgs_agrees_with_scipy(valley):
    start = np.array([0.3, -0.8])
    peer = minimize(valley.value, start, jac=valley.gradient, method="BFGS", options={"gtol": 1e-10})
    np.testing.assert_allclose(descent.bfgs(valley, start, tolerance=1e-10).x, peer.x, atol=1e-8)


@pytest.mark.parametrize("condition", (3.0, 30.0))
def test_steepest_descent_on_a_quadratic_has_the_rate_of_its_condition(condition):
    quadratic = Programme(lambda x: (x[0] ** 2 + condition * x[1] ** 2) / 2, 2)
    way = descent.steepest_descent(quadratic, [condition, 1.0], step=descent.exact_for_quadratics)
    errors = way.errors([0.0, 0.0])
    # from this start, every step has the worst rate of all, exactly
    np.testing.assert_allclose(errors[1:] / errors[:-1], (condition - 1) / (condition + 1), rtol=1e-9)


@pytest.mark.parametrize("angle", (0.3, 1.2, 2.5, 4.0))
def test_newton_converges_quadratically(valley, angle):
    direction = np.array([np.cos(angle), np.sin(angle)])
    errors = np.array(
        [
            descent.newton(valley, 1.0 + distance * direction, tolerance=1e-12).errors([1.0, 1.0])[:2]
            for distance in np.logspace(-2, -4, 5)
        ]
    )
    # 0.15: the share of the third-order term at the largest distance, where f's scale is 1
    assert descent.convergence_order(errors.T) == pytest.approx(2.0, abs=0.15)


def test_newton_needs_one_step_on_a_quadratic():
    quadratic = Programme(lambda x: x[0] ** 2 + 3 * x[0] * x[1] + 7 * x[1] ** 2 - x[0], 2)
    way = descent.newton(quadratic, [5.0, -3.0], tolerance=1e-12)
    assert way.iterations == 1
    np.testing.assert_allclose(way.x, np.linalg.solve([[2, 3], [3, 14]], [1, 0]), atol=1e-14)


def test_newton_ends_in_a_maximum_where_the_guarded_one_does_not():
    hill = Programme(lambda x: x[0] ** 4 / 4 - x[0] ** 2 / 2, 1)
    assert descent.newton(hill, [0.1]).x == pytest.approx([0.0], abs=1e-8)
    assert descent.guarded_newton(hill, [0.1]).x == pytest.approx([1.0], abs=1e-8)


def test_bfgs_update_satisfies_the_secant_condition_and_stays_positive_definite():
    rng = np.random.default_rng(1)
    B = np.eye(4)
    for _ in range(20):
        p, y = rng.normal(size=(2, 4))
        y *= np.sign(p @ y)  # what Wolfe's second condition provides
        B = descent.bfgs_update(B, p, y)
        np.testing.assert_allclose(B @ p, y, rtol=1e-6, atol=1e-8 * np.abs(B).max())
        assert np.linalg.eigvalsh(B).min() > 0


def test_bfgs_update_loses_definiteness_without_wolfe():
    B = descent.bfgs_update(np.eye(2), np.array([1.0, 0.0]), np.array([-1.0, 0.5]))
    assert np.linalg.eigvalsh(B).min() < 0


def test_bfgs_is_faster_than_linear(valley):
    errors = descent.bfgs(valley, [-1.2, 1.0], tolerance=1e-9).errors([1.0, 1.0])
    ratios = errors[1:] / errors[:-1]
    assert ratios[-1] < ratios[-2] < ratios[-3] < 0.5


def test_order_of_a_known_sequence():
    assert descent.convergence_order([0.5 ** (3**k) for k in range(4)]) == pytest.approx(3.0, rel=1e-12)


def test_order_of_too_few_or_vanished_errors_is_refused():
    with pytest.raises(ValueError, match="1 pairs"):
        descent.convergence_order([0.1, 0.01])
    with pytest.raises(ValueError, match="is not positive"):
        descent.convergence_order([0.1, 0.01, 0.0])


def test_steepest_descent_that_needs_more_steps_says_so(valley):
    with pytest.raises(NotConvergedError, match=r"stopped after 50 iterations .* stationarity \(2\.22a\)"):
        descent.steepest_descent(valley, [-1.2, 1.0], most=50)


def test_newton_on_a_straight_line_says_that_it_cannot():
    line = Programme(lambda x: 3 * x[0], 1, name="line")
    with pytest.raises(NotConvergedError, match=r"line: Singular matrix .* by 3 where 1e-08 is allowed"):
        descent.newton(line, [0.0])


def test_constraints_are_refused(hs14):
    with pytest.raises(ValueError, match="HS14 has constraints"):
        descent.bfgs(hs14, [0.0, 0.0])
