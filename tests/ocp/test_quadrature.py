import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre

from thesislib.ocp.quadrature import (
    differentiation_matrix,
    interpolation_matrix,
    radau_differentiation,
    radau_integration,
    radau_points,
    radau_weights,
)

ORDERS = [1, 2, 3, 5, 10, 20, 40, 60]


def test_two_point_rule_is_the_one_of_textbooks():
    np.testing.assert_allclose(radau_points(2), [-1, 1 / 3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(radau_weights(2), [0.5, 1.5], rtol=0, atol=1e-15)


@pytest.mark.parametrize("n", ORDERS)
def test_points_are_roots_of_the_sum_of_two_legendre_polynomials(n):
    polynomial = Legendre.basis(n) + Legendre.basis(n - 1)
    # one Newton step from each point: how far the nearest root is
    steps = polynomial(radau_points(n)) / polynomial.deriv()(radau_points(n))
    assert np.abs(steps).max() < 1e-13
    assert np.all(np.diff(radau_points(n)) > 0)


@pytest.mark.parametrize("n", ORDERS)
def test_rule_is_exact_to_degree_2n_minus_2_and_no_further(n):
    degrees = np.arange(2 * n)
    # Legendre polynomials stay of order one, so that high degrees are a test and not rounding
    integrals = np.array([radau_weights(n) @ Legendre.basis(d)(radau_points(n)) for d in degrees])
    assert integrals[0] == pytest.approx(2, abs=1e-13)
    np.testing.assert_allclose(integrals[1:-1], 0, atol=2e-13)
    assert abs(integrals[-1]) > 1e-3


@pytest.mark.parametrize("n", ORDERS)
def test_integration_matrix_inverts_differentiation_and_carries_the_start_along(n):
    integration, differentiation = radau_integration(n), radau_differentiation(n)
    np.testing.assert_allclose(integration @ differentiation[:, 1:], np.eye(n), atol=1e-10)
    # I D_1 = -1: integrating the slope of a constant from the start gives that constant back
    np.testing.assert_allclose(integration @ differentiation[:, 0], -np.ones(n), atol=1e-11)
    np.testing.assert_allclose(integration[-1], radau_weights(n), atol=1e-13)


@pytest.mark.parametrize("n", [1, 2, 5, 10, 20])
def test_matrices_are_exact_for_polynomials_their_support_carries(n):
    support = np.append(radau_points(n), 1.0)
    polynomial = Polynomial(np.random.default_rng(n).normal(size=n + 1))
    values = polynomial(support)
    places = np.linspace(-1, 1, 17)
    np.testing.assert_allclose(interpolation_matrix(support, places) @ values, polynomial(places), atol=1e-12)
    np.testing.assert_allclose(
        differentiation_matrix(support) @ values, polynomial.deriv()(support), atol=1e-10
    )


def test_interpolation_on_a_support_point_returns_its_value_exactly():
    support = radau_points(7)
    np.testing.assert_array_equal(interpolation_matrix(support, support), np.eye(7))


def test_caller_cannot_change_what_the_next_caller_gets():
    with pytest.raises(ValueError, match="read-only"):
        radau_points(4)[0] = 0


def test_rule_without_points_is_refused():
    with pytest.raises(ValueError, match="at least one point, not 0"):
        radau_points(0)
