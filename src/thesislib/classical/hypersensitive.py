"""A nonlinear problem with a solution in closed form, on which every method of chapter 2 can be measured.

Bring a state to rest, ``dx/dt = -x^3 + u``, at the least cost ``1/2 int (x^2 + u^2) dt``. On an infinite
horizon the Hamiltonian (2.80) is zero, and so the derivative of the optimal cost is
``V'(x) = -x^3 + sqrt(x^6 + x^2)``. With ``Phi = V`` as terminal cost every horizon has the same solution:
``dx/dt = -x sqrt(x^4 + 1)``, which separates.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from .control_problem import Array, ControlProblem, Expression


def value(x: ArrayLike) -> Array:
    """Return the optimal cost from the state `x` >= 0 on, any shape."""
    w = np.square(np.asarray(x, float))
    return 0.25 * (w * np.sqrt(w**2 + 1) + np.arcsinh(w) - w**2)


def state(t: ArrayLike, start: float) -> Array:
    """Return the optimal state at times `t` in s, any shape, from `start` > 0 at ``t = 0``."""
    return 1 / np.sqrt(np.sinh(2 * np.asarray(t, float) + np.arcsinh(start**-2)))


def costate(t: ArrayLike, start: float) -> Array:
    """Return the costate ``V'(x)`` at times `t` in s; the optimal control is its negative."""
    x = state(t, start)
    # x^3 and the root agree in nearly all digits where x is large; this form subtracts nothing
    return x / (x**2 + np.sqrt(x**4 + 1))


def hypersensitive(horizon: float, start: float = 1.5) -> ControlProblem:
    """Return the problem on the given horizon in s, from the state `start`.

    Raises
    ------
    ValueError
        If `start` is not positive, where the closed form ends, or the horizon is not.
    """
    if not start > 0:
        raise ValueError(f"hypersensitive problem: start {start} must be positive")

    def terminal_cost(x: Expression, _: Expression) -> Expression:
        w = x[0] ** 2
        return 0.25 * (w * ca.sqrt(w**2 + 1) + ca.asinh(w) - w**2)

    return ControlProblem(
        "hypersensitive",
        dynamics=lambda x, u: [-(x[0] ** 3) + u[0]],
        running_cost=lambda x, u: 0.5 * (x[0] ** 2 + u[0] ** 2),
        initial=[start],
        final_time=horizon,
        terminal_cost=terminal_cost,
    )
