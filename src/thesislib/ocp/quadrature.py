"""Legendre–Gauss–Radau points, weights and the matrices that belong to them.

All matrices refer to the interval [-1, 1]; a mesh interval of width ``h`` scales weights
and integration matrices by ``h/2`` and differentiation matrices by ``2/h``.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import eval_legendre, roots_jacobi

Array = NDArray[np.float64]


@lru_cache(maxsize=128)
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


@lru_cache(maxsize=128)
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


@lru_cache(maxsize=128)
def radau_differentiation(n: int) -> Array:
    """Return the n × (n + 1) differentiation matrix (2.148).

    Parameters
    ----------
    n : int
        Number of collocation points.

    Returns
    -------
    ndarray, shape (n, n + 1)
        Rows belong to the collocation points, the last column to the end point τ = 1,
        which supports the state but is not collocated.
    """
    support = np.concatenate((radau_points(n), [1.0]))
    return _frozen(differentiation_matrix(support)[:-1])


@lru_cache(maxsize=128)
def radau_integration(n: int) -> Array:
    """Return the n × n integration matrix (2.150), the inverse of D without its first column.

    Parameters
    ----------
    n : int
        Number of collocation points.

    Returns
    -------
    ndarray, shape (n, n)
        Row i integrates from -1 to support point i + 1; the last row holds the weights.
    """
    return _frozen(np.linalg.inv(radau_differentiation(n)[:, 1:]))


def _frozen(values: ArrayLike) -> Array:
    """Make a cached array read-only, so that no caller can change what the next one gets."""
    frozen = np.ascontiguousarray(values, dtype=float)
    frozen.flags.writeable = False
    return frozen
