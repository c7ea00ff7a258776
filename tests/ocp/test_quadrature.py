import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre

from thesislib.ocp.quadrature import (
    FLIPPED_RADAU,
    GAUSS,
    LOBATTO,
    RADAU,
    differentiation_matrix,
    flipped_radau_points,
    gauss_points,
    interpolation_matrix,
    lobatto_points,
    radau_integration,
    radau_points,
    radau_weights,
)

RULES = [GAUSS, RADAU, FLIPPED_RADAU, LOBATTO]
ORDERS = [2, 3, 5, 10, 20, 40, 60, 100, 200]


def polynomial_of_points(rule, n):
    """The polynomial whose roots the points are, as combinations of Legendre polynomials."""
    last, before = Legendre.basis(n), Legendre.basis(n - 1)
    return {
        GAUSS: last,
        RADAU: last + before,
        FLIPPED_RADAU: last - before,
        # (1 - τ²) P'_{n-1} is a multiple of P_n - P_{n-2}
        LOBATTO: last - Legendre.basis(n - 2),
    }[rule]


def rule_id(rule):
    return rule.name


@pytest.mark.parametrize(
    ("rule", "points", "weights"),
    [
        (GAUSS, [-1 / np.sqrt(3), 1 / np.sqrt(3)], [1, 1]),
        (RADAU, [-1, 1 / 3], [0.5, 1.5]),
        (FLIPPED_RADAU, [-1 / 3, 1], [1.5, 0.5]),
        (LOBATTO, [-1, 1], [1, 1]),
    ],
)
def test_two_point_rules_are_those_of_textbooks(rule, points, weights):
    np.testing.assert_allclose(rule.points(2), points, rtol=0, atol=1e-15)
    np.testing.assert_allclose(rule.weights(2), weights, rtol=0, atol=1e-15)


@pytest.mark.parametrize("rule", RULES, ids=rule_id)
@pytest.mark.parametrize("n", ORDERS)
def test_points_are_roots_of_their_polynomial(rule, n):
    polynomial = polynomial_of_points(rule, n)
    # one Newton step from each point: how far the nearest root is
    steps = polynomial(rule.points(n)) / polynomial.deriv()(rule.points(n))
    assert np.abs(steps).max() < 1e-13
    assert np.all(np.diff(rule.points(n)) > 0)


@pytest.mark.parametrize("rule", RULES, ids=rule_id)
@pytest.mark.parametrize("n", ORDERS)
def test_rule_is_exact_to_its_degree_and_no_further(rule, n):
    # Legendre polynomials stay of order one, so that high degrees are a test and not rounding
    integrals = np.array(
        [rule.weights(n) @ Legendre.basis(d)(rule.points(n)) for d in range(rule.degree(n) + 2)]
    )
    assert integrals[0] == pytest.approx(2, abs=1e-13)
    np.testing.assert_allclose(integrals[1:-1], 0, atol=2e-13)
    assert abs(integrals[-1]) > 1e-3


def test_degrees_are_2n_less_one_two_and_three():
    assert [rule.degree(7) for rule in RULES] == [13, 12, 12, 11]


def test_weights_as_the_thesis_prints_them_for_gauss_points_do_not_sum_to_two():
    tau = gauss_points(5)
    slope = Legendre.basis(5).deriv()(tau)
    assert (2 / ((1 - tau) ** 2 * slope**2)).sum() > 4
    np.testing.assert_allclose(2 / ((1 - tau**2) * slope**2), GAUSS.weights(5), rtol=1e-13)


def test_weights_as_the_thesis_prints_them_for_lobatto_points_divide_by_zero():
    inside = lobatto_points(6)[1:-1]
    assert np.abs(Legendre.basis(5).deriv()(inside)).max() < 1e-13


@pytest.mark.parametrize("rule", [GAUSS, RADAU, FLIPPED_RADAU], ids=rule_id)
@pytest.mark.parametrize("n", [1, *ORDERS])
def test_integration_matrix_inverts_differentiation_and_carries_the_start_along(rule, n):
    integration, differentiation = rule.integration(n), rule.differentiation(n)
    np.testing.assert_allclose(integration @ differentiation[:, 1:], np.eye(n), atol=1e-13 * max(n, 10) ** 2)
    # I D_1 = -1: integrating the slope of a constant from the start gives that constant back
    np.testing.assert_allclose(integration @ differentiation[:, 0], -np.ones(n), atol=1e-12)
    if rule is not GAUSS:
        np.testing.assert_allclose(integration[-1], rule.weights(n), atol=1e-13)


@pytest.mark.parametrize("rule", RULES, ids=rule_id)
@pytest.mark.parametrize("n", [3, 10, 40, 200])
def test_matrices_are_exact_on_polynomials_to_rounding(rule, n):
    support, points = rule.support(n), rule.points(n)
    for degree in (0, 1, 2, n // 2, n - 1):
        polynomial = Legendre.basis(degree)
        slopes = rule.differentiation(n) @ polynomial(support)
        np.testing.assert_allclose(slopes, polynomial.deriv()(points), rtol=0, atol=1e-13 * n**2)
        gained = rule.integration(n) @ polynomial(points)
        whole = polynomial.integ()
        np.testing.assert_allclose(gained, whole(support[1:]) - whole(-1.0), rtol=0, atol=1e-13 * n**2)


@pytest.mark.parametrize("n", [1, 2, 5, 10, 20])
def test_interpolation_and_slopes_are_exact_for_polynomials_their_support_carries(n):
    support = RADAU.support(n)
    polynomial = Polynomial(np.random.default_rng(n).normal(size=n + 1))
    values = polynomial(support)
    places = np.linspace(-1, 1, 17)
    np.testing.assert_allclose(interpolation_matrix(support, places) @ values, polynomial(places), atol=1e-12)
    np.testing.assert_allclose(
        differentiation_matrix(support) @ values, polynomial.deriv()(support), atol=1e-10
    )


def test_short_names_of_the_radau_matrices_are_the_rules_own():
    np.testing.assert_array_equal(radau_integration(6)[-1], RADAU.integration(6)[-1])
    np.testing.assert_allclose(radau_integration(6)[-1], radau_weights(6), atol=1e-14)


def test_interpolation_on_a_support_point_returns_its_value_exactly():
    support = radau_points(7)
    np.testing.assert_array_equal(interpolation_matrix(support, support), np.eye(7))


def test_caller_cannot_change_what_the_next_caller_gets():
    for points in (radau_points(4), gauss_points(4), lobatto_points(4), flipped_radau_points(4)):
        with pytest.raises(ValueError, match="read-only"):
            points[0] = 0


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (radau_points, "at least one point, not 0"),
        (gauss_points, "at least one point, not 0"),
        (lobatto_points, "needs both ends, not 0 points"),
    ],
)
def test_rule_without_points_is_refused(points, reason):
    with pytest.raises(ValueError, match=reason):
        points(0)
