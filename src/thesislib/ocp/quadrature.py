"""Legendre points of four kinds, their weights and the matrices that belong to them.

Gauss points (LG) lie inside [-1, 1], Radau points (LGR) include its start, flipped Radau points its end
and Lobatto points (LGL) both. Collocation uses the two Radau rules: the state's polynomial is supported
by their points and by the end that they leave out, and the slope is compared at the points.

All matrices refer to the interval [-1, 1]; a mesh interval of width ``h`` scales weights
and integration matrices by ``h/2`` and differentiation matrices by ``2/h``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import eval_legendre, roots_jacobi

Array = NDArray[np.float64]


@lru_cache(maxsize=256)
def radau_points(n: int) -> Array:
    """Return the `n` Legendre–Gauss–Radau points, the first of which is -1.

    Parameters
    ----------
    n : int
        Number of points, at least 1.

    Returns
    -------
    ndarray, shape (n,)
        Increasing points in [-1, 1); read-only.

    Raises
    ------
    ValueError
        If `n` is below 1.

    Notes
    -----
    The points past -1 are the roots of (P_{n-1} + P_n)/(1 + τ), the Jacobi polynomial with
    exponents (0, 1) of degree n - 1 (thesis section 2.6.4.1).
    """
    if n < 1:
        raise ValueError(f"a Radau rule needs at least one point, not {n}")
    interior = roots_jacobi(n - 1, 0, 1)[0] if n > 1 else np.empty(0)
    return _frozen(np.concatenate(([-1.0], interior)))


@lru_cache(maxsize=256)
def radau_weights(n: int) -> Array:
    """Return the weights of (2.136), exact for polynomials of degree 2n - 2.

    Parameters
    ----------
    n : int
        Number of points, at least 1.

    Returns
    -------
    ndarray, shape (n,)
        Positive weights that sum to 2; read-only.
    """
    tau = radau_points(n)
    return _frozen((1 - tau) / (n * eval_legendre(n - 1, tau)) ** 2)


@lru_cache(maxsize=256)
def gauss_points(n: int) -> Array:
    """Return the `n` Legendre–Gauss points: the roots of P_n.

    Parameters
    ----------
    n : int
        Number of points, at least 1.

    Returns
    -------
    ndarray, shape (n,)
        Increasing points in (-1, 1); read-only.

    Raises
    ------
    ValueError
        If `n` is below 1.
    """
    if n < 1:
        raise ValueError(f"a Gauss rule needs at least one point, not {n}")
    points = roots_jacobi(n, 0, 0)[0]
    return _frozen(0.5 * (points - points[::-1]))


@lru_cache(maxsize=256)
def gauss_weights(n: int) -> Array:
    """Return the weights w = 2/((1 - τ²) P'_n(τ)²), exact for polynomials of degree 2n - 1.

    Thesis (2.135), where the square has moved out of the first parenthesis.

    Parameters
    ----------
    n : int
        Number of points, at least 1.

    Returns
    -------
    ndarray, shape (n,)
        Positive weights that sum to 2; read-only.
    """
    tau = gauss_points(n)
    # (1 - τ²) P'_n = n P_{n-1} at a root of P_n
    return _frozen(2 * (1 - tau**2) / (n * eval_legendre(n - 1, tau)) ** 2)


@lru_cache(maxsize=256)
def lobatto_points(n: int) -> Array:
    """Return the `n` Legendre–Gauss–Lobatto points: both ends and the roots of P'_{n-1}.

    Parameters
    ----------
    n : int
        Number of points, at least 2.

    Returns
    -------
    ndarray, shape (n,)
        Increasing points in [-1, 1]; read-only.

    Raises
    ------
    ValueError
        If `n` is below 2.
    """
    if n < 2:
        raise ValueError(f"a Lobatto rule needs both ends, not {n} points")
    interior = roots_jacobi(n - 2, 1, 1)[0] if n > 2 else np.empty(0)
    return _frozen(np.concatenate(([-1.0], 0.5 * (interior - interior[::-1]), [1.0])))


@lru_cache(maxsize=256)
def lobatto_weights(n: int) -> Array:
    """Return the weights w = 2/(n (n - 1) P_{n-1}(τ)²), exact for polynomials of degree 2n - 3.

    Thesis (2.137), which prints the derivative of P_{n-1}: that is zero at these points.

    Parameters
    ----------
    n : int
        Number of points, at least 2.

    Returns
    -------
    ndarray, shape (n,)
        Positive weights that sum to 2; read-only.
    """
    return _frozen(2 / (n * (n - 1) * eval_legendre(n - 1, lobatto_points(n)) ** 2))


@lru_cache(maxsize=256)
def flipped_radau_points(n: int) -> Array:
    """Return the `n` Radau points mirrored, the last of which is 1; those of the Radau IIA methods.

    Parameters
    ----------
    n : int
        Number of points, at least 1.

    Returns
    -------
    ndarray, shape (n,)
        Increasing points in (-1, 1]; read-only.
    """
    return _frozen(-radau_points(n)[::-1])


@lru_cache(maxsize=256)
def flipped_radau_weights(n: int) -> Array:
    """Return the weights of the mirrored Radau points, exact for polynomials of degree 2n - 2."""
    return _frozen(radau_weights(n)[::-1])


@dataclass(frozen=True)
class Rule:
    """A family of points with their weights and matrices on [-1, 1].

    Attributes
    ----------
    name : str
        What it is called.
    points, weights : callable
        From a number of points n to arrays of shape (n,).
    start, end : bool
        Whether -1 and 1 are among the points.
    """

    name: str
    points: Callable[[int], Array]
    weights: Callable[[int], Array]
    start: bool
    end: bool

    def degree(self, n: int) -> int:
        """Return the highest degree that the rule of `n` points integrates exactly."""
        return 2 * n - 1 - self.start - self.end

    def support(self, n: int) -> Array:
        """Return what supports the state's polynomial: the points, and one end if they leave it out.

        Of Gauss points, which leave out both, it is the start.
        """
        return _support(self, n)

    def differentiation(self, n: int) -> Array:
        """Return the slopes at the points of the Lagrange polynomials of the support, (2.148).

        Shape (n, n + 1), and (n, n) for Lobatto points.
        """
        return _differentiation(self, n)

    def integration(self, n: int) -> Array:
        """Return the integrals from -1 to every further support point, (2.150).

        Row i integrates the polynomial through values at the points from -1 to support point i + 1:
        shape (n, n), and (n - 1, n) for Lobatto points. Except for those it is the inverse of the
        differentiation matrix without its first column.
        """
        return _integration(self, n)


GAUSS = Rule("Legendre–Gauss", gauss_points, gauss_weights, False, False)
RADAU = Rule("Legendre–Gauss–Radau", radau_points, radau_weights, True, False)
FLIPPED_RADAU = Rule("flipped Legendre–Gauss–Radau", flipped_radau_points, flipped_radau_weights, False, True)
LOBATTO = Rule("Legendre–Gauss–Lobatto", lobatto_points, lobatto_weights, True, True)


@lru_cache(maxsize=512)
def _support(rule: Rule, n: int) -> Array:
    before = [] if rule.start else [-1.0]
    after = [1.0] if rule.start and not rule.end else []
    return _frozen(np.concatenate((before, rule.points(n), after)))


@lru_cache(maxsize=512)
def _differentiation(rule: Rule, n: int) -> Array:
    matrix = differentiation_matrix(rule.support(n))
    if not rule.start:
        return _frozen(matrix[1:])
    return _frozen(matrix if rule.end else matrix[:-1])


@lru_cache(maxsize=512)
def _integration(rule: Rule, n: int) -> Array:
    if not (rule.start and rule.end):
        return _frozen(np.linalg.inv(rule.differentiation(n)[:, 1:]))
    # ∫ from -1 to s of a polynomial of degree n - 1, by a Gauss rule that is exact for it
    tau, weights = gauss_points(n), gauss_weights(n)
    rows = []
    for place in rule.support(n)[1:]:
        half = 0.5 * (place + 1)
        rows.append(half * weights @ interpolation_matrix(rule.points(n), -1 + half * (tau + 1)))
    return _frozen(np.array(rows))


def barycentric_weights(support: Array) -> Array:
    """Return the barycentric weights of Lagrange interpolation on `support`.

    Parameters
    ----------
    support : ndarray, shape (m,)
        Distinct points.

    Returns
    -------
    ndarray, shape (m,)
        Weights, scaled to a largest magnitude of one.
    """
    gaps = support[:, None] - support[None, :]
    np.fill_diagonal(gaps, 1.0)
    # 2/width is the capacity of the interval: it keeps the products near one for many points
    weights = 1.0 / np.prod(gaps * (2.0 / max(np.ptp(support), 1e-300)), axis=1)
    return np.asarray(weights / np.abs(weights).max())


def interpolation_matrix(support: Array, points: Array) -> Array:
    """Return the matrix that carries values on `support` to values at `points`.

    Parameters
    ----------
    support : ndarray, shape (m,)
        Support points of the Lagrange basis (2.144).
    points : ndarray, shape (k,)
        Where to evaluate the interpolating polynomial.

    Returns
    -------
    ndarray, shape (k, m)
        Element (i, j) is ℓ_j(points_i).
    """
    gaps = points[:, None] - support[None, :]
    exact = gaps == 0
    quotients = barycentric_weights(support) / np.where(exact, 1.0, gaps)
    matrix = quotients / quotients.sum(axis=1, keepdims=True)
    on_support = exact.any(axis=1)
    matrix[on_support] = exact[on_support]
    return np.asarray(matrix)


def differentiation_matrix(support: Array) -> Array:
    """Return the matrix of derivatives of the Lagrange basis at its own support points.

    Parameters
    ----------
    support : ndarray, shape (m,)
        Support points.

    Returns
    -------
    ndarray, shape (m, m)
        Element (i, j) is dℓ_j/dτ at support_i.
    """
    weights = barycentric_weights(support)
    gaps = support[:, None] - support[None, :]
    np.fill_diagonal(gaps, 1.0)
    matrix = weights[None, :] / weights[:, None] / gaps
    np.fill_diagonal(matrix, 0.0)
    # the rows of a differentiation matrix sum to zero: constants have no slope
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return np.asarray(matrix)


def radau_differentiation(n: int) -> Array:
    """Return the n × (n + 1) differentiation matrix (2.148) of Radau points and the end."""
    return RADAU.differentiation(n)


def radau_integration(n: int) -> Array:
    """Return the n × n integration matrix (2.150) of Radau points; its last row holds the weights."""
    return RADAU.integration(n)


def _frozen(values: ArrayLike) -> Array:
    """Make a cached array read-only, so that no caller can change what the next one gets."""
    frozen = np.ascontiguousarray(values, dtype=float)
    frozen.flags.writeable = False
    return frozen
