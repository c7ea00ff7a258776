"""Claims about the monomial order and the least-squares fit of appendix A."""

from itertools import pairwise

import casadi
import numpy as np
import pytest

from thesislib.polynomials import (
    basis_size,
    design_matrix,
    exponents,
    fit,
    monomials,
    polynomial,
    substituted,
)

# coefficient row of the example 2 + 3 x1 - 4 x2 + x1 x2 - 8 x1 x3 - 7 x2^2 + 3 x3^2 of the appendix
EXAMPLE = [2.0, 3.0, -4.0, 0.0, 0.0, 1.0, -8.0, -7.0, 0.0, 3.0]


def example(x1, x2, x3):
    return 2 + 3 * x1 - 4 * x2 + x1 * x2 - 8 * x1 * x3 - 7 * x2**2 + 3 * x3**2


def test_coefficient_row_of_the_example_gives_the_example_polynomial():
    x = np.random.default_rng(1).normal(size=(3, 20))
    np.testing.assert_allclose(polynomial(EXAMPLE, list(x), 2), example(*x), rtol=1e-13, atol=1e-13)


def test_order_of_three_variables_is_the_printed_one():
    assert exponents(3, 2) == (
        (0, 0, 0),
        *((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        *((2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2)),
    )


def test_the_two_comparisons_of_the_example_hold():
    order = exponents(3, 2)
    assert order.index((2, 0, 0)) > order.index((0, 0, 1))
    assert order.index((0, 1, 1)) > order.index((2, 0, 0))


@pytest.mark.parametrize(("variables", "degree"), [(1, 5), (2, 4), (4, 3), (5, 2)])
def test_every_neighbour_obeys_the_definition_of_the_order(variables, degree):
    order = exponents(variables, degree)
    assert len(order) == len(set(order)) == basis_size(variables, degree)
    for lower, higher in pairwise(order):
        difference = [a - b for a, b in zip(higher, lower, strict=True)]
        leftmost = next(entry for entry in difference if entry != 0)
        assert sum(higher) > sum(lower) or (sum(higher) == sum(lower) and leftmost < 0)


def test_fit_recovers_a_polynomial_through_exact_data():
    x = np.random.default_rng(2).uniform(-8.0, 0.0, size=(40, 3))
    result = fit(x, example(*x.T), 2)
    np.testing.assert_allclose(result.coefficients, EXAMPLE, atol=1e-11)
    np.testing.assert_allclose(result.errors, 0.0, atol=1e-11)


def test_squared_error_of_a_fit_is_that_of_equation_a_6():
    random = np.random.default_rng(3)
    x = random.uniform(-1.0, 1.0, size=(30, 2))
    f = random.normal(size=30)
    phi = np.column_stack([np.ones(30), *monomials(list(x.T), 2)[1:]])
    projector = phi @ np.linalg.inv(phi.T @ phi) @ phi.T
    result = fit(x, f, 2)
    assert result.errors @ result.errors == pytest.approx(f @ (np.eye(30) - projector) @ f, rel=1e-12)
    np.testing.assert_allclose(phi.T @ result.errors, 0.0, atol=1e-12)


def test_fit_does_not_care_about_the_unit_of_a_variable():
    x = np.random.default_rng(4).uniform(0.0, 1.0, size=(30, 2))
    f = np.exp(x[:, 0] - x[:, 1])
    newtons, kilonewtons = fit(x * [1.0, 1e4], f, 3), fit(x * [1.0, 10.0], f, 3)
    np.testing.assert_allclose(newtons.errors, kilonewtons.errors, atol=1e-12)


def test_design_matrix_has_a_row_for_each_experiment():
    phi = design_matrix([[1.0, 2.0], [3.0, 4.0]], 2)
    np.testing.assert_array_equal(phi, [[1, 1, 2, 1, 2, 4], [1, 3, 4, 9, 12, 16]])


def test_substituted_polynomial_is_the_polynomial_of_the_substitution():
    random = np.random.default_rng(8)
    p, x = random.normal(size=basis_size(3, 4)), random.normal(size=(3, 20))
    centre, scale = np.array([1.0, -2.0, 0.5]), np.array([2.0, 0.5, 3.0])
    z = (x - centre[:, None]) / scale[:, None]
    expanded = substituted(p.tolist(), 4, centre, scale)
    # powers of 4 of numbers near 5 over 0.5: a hundred thousand times rounding
    np.testing.assert_allclose(
        polynomial(expanded, list(x), 4), polynomial(p, list(z), 4), rtol=1e-9, atol=1e-9
    )


def test_fit_far_from_zero_keeps_its_digits():
    # with Phi as printed, (A.5) has a condition number of 1e24 here and finds nothing
    x = np.random.default_rng(9).uniform(900.0, 1100.0, size=(60, 2))
    result = fit(x, np.sin(x[:, 0] / 100.0) * x[:, 1], 4)
    again = fit(x - 1000.0, np.sin(x[:, 0] / 100.0) * x[:, 1], 4)
    np.testing.assert_allclose(result.errors, again.errors, atol=1e-9)  # of values near 1000
    assert result.condition < 100.0


def test_casadi_and_numpy_evaluate_the_same_polynomial():
    x = casadi.SX.sym("x", 3)
    symbolic = casadi.Function("p", [x], [polynomial(EXAMPLE, casadi.vertsplit(x), 2)])
    point = [0.3, -1.7, 2.2]
    assert float(symbolic(point)) == pytest.approx(example(*point), rel=1e-14)


def test_data_that_do_not_determine_the_coefficients_are_refused():
    on_a_line = np.column_stack([np.arange(12.0), 2 * np.arange(12.0)])
    with pytest.raises(ValueError, match=r"only 2 of 3 coefficients"):
        fit(on_a_line, np.arange(12.0), 1)
    with pytest.raises(ValueError, match="2 experiments cannot determine 3 coefficients"):
        fit([[0.0, 1.0], [1.0, 0.0]], [1.0, 2.0], 1)
    with pytest.raises(ValueError, match="do not go with"):
        fit([[0.0], [1.0], [2.0]], [1.0, 2.0], 1)


def test_a_wrong_number_of_coefficients_is_refused():
    with pytest.raises(ValueError, match=r"5 coefficients given .* which has 6"):
        polynomial([1.0] * 5, [1.0, 2.0], 2)


@pytest.mark.parametrize(("variables", "degree"), [(0, 2), (2, -1)])
def test_a_space_without_polynomials_is_refused(variables, degree):
    with pytest.raises(ValueError, match=r"at least one|below zero"):
        exponents(variables, degree)
