"""Multivariate polynomials in the monomial order of the thesis, and their least-squares fit (appendix A).

A polynomial is a vector of coefficients; which monomial each belongs to follows from the number of
variables and the degree alone, through the graded reverse lexicographic order of :func:`exponents`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from math import comb
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray


def basis_size(variables: int, degree: int) -> int:
    """Return the number of monomials in ``variables`` variables up to ``degree``: (n + d)! / (d! n!).

    Raises
    ------
    ValueError
        If ``variables`` is below 1 or ``degree`` below 0.
    """
    _refuse_bad_space(variables, degree)
    return comb(variables + degree, variables)


@cache
def exponents(variables: int, degree: int) -> tuple[tuple[int, ...], ...]:
    """Return the exponents of all monomials up to ``degree``, lowest first, in the order of appendix A.

    The lower degree stands first; within a degree, ``a`` stands behind ``b`` if the leftmost nonzero entry
    of ``a - b`` is negative. In two variables and degree two: 1, x1, x2, x1^2, x1 x2, x2^2.

    Parameters
    ----------
    variables : int
        Number of variables, at least 1.
    degree : int
        Highest total degree, at least 0.

    Returns
    -------
    tuple of tuples of int
        ``basis_size(variables, degree)`` rows of ``variables`` exponents.

    Raises
    ------
    ValueError
        If ``variables`` is below 1 or ``degree`` below 0.
    """
    _refuse_bad_space(variables, degree)
    return tuple(row for total in range(degree + 1) for row in _exponents_of_degree(variables, total))


def _exponents_of_degree(variables: int, total: int) -> list[tuple[int, ...]]:
    if variables == 1:
        return [(total,)]
    return [
        (first, *rest)
        for first in range(total, -1, -1)
        for rest in _exponents_of_degree(variables - 1, total - first)
    ]


def monomials(variables: Sequence[Any], degree: int) -> list[Any]:
    """Return every monomial up to ``degree``, evaluated, in the order of :func:`exponents`.

    Parameters
    ----------
    variables : sequence
        x_1 … x_n: floats, numpy arrays of one shape, or casadi expressions.
    degree : int
        Highest total degree.

    Returns
    -------
    list
        ``basis_size(len(variables), degree)`` values; the first is the number 1.0.

    Raises
    ------
    ValueError
        If there is no variable or ``degree`` is below 0.
    """
    evaluated = []
    for powers in exponents(len(variables), degree):
        factors = [x if power == 1 else x**power for x, power in zip(variables, powers, strict=True) if power]
        value: Any = 1.0
        for position, factor in enumerate(factors):
            value = factor if position == 0 else value * factor
        evaluated.append(value)
    return evaluated


def polynomial(coefficients: Sequence[Any], variables: Sequence[Any], degree: int) -> Any:
    """Return the polynomial with ``coefficients`` at ``variables``, equation (A.1).

    Parameters
    ----------
    coefficients : sequence of float or casadi expression
        ``basis_size(len(variables), degree)`` numbers in the order of :func:`exponents`.
    variables : sequence
        x_1 … x_n: floats, numpy arrays of one shape, or casadi expressions.
    degree : int
        Highest total degree.

    Raises
    ------
    ValueError
        If the number of coefficients does not belong to this degree and number of variables.
    """
    size = basis_size(len(variables), degree)
    if len(coefficients) != size:
        raise ValueError(
            f"{len(coefficients)} coefficients given for a polynomial of degree {degree} in "
            f"{len(variables)} variables, which has {size}."
        )
    terms = zip(coefficients, monomials(variables, degree), strict=True)
    constant, _ = next(terms)
    return sum((coefficient * monomial for coefficient, monomial in terms), start=constant)


def design_matrix(points: ArrayLike, degree: int) -> NDArray[np.float64]:
    """Return Phi of (A.2): every monomial at every point, shape (k, q).

    Parameters
    ----------
    points : array_like, shape (k, n)
        One row per experiment.
    degree : int
        Highest total degree.
    """
    x = np.asarray(points, dtype=float)
    columns = monomials(list(x.T), degree)
    return np.column_stack([np.broadcast_to(column, x.shape[0]) for column in columns])


def substituted(
    coefficients: Sequence[float], degree: int, centre: ArrayLike, scale: ArrayLike
) -> NDArray[np.float64]:
    """Return the coefficients in x of a polynomial that is given in z = (x - centre) / scale.

    Parameters
    ----------
    coefficients : sequence of float, length q
        Coefficients of the monomials of z, in the order of :func:`exponents`.
    degree : int
        Highest total degree.
    centre, scale : array_like, shape (n,)
        The substitution.
    """
    c, s = np.asarray(centre, dtype=float), np.asarray(scale, dtype=float)
    order = exponents(len(c), degree)
    place = {powers: i for i, powers in enumerate(order)}
    expanded = np.zeros(len(order))
    for coefficient, powers in zip(coefficients, order, strict=True):
        # each factor ((x - c) / s)^a is a row of binomial coefficients; their product is summed term by term
        factors = [
            [comb(a, j) * (-c[i]) ** (a - j) / s[i] ** a for j in range(a + 1)] for i, a in enumerate(powers)
        ]
        for lower in product(*(range(a + 1) for a in powers)):
            term = coefficient
            for factor, j in zip(factors, lower, strict=True):
                term *= factor[j]
            expanded[place[lower]] += term
    return expanded


@dataclass(frozen=True)
class Fit:
    """A least-squares polynomial fit.

    Attributes
    ----------
    coefficients : numpy.ndarray, shape (q,)
        p_opt of (A.5), in the order of :func:`exponents`.
    errors : numpy.ndarray, shape (k,)
        e = f - Phi p of (A.3), in the unit of the data.
    condition : float
        Condition number of the matrix that was factorised: Phi in centred and scaled variables.
    """

    coefficients: NDArray[np.float64]
    errors: NDArray[np.float64]
    condition: float


def fit(points: ArrayLike, outcomes: ArrayLike, degree: int) -> Fit:
    """Fit a polynomial to data by least squares, equations (A.2) to (A.6).

    The normal equations of (A.5) square the condition number of Phi, and Phi itself is badly conditioned
    in variables far from zero. So every variable is first mapped to -1 .. 1, the matrix in the mapped
    variables is factorised with column pivoting (QR), and the polynomial is expanded into powers of the
    given variables.

    Parameters
    ----------
    points : array_like, shape (k, n)
        One row per experiment.
    outcomes : array_like, shape (k,)
        The measured value of each experiment.
    degree : int
        Highest total degree.

    Raises
    ------
    ValueError
        If the shapes disagree, there are fewer experiments than coefficients, or the experiments do not
        determine every coefficient.
    """
    x = np.asarray(points, dtype=float)
    f = np.asarray(outcomes, dtype=float)
    if x.ndim != 2 or f.shape != (x.shape[0],):
        raise ValueError(f"Points of shape {x.shape} do not go with outcomes of shape {f.shape}.")
    size = basis_size(x.shape[1], degree)
    if x.shape[0] < size:
        raise ValueError(f"{x.shape[0]} experiments cannot determine {size} coefficients of degree {degree}.")
    lowest, highest = x.min(axis=0), x.max(axis=0)
    centre, scale = 0.5 * (lowest + highest), 0.5 * (highest - lowest)
    scale[scale == 0.0] = 1.0
    phi = design_matrix((x - centre) / scale, degree)
    q, r, order = scipy.linalg.qr(phi, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int(np.sum(diagonal > len(f) * np.finfo(float).eps * diagonal[0]))
    if rank < size:
        raise ValueError(f"The experiments determine only {rank} of {size} coefficients of degree {degree}.")
    centred = np.empty(size)
    centred[order] = scipy.linalg.solve_triangular(r, q.T @ f)
    return Fit(
        substituted(centred.tolist(), degree, centre, scale), f - phi @ centred, float(np.linalg.cond(r))
    )


def _refuse_bad_space(variables: int, degree: int) -> None:
    if variables < 1:
        raise ValueError(f"A polynomial in {variables} variables is none: at least one is needed.")
    if degree < 0:
        raise ValueError(f"Degree {degree} of a polynomial is below zero.")
