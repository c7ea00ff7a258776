"""Programs 7.1 to 7.3 of the thesis, on fields in slip coordinates about the trim.

All sets are {V <= 1}: V is divided by gamma. phi_1 = phi_2 = EPSILON (z_1² + z_2²).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_lyapunov

from thesislib.stability.bivariate import Polynomial, exponents_between
from thesislib.stability.fields import Field
from thesislib.stability.gram import Basis, newton_basis, split_by_parity, square
from thesislib.stability.program import ProgramError, SosProgram
from thesislib.stability.rays import Rays

EPSILON = 2.0**-13
"""Weight of phi_1 and phi_2 (7.22), about 1.2e-4."""

PHI = EPSILON * Polynomial.from_terms({(2, 0): 1.0, (0, 2): 1.0})


@dataclass(frozen=True)
class Bases:
    """Monomials of the three sums of squares for one degree of V.

    Attributes
    ----------
    positive, falling, multiplier : tuple of bases
        Blocks for (7.28), for (7.30) and for q_2.
    """

    positive: tuple[Basis, ...]
    falling: tuple[Basis, ...]
    multiplier: tuple[Basis, ...]


@cache
def bases(field: Field, degree: int, multiplier_degree: int = 2) -> Bases:
    """Return the pruned bases for a field and an even degree of V.

    Raises
    ------
    ValueError
        If a degree is not even and positive.
    """
    for name, value in (("V", degree), ("q_2", multiplier_degree)):
        if value < 2 or value % 2:
            raise ValueError(f"deg {name} = {value} is not an even number from 2 on.")
    V = _all_ones(exponents_between(2, degree, even=field.odd))
    multiplier = split_by_parity(exponents_between(1, multiplier_degree // 2), field.odd)
    q_2 = _all_ones(_square_support(multiplier))
    n_1, n_2, d = (_all_ones(p.support) for p in field.floats)
    everything = V.derivative(0) * n_1 + V.derivative(1) * n_2 + d * PHI + d * q_2 + d * q_2 * V
    return Bases(
        split_by_parity(exponents_between(1, degree // 2), field.odd),
        split_by_parity(newton_basis(everything.support), field.odd),
        multiplier,
    )


def _all_ones(support: Sequence[tuple[int, int]]) -> Polynomial:
    return Polynomial.from_terms(dict.fromkeys(support, 1.0))


def _square_support(blocks: Sequence[Basis]) -> list[tuple[int, int]]:
    return square(blocks, [np.ones((len(block), len(block))) for block in blocks]).support


def rise(field: Field, V: Polynomial) -> Polynomial:
    """Return grad V · n, which is dV/dt times the positive d."""
    n_1, n_2, _ = field.floats
    return n_1 * V.derivative(0) + n_2 * V.derivative(1)


def falling(field: Field, V: Polynomial, q_2: Polynomial, *, level: float = 1.0) -> Polynomial:
    """Return the left-hand side of (7.30)."""
    d = field.floats[2]
    return d * q_2 * (V - level) - rise(field, V) - d * PHI


def slack(blocks: Sequence[Basis]) -> Polynomial:
    """Return the sum of (z/2)^(2m) over the basis: what a constraint is moved by to have an interior."""
    return Polynomial.from_terms({(2 * i, 2 * j): 0.25 ** (i + j) for block in blocks for i, j in block})


@dataclass(frozen=True)
class Multiplier:
    """A sum of squares that proves {V <= 1} to be invariant, as the solver found it.

    Attributes
    ----------
    grams : list of arrays
        Gram matrices of q_2, one for each block.
    falling : list of arrays
        Gram matrices of (7.30).
    margin : float
        The slack t by which (7.30) holds; negative if it does not.
    """

    grams: list[NDArray[np.float64]]
    falling: list[NDArray[np.float64]]
    margin: float

    def polynomial(self, blocks: Sequence[Basis]) -> Polynomial:
        """Return q_2."""
        return square(blocks, self.grams)


def multiplier(field: Field, V: Polynomial, *, level: float = 1.0, multiplier_degree: int = 2) -> Multiplier:
    """Return the q_2 with the largest slack in (7.30) for a given V: the test of the gamma step.

    Raises
    ------
    ProgramError
        If the solver gives up.
    """
    basis = bases(field, V.degree, multiplier_degree)
    program = SosProgram(f"gamma step, deg V = {V.degree}")
    q_2 = program.sum_of_squares("q_2", basis.multiplier)
    t = program.unknown()
    program.require_sum_of_squares(
        "falling", falling(field, V, q_2, level=level) - slack(basis.falling) * t, basis.falling
    )
    # where q_2 may grow without bound, so may the slack
    bound = -t(0.0, 0.0)[0]
    bound[0] += 1.0
    program.require_nonnegative(bound)
    program.maximise(t(0.0, 0.0))
    found = program.solve()
    margin = found.objective
    lifted = [
        gram + margin * np.diag([0.25 ** sum(e) for e in block])
        for gram, block in zip(found.grams["falling"], basis.falling, strict=True)
    ]
    return Multiplier(found.grams["q_2"], lifted, margin)


def linear_lyapunov(field: Field, to_state: NDArray[np.float64]) -> Polynomial:
    """Return V_lin of (7.37) with Q the identity in (v, omega), as a polynomial in z.

    Parameters
    ----------
    field : Field
    to_state : array, shape (2, 2)
        (v, omega) = to_state @ z.
    """
    P = solve_continuous_lyapunov(field.jacobian.T, -to_state.T @ to_state)
    return quadratic(P)


def common_lyapunov(fields: Sequence[Field]) -> Polynomial:
    """Return the quadratic V that falls fastest near the origin along all fields, its slowest counted.

    Raises
    ------
    ProgramError
        If no quadratic V falls along all of them.
    """
    program = SosProgram("common quadratic V")
    V = program.polynomial([(2, 0), (1, 1), (0, 2)])
    t = program.unknown()
    program.require_nonnegative(np.eye(1, V.coefficients.shape[2])[0] - _trace(V))
    program.require_sum_of_squares("positive", V - PHI, [((1, 0), (0, 1))])
    for field in fields:
        program.require_positive_semidefinite(falling_near_origin(V, field.jacobian, t))
    program.maximise(t(0.0, 0.0))
    found = program.solve()
    if found.objective <= 0:
        raise ProgramError(f"No quadratic V falls near the origin along all {len(fields)} fields.")
    return V.value_at(found.unknowns)


def falling_near_origin(V: Polynomial, A: NDArray[np.float64], margin: Polynomial) -> NDArray[np.float64]:
    """Return -(A'P + PA) - margin I as affine forms, P being the quadratic part of V.

    Parameters
    ----------
    V : Polynomial
        With unknown coefficients.
    A : array, shape (2, 2)
    margin : Polynomial
        A constant, known or unknown.
    """
    c, m = V.coefficients, margin.coefficients.reshape(-1)
    P = np.zeros((2, 2, max(c.shape[2], len(m))))
    P[0, 0, : c.shape[2]], P[1, 1, : c.shape[2]] = c[2, 0], c[0, 2]
    P[0, 1, : c.shape[2]] = P[1, 0, : c.shape[2]] = c[1, 1] / 2
    product = np.einsum("ki,kjs->ijs", A, P)
    matrix = -(product + product.transpose(1, 0, 2))
    matrix[[0, 1], [0, 1], : len(m)] -= m
    return np.asarray(matrix)


def quadratic(P: NDArray[np.float64]) -> Polynomial:
    """Return z'Pz."""
    return Polynomial.from_terms({(2, 0): P[0, 0], (1, 1): 2 * P[0, 1], (0, 2): P[1, 1]})


def local_lyapunov(field: Field, g: Polynomial, *, degree: int = 2) -> Polynomial:
    """Return a V of Program 7.2: it falls wherever g <= 0, which proves local stability there.

    With a constant d this is Program 7.1.

    Parameters
    ----------
    field : Field
    g : Polynomial
        The neighbourhood D is {g <= 0}.
    degree : int
        Degree of V.

    Raises
    ------
    ProgramError
        If no such V exists: no V of this degree falls in all of the neighbourhood with a q of degree 2.
    """
    basis = bases(field, degree)
    program = SosProgram(f"Program 7.2, deg V = {degree}")
    V = program.polynomial(exponents_between(2, degree, even=field.odd))
    q = program.sum_of_squares("q", basis.multiplier)
    t = program.unknown()
    d = field.floats[2]
    program.require_sum_of_squares("positive", V - PHI, basis.positive)
    program.require_sum_of_squares(
        "falling", d * g * q - rise(field, V) - d * PHI - slack(basis.falling) * t, basis.falling
    )
    # V may be multiplied by any number: its largest slack is asked for at a trace of one
    program.require_nonnegative(np.eye(1, V.coefficients.shape[2])[0] - _trace(V))
    program.maximise(t(0.0, 0.0))
    found = program.solve()
    if found.objective < 0:
        raise ProgramError(
            f"Program 7.2, deg V = {degree}: no V falls in the whole neighbourhood "
            f"(largest slack {found.objective:.2g})."
        )
    return V.value_at(found.unknowns)


def _trace(V: Polynomial) -> NDArray[np.float64]:
    """Return the sum of the coefficients of z_1² and z_2² as an affine form."""
    form: NDArray[np.float64] = V.coefficients[2, 0] + V.coefficients[0, 2]
    return form


def level_of(field: Field, V: Polynomial, rays: int = 480) -> float:
    """Return the level at which V stops falling, by samples along rays: an upper bound of gamma."""
    return Rays(rays // 2 if field.odd else rays, half=field.odd).lowest_level(V, rise(field, V))
