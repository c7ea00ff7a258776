"""Sequential quadratic programming (2.29): Newton on the KKT conditions, one quadratic programme a step."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from thesislib.classical.line_search import armijo
from thesislib.classical.programme import Array, Optimum, Programme, column

__all__ = ["newton_kkt_step", "sqp"]

_QUIET = {"print_iter": False, "print_header": False, "print_info": False, "error_on_fail": False}


def sqp(programme: Programme, start: ArrayLike, *, tolerance: float = 1e-8, most: int = 100) -> Optimum:
    """Solve a nonlinear programme (2.20) by sequential quadratic programming.

    Each step solves (2.29) by the active-set method QRQP of CasADi, whose multipliers become the next ones.
    Where that programme has no lowest point, multiples of the identity are added to the Hessian. Along
    the step Armijo's rule is applied to f + nu (sum |g| + sum max(h, 0)), with nu above every multiplier;
    there is no second-order correction, so that a strongly curved constraint can shorten good steps.

    Parameters
    ----------
    programme : Programme
        The programme, of n variables.
    start : array_like, shape (n,)
        x_0; it need not satisfy the constraints. The multipliers start at zero.
    tolerance : float
        Largest violation of any condition of (2.22) at the end.
    most : int
        Iterations after which to give up.

    Raises
    ------
    ValueError
        If the start has not n finite components or a function is not finite there.
    NotConvergedError
        If a quadratic programme is infeasible or the iterations end without satisfying (2.22).
    """
    x = programme.start(start)
    lam, mu = np.zeros(programme.equality_count), np.zeros(programme.inequality_count)
    points, residuals = [x], [programme.kkt_residual(x, lam, mu)]
    while residuals[-1] > tolerance:
        if len(points) > most:
            raise programme.not_converged(x, lam, mu, tolerance, f"SQP stopped after {most} iterations")
        try:
            p, lam, mu = _quadratic_step(programme, x, lam, mu)
            x = x + _merit_step(programme, x, p, 1.1 * float(np.abs(np.append(lam, mu)).max(initial=0.0))) * p
        except ArithmeticError as error:
            raise programme.not_converged(
                x, lam, mu, tolerance, f"SQP iteration {len(points)}: {error}"
            ) from error
        points.append(x)
        residuals.append(programme.kkt_residual(x, lam, mu))
    return Optimum(x, lam, mu, np.array(points), np.array(residuals))


def newton_kkt_step(programme: Programme, x: Array, lam: Array) -> tuple[Array, Array]:
    """Return p_k and lambda_{k+1} of (2.26), shapes (n,) and (n_g,), for equalities alone."""
    df, g, dg, _, _ = programme.first_order(x)
    matrix = np.block([[programme.hessian(x, lam), dg], [dg.T, np.zeros((g.size, g.size))]])
    step = np.linalg.solve(matrix, -np.concatenate((df, g)))
    return step[: x.size], step[x.size :]


def _quadratic_step(programme: Programme, x: Array, lam: Array, mu: Array) -> tuple[Array, Array, Array]:
    """Return the solution and the multipliers of (2.29)."""
    df, g, dg, h, dh = programme.first_order(x)
    H, normals = programme.hessian(x, lam, mu), np.hstack((dg, dh)).T
    lower, upper = np.concatenate((-g, np.full(h.size, -np.inf))), np.concatenate((-g, -h))
    shape = {"h": ca.Sparsity.dense(*H.shape), "a": ca.Sparsity.dense(*normals.shape)}
    solver = ca.conic("qp", "qrqp", shape, _QUIET)
    shift, size = 0.0, max(1.0, float(np.abs(H).max()))
    while shift < 1e8 * size:
        shifted = H + shift * np.eye(x.size)
        found = solver(h=shifted, g=df, a=normals, lba=lower, uba=upper)
        p, multipliers = column(found["x"]), column(found["lam_a"])
        descends = p @ shifted @ p > 0.0 or not p.any()
        if solver.stats()["success"] and np.all(np.isfinite(p)) and descends:
            return p, multipliers[: g.size], multipliers[g.size :]
        shift = max(1e-3 * size, 10.0 * shift)
    raise ArithmeticError("the quadratic programme (2.29) has no solution")


def _merit_step(programme: Programme, x: Array, p: Array, nu: float) -> float:
    """Return the step length that lowers objective and violation together."""

    def violation(at: Array) -> float:
        g, h = programme.constraints(at)
        return float(np.abs(g).sum() + np.maximum(h, 0.0).sum())

    def merit(alpha: float) -> float:
        return programme.value(x + alpha * p) + nu * violation(x + alpha * p)

    slope = float(programme.gradient(x) @ p) - nu * violation(x)
    return armijo(merit, merit(0.0), slope)
