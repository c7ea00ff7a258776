"""A programme's derivatives are those of its functions, and its residuals those of (2.22)."""

import numpy as np
import pytest

from thesislib.classical.programme import NotConvergedError, Programme

POINT = np.array([0.7, 0.4])


def differences(function, x, step=1e-6):
    """Central differences of a vector function, one row per component of the function."""
    columns = [
        (np.atleast_1d(function(x + step * unit)) - np.atleast_1d(function(x - step * unit))) / (2 * step)
        for unit in np.eye(x.size)
    ]
    return np.array(columns).T


def test_first_derivatives_are_the_limits_of_differences(hs14):
    df, g, dg, h, dh = hs14.first_order(POINT)
    # 1e-9: rounding 1e-16 over the step 1e-6, ten times
    np.testing.assert_allclose(df, differences(hs14.value, POINT)[0], atol=1e-9)
    np.testing.assert_allclose(dg.T, differences(lambda x: hs14.constraints(x)[0], POINT), atol=1e-9)
    np.testing.assert_allclose(dh.T, differences(lambda x: hs14.constraints(x)[1], POINT), atol=1e-9)
    assert g == pytest.approx([0.7 - 0.8 + 1.0])
    assert h == pytest.approx([0.49 / 4 + 0.16 - 1.0])


def test_hessian_is_that_of_the_lagrangian(hs14):
    # by hand: f gives 2 I, h gives diag(1/2, 2), the linear g nothing
    np.testing.assert_allclose(hs14.hessian(POINT, [5.0], [3.0]), np.diag([2 + 1.5, 2 + 6.0]), atol=1e-15)


def test_residuals_vanish_at_the_analytic_solution(hs14):
    root = np.sqrt(7.0)
    x = np.array([(root - 1) / 2, (root + 1) / 4])
    # stationarity by hand: 2 (x1 - 2) + lam + mu x1 / 2 = 0, 2 (x2 - 1) - 2 lam + 2 mu x2 = 0
    lam, mu = np.linalg.solve([[1, x[0] / 2], [-2, 2 * x[1]]], [2 * (2 - x[0]), 2 * (1 - x[1])])
    assert mu > 0
    assert hs14.kkt_residual(x, np.array([lam]), np.array([mu])) < 1e-14


def test_each_condition_sees_its_own_violation(hs14):
    x = np.array([2.0, 2.0])
    residuals = hs14.kkt_residuals(x, np.array([1.0]), np.array([-0.5]))
    assert residuals["equalities"] == pytest.approx([1.0])
    assert residuals["inequalities"] == pytest.approx([4.0])
    assert residuals["signs"] == pytest.approx([0.5])
    assert residuals["complementarity"] == pytest.approx([2.0])
    assert residuals["stationarity"] == pytest.approx([abs(0 + 1 - 0.5), abs(2 - 2 - 2.0)])


def test_error_names_the_most_violated_condition(hs14):
    error = hs14.not_converged(np.array([2.0, 2.0]), np.zeros(1), np.zeros(1), 1e-8, "stopped")
    assert isinstance(error, NotConvergedError)
    assert "HS14: stopped" in str(error)
    assert "inequality (2.22c) 1, by 4 where 1e-08 is allowed" in str(error)


def test_undefined_residual_counts_as_the_worst():
    programme = Programme(lambda x: x[0], 1, inequalities=lambda x: [x[0] - 1], name="line")
    error = programme.not_converged(np.array([np.nan]), np.zeros(0), np.ones(1), 1e-8, "stopped")
    assert "by nan" in str(error)


@pytest.mark.parametrize("start", ([1.0], [1.0, np.nan], [1.0, 2.0, 3.0]))
def test_malformed_start_is_refused(hs14, start):
    with pytest.raises(ValueError, match=r"HS14: the start .* has to have 2 finite components"):
        hs14.start(start)


def test_start_where_a_function_is_undefined_is_refused():
    programme = Programme(lambda x: 1 / x[0], 1, name="pole")
    with pytest.raises(ValueError, match=r"pole: f is \[inf\] at the start"):
        programme.start([0.0])


def test_programme_without_variables_is_refused():
    with pytest.raises(ValueError, match="size = 0"):
        Programme(lambda x: 0, 0)
