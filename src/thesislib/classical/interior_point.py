"""A primal-dual interior-point method: the perturbed KKT conditions (2.30) with gamma going to zero.

Slacks s = -h(x) > 0 stand for the inequalities, so that a start may violate them:

    grad f + grad g lambda + grad h mu = 0,   g = 0,   h + s = 0,   mu_i s_i = gamma.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from thesislib.classical.line_search import armijo
from thesislib.classical.programme import Array, Optimum, Programme

__all__ = ["InteriorOptimum", "barrier_matrix", "central_point", "interior_point", "primal_dual_matrix"]

_TO_BOUNDARY = 0.995  # no step takes more than this part of a slack or a multiplier

_DIVERGED = 1e20  # neither a variable nor a multiplier of a programme with a solution comes near it


@dataclass(frozen=True)
class InteriorOptimum(Optimum):
    """An optimum, and the way to it inside the constraints.

    Attributes
    ----------
    slacks, multipliers : numpy.ndarray, shape (K + 1, n_h)
        s and mu at each iterate.
    barriers : numpy.ndarray, shape (K + 1,)
        The smoothing parameter gamma there.
    """

    slacks: Array
    multipliers: Array
    barriers: Array


@dataclass(frozen=True)
class _Iterate:
    x: Array
    s: Array
    lam: Array
    mu: Array


def interior_point(
    programme: Programme, start: ArrayLike, *, tolerance: float = 1e-8, gamma: float = 0.1, most: int = 200
) -> InteriorOptimum:
    """Solve a nonlinear programme (2.20) by following the solutions of (2.30) as gamma decreases.

    Parameters
    ----------
    programme : Programme
        The programme, of n variables.
    start : array_like, shape (n,)
        x_0; it need not satisfy the constraints.
    tolerance : float
        Largest violation of any condition of (2.22) at the end.
    gamma : float
        First value of the smoothing parameter.
    most : int
        Iterations after which to give up.

    Raises
    ------
    ValueError
        If the start has not n finite components, a function is not finite there, or gamma is not positive.
    NotConvergedError
        If the iterations end without satisfying (2.22).
    """
    if not gamma > 0.0:
        raise ValueError(f"gamma = {gamma:g} has to be positive (2.30c)")
    at = _first(programme, start, gamma)
    way = [(at, gamma)]
    residuals = [programme.kkt_residual(at.x, at.lam, at.mu)]
    while residuals[-1] > tolerance:
        while _perturbed_residual(programme, at, gamma) <= 10.0 * gamma and gamma > tolerance / 10.0:
            gamma = max(tolerance / 10.0, min(0.2 * gamma, gamma**1.5))
        at = _advance(programme, at, gamma, tolerance, len(way), most)
        way.append((at, gamma))
        residuals.append(programme.kkt_residual(at.x, at.lam, at.mu))
    return InteriorOptimum(
        at.x,
        at.lam,
        at.mu,
        np.array([each.x for each, _ in way]),
        np.array(residuals),
        np.array([each.s for each, _ in way]),
        np.array([each.mu for each, _ in way]),
        np.array([barrier for _, barrier in way]),
    )


def central_point(
    programme: Programme, start: ArrayLike, gamma: float, *, tolerance: float = 1e-12, most: int = 200
) -> tuple[Array, Array, Array]:
    """Return x, lambda and mu that solve (2.30) for one value of gamma: a point of the central path.

    Parameters and errors are those of :func:`interior_point`; the tolerance is on (2.30).
    """
    if not gamma > 0.0:
        raise ValueError(f"gamma = {gamma:g} has to be positive (2.30c)")
    at, count = _first(programme, start, gamma), 0
    while _perturbed_residual(programme, at, gamma) > tolerance:
        count += 1
        at = _advance(programme, at, gamma, tolerance, count, most)
    return at.x, at.lam, at.mu


def primal_dual_matrix(programme: Programme, x: Array, lam: Array, mu: Array) -> Array:
    """Return the Jacobian of (2.30) in (x, lambda, mu), shape (n + n_g + n_h,) squared."""
    _, g, dg, h, dh = programme.first_order(x)
    return np.block(
        [
            [programme.hessian(x, lam, mu), dg, dh],
            [dg.T, np.zeros((g.size, g.size + h.size))],
            [mu[:, None] * dh.T, np.zeros((h.size, g.size)), np.diag(h)],
        ]
    )


def barrier_matrix(programme: Programme, x: Array, lam: Array, gamma: float) -> Array:
    """Return the Jacobian of the barrier problem's conditions (2.32) in (x, lambda), (n + n_g,) squared."""
    _, g, dg, h, dh = programme.first_order(x)
    curvature = programme.hessian(x, lam, -gamma / h) + dh @ np.diag(gamma / h**2) @ dh.T
    return np.block([[curvature, dg], [dg.T, np.zeros((g.size, g.size))]])


