"""Polynomials in two variables."""

import numpy as np
import pytest
from flint import fmpq

from thesislib.stability.bivariate import Polynomial, exponents_between
from thesislib.stability.gram import newton_basis, products, split_by_parity, square
from thesislib.stability.program import ProgramError, SosProgram

P = Polynomial.from_terms({(0, 0): 1.0, (1, 0): -2.0, (1, 2): 3.0})
Q = Polynomial.from_terms({(0, 1): 0.5, (2, 1): 4.0})


def test_arithmetic_agrees_with_values_at_points():
    x, y = np.random.default_rng(1).uniform(-1, 1, (2, 20))
    assert np.allclose((P * Q)(x, y), P(x, y) * Q(x, y))
    assert np.allclose((P - Q + 2.0)(x, y), P(x, y) - Q(x, y) + 2.0)
    assert np.allclose(P.derivative(0)(x, y), -2.0 + 3.0 * y**2)
    assert np.allclose(P.derivative(1)(x, y), 6.0 * x * y)


def test_rational_coefficients_stay_rational():
    third = Polynomial.from_terms({(1, 1): fmpq(1, 3)})
    assert dict((third * third).derivative(0).terms()) == {(1, 2): fmpq(2, 9)}


def test_a_product_of_unknown_polynomials_is_refused():
    program = SosProgram("test")
    p, q = program.polynomial([(1, 0)]), program.polynomial([(0, 1)])
    with pytest.raises(TypeError, match="not affine in the unknowns"):
        p * q


def test_half_the_newton_polytope_of_motzkin_s_polynomial():
    support = [(4, 2), (2, 4), (2, 2), (0, 0)]
    assert set(newton_basis(support)) == {(0, 0), (1, 1), (2, 1), (1, 2)}


def test_parity_splits_a_basis_without_loss():
    basis = exponents_between(1, 4)
    blocks = split_by_parity(basis, even=True)
    assert sorted(e for block in blocks for e in block) == sorted(basis)
    assert all(sum(a) % 2 == sum(b) % 2 for block in blocks for a in block for b in block)


def test_gram_matrix_reproduces_its_polynomial():
    blocks = (((1, 0), (0, 1)), ((1, 1),))
    gram = [np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([[3.0]])]
    expected = {(2, 0): 2.0, (1, 1): 1.0, (0, 2): 1.0, (2, 2): 3.0}
    assert dict(square(blocks, gram).terms()) == expected
    assert set(products(blocks)) == set(expected)


def largest_shift(p, basis):
    """Return the largest t for which p - t is a sum of squares."""
    program = SosProgram("test")
    t = program.unknown()
    program.require_sum_of_squares("p - t", p - t, [basis])
    program.maximise(t(0.0, 0.0))
    return program.solve().objective


def test_the_least_value_of_a_quartic_is_found():
    # (x^2 - 1)^2 + (y - 2)^2 + 3 has its least value 3
    x2 = Polynomial.from_terms({(2, 0): 1.0, (0, 0): -1.0})
    y = Polynomial.from_terms({(0, 1): 1.0, (0, 0): -2.0})
    # Clarabel's duality gap
    assert largest_shift(x2 * x2 + y * y + 3.0, exponents_between(0, 2)) == pytest.approx(3.0, abs=1e-5)


def test_motzkin_s_polynomial_is_positive_and_no_sum_of_squares():
    motzkin = Polynomial.from_terms({(4, 2): 1.0, (2, 4): 1.0, (2, 2): -3.0, (0, 0): 1.0})
    program = SosProgram("Motzkin")
    program.require_sum_of_squares("p", motzkin, [newton_basis(motzkin.support)])
    with pytest.raises(ProgramError, match=r"Motzkin: Clarabel ends with .*Infeasible"):
        program.solve()
