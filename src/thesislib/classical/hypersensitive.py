"""A nonlinear problem with a solution in closed form, on which every method of chapter 2 can be measured.

Bring a state to rest, ``dx/dt = -x^3 + u``, at the least cost ``1/2 int (x^2 + u^2) dt``. On an infinite
horizon the Hamiltonian (2.80) is zero, and so the derivative of the optimal cost is
``V'(x) = -x^3 + sqrt(x^6 + x^2)``. With ``Phi = V`` as terminal cost every horizon has the same solution:
``dx/dt = -x sqrt(x^4 + 1)``, which separates.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.optimize import brentq

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
    return _slope(state(t, start))


def _slope(x: ArrayLike) -> Array:
    """Return ``V'(x)``."""
    x = np.asarray(x, float)
    # x^3 and the root agree in nearly all digits where x is large; this form subtracts nothing
    return np.asarray(x / (x**2 + np.sqrt(x**4 + 1)))


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


@dataclass(frozen=True)
class Bounded:
    """The optimum from `start` where the control is no more than `limit` in magnitude.

    The control stays at the bound while the state is large and leaves it with a kink; from there on the
    solution is that without a bound. Along the bound ``dx/dt = -x^3 - limit`` separates as well.

    Parameters
    ----------
    start : float
        State at ``t = 0``, where the bound must hold.
    limit : float
        Largest magnitude of the control, at most 0.4.

    Raises
    ------
    ValueError
        If the limit is not positive or above 0.4, or the control is free at the start.
    """

    start: float
    limit: float

    def __post_init__(self) -> None:
        if not 0 < self.limit <= 0.4:
            raise ValueError(f"limit {self.limit} of the control is outside 0 .. 0.4")
        if not _slope(self.start) > self.limit:
            raise ValueError(f"at the start {self.start} the limit {self.limit} does not bind the control")

    @property
    def leaving(self) -> float:
        """The state at which the control leaves its bound: ``V'(x) = limit``."""
        # V' rises up to x = 0.76, where it is 0.46, and so reaches every admitted limit before
        return float(brentq(lambda x: _slope(x) - self.limit, 0.0, 0.75, xtol=1e-15))

    @property
    def kink(self) -> float:
        """The time in s at which the control leaves its bound."""
        return float(self._elapsed(np.array(self.leaving)))

    def _elapsed(self, x: Array) -> Array:
        """Return the time from the start to `x` along the bound: the integral of 1 / (x^3 + limit)."""
        a = self.limit ** (1 / 3)

        def antiderivative(x: Array) -> Array:
            ratio = np.log((x + a) ** 2 / (x**2 - a * x + a**2)) / 6
            return (ratio + np.arctan((2 * x - a) / (a * np.sqrt(3))) / np.sqrt(3)) / a**2

        return antiderivative(np.asarray(self.start)) - antiderivative(x)

    def state(self, t: ArrayLike) -> Array:
        """Return the optimal state at times `t` >= 0 in s, any shape."""
        times = np.asarray(t, float)
        bound = np.minimum(times, self.kink)
        x = np.full(times.shape, self.leaving)
        for _ in range(60):
            # the time is a falling convex function of the state: Newton's method rises to it from below
            x = x + (self._elapsed(x) - bound) * (x**3 + self.limit)
        return np.where(times < self.kink, x, state(np.maximum(times - self.kink, 0.0), self.leaving))

    def control(self, t: ArrayLike) -> Array:
        """Return the optimal control at times `t` >= 0 in s, any shape."""
        return -np.minimum(_slope(self.state(t)), self.limit)

    def cost(self) -> float:
        """Return the optimal cost; along the bound the Hamiltonian is zero and gives its derivative."""
        along = quad(
            lambda x: 0.5 * (x**2 + self.limit**2) / (x**3 + self.limit),
            self.leaving,
            self.start,
            epsabs=1e-13,
        )
        return float(along[0] + value(self.leaving))