def _first(programme: Programme, start: ArrayLike, gamma: float) -> _Iterate:
    x = programme.start(start)
    s = np.maximum(-programme.constraints(x)[1], 0.1)
    return _Iterate(x, s, np.zeros(programme.equality_count), gamma / s)


def _perturbed(programme: Programme, at: _Iterate, gamma: float) -> tuple[Array, Array, Array, Array]:
    """Return the residuals of (2.30) with slacks."""
    df, g, dg, h, dh = programme.first_order(at.x)
    return df + dg @ at.lam + dh @ at.mu, g, h + at.s, at.mu * at.s - gamma


def _perturbed_residual(programme: Programme, at: _Iterate, gamma: float) -> float:
    return float(np.abs(np.concatenate(_perturbed(programme, at, gamma))).max())


def _advance(
    programme: Programme, at: _Iterate, gamma: float, tolerance: float, count: int, most: int
) -> _Iterate:
    """Return the next iterate, or raise what names the most violated condition."""
    try:
        if count > most:
            raise ArithmeticError(f"{most} iterations are over")
        if max(np.abs(at.x).max(), at.mu.max(initial=0.0)) > _DIVERGED:
            raise ArithmeticError("the iterates grow without bound")
        return _newton_step(programme, at, gamma)
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        what = f"the interior-point method stopped: {error}"
        raise programme.not_converged(at.x, at.lam, at.mu, tolerance, what) from error


def _newton_step(programme: Programme, at: _Iterate, gamma: float) -> _Iterate:
    """Return the iterate after one step of Newton's method on (2.30), kept inside s > 0, mu > 0."""
    stationarity, g, slack, complementarity = _perturbed(programme, at, gamma)
    _, _, dg, _, dh = programme.first_order(at.x)
    sigma = at.mu / at.s
    # s and mu eliminated: a symmetric system in the steps of x and lambda remains
    H = programme.hessian(at.x, at.lam, at.mu) + dh @ (sigma[:, None] * dh.T)
    right = stationarity + dh @ (sigma * slack - complementarity / at.s)
    dx, dlam = _descending_step(H, dg, right, g)
    ds = -slack - dh.T @ dx
    dmu = -(complementarity + at.mu * ds) / at.s
    longest = _to_boundary(at.s, ds)
    nu = 1.1 * float(np.abs(np.concatenate((at.lam + dlam, at.mu, at.mu + dmu))).max(initial=0.0))

    def merit(share: float) -> float:
        x, s = at.x + share * longest * dx, at.s + share * longest * ds
        equalities, inequalities = programme.constraints(x)
        violation = np.abs(equalities).sum() + np.abs(inequalities + s).sum()
        return programme.value(x) - gamma * float(np.log(s).sum()) + nu * float(violation)

    slope = float(programme.gradient(at.x) @ dx - gamma * (ds / at.s).sum())
    slope -= nu * float(np.abs(g).sum() + np.abs(slack).sum())
    alpha = longest * armijo(merit, merit(0.0), longest * slope)
    return _Iterate(
        at.x + alpha * dx,
        at.s + alpha * ds,
        at.lam + alpha * dlam,
        at.mu + _to_boundary(at.mu, dmu) * dmu,
    )


def _descending_step(H: Array, dg: Array, right: Array, g: Array) -> tuple[Array, Array]:
    """Return the steps of x and lambda, with H lifted until H is positive on the tangents of g = 0."""
    n, shift = len(H), 0.0
    while True:
        matrix = np.block([[H + shift * np.eye(n), dg], [dg.T, np.zeros((g.size, g.size))]])
        # as many positive eigenvalues as variables: then the step is one to a minimum, not to a saddle
        if np.count_nonzero(np.linalg.eigvalsh(matrix) > 0.0) == n:
            break
        shift = max(1e-4 * max(1.0, float(np.abs(H).max())), 8.0 * shift)
        if shift > 1e60:
            raise ArithmeticError("no multiple of the identity makes the Hessian positive")
    step = np.linalg.solve(matrix, -np.concatenate((right, g)))
    return step[:n], step[n:]


def _to_boundary(values: Array, step: Array) -> float:
    """Return the longest part, at most 1, of a step that leaves the values positive."""
    shrinking = step < 0.0
    return float(np.min(-_TO_BOUNDARY * values[shrinking] / step[shrinking], initial=1.0))
