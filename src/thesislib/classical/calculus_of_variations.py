"""The Euler–Lagrange equation (2.66), and the functional (2.53) it makes stationary: section 2.3."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from .control_problem import Array, ConvergenceError, Expression

Integrand = Callable[[Expression, Expression, Expression], Expression]
"""``L(y, y', x)`` of (2.53)."""


class EulerLagrange:
    """Both sides of (2.66) for an integrand, differentiated exactly.

    Parameters
    ----------
    integrand : callable
        ``L(y, y', x)``; must accept CasADi symbols.
    """

    def __init__(self, integrand: Integrand) -> None:
        y, slope, curvature, x = ca.SX.sym("y"), ca.SX.sym("y'"), ca.SX.sym("y''"), ca.SX.sym("x")
        L = integrand(y, slope, x)
        by_slope = ca.gradient(L, slope)
        along = (
            ca.gradient(by_slope, x)
            + ca.gradient(by_slope, y) * slope
            + ca.gradient(by_slope, slope) * curvature
        )
        self._integrand = ca.Function("L", [y, slope, x], [L])
        self._residual = ca.Function("residual", [y, slope, curvature, x], [ca.gradient(L, y) - along])
        self._first_integral = ca.Function("first_integral", [y, slope, x], [L - slope * by_slope])

    def integrand(self, y: ArrayLike, slope: ArrayLike, x: ArrayLike) -> Array:
        """Return L at points of a curve, shape (N,)."""
        return _evaluated(self._integrand, y, slope, x)

    def residual(self, y: ArrayLike, slope: ArrayLike, curvature: ArrayLike, x: ArrayLike) -> Array:
        """Return the left-hand side of (2.66) at points of a curve, shape (N,), in units of L / y."""
        return _evaluated(self._residual, y, slope, curvature, x)

    def first_integral(self, y: ArrayLike, slope: ArrayLike, x: ArrayLike) -> Array:
        """Return ``L - y' dL/dy'``, constant along an extremal if L does not name x; shape (N,)."""
        return _evaluated(self._first_integral, y, slope, x)


def _evaluated(function: ca.Function, *arguments: ArrayLike) -> Array:
    rows = np.broadcast_arrays(*(np.asarray(each, float) for each in arguments))
    flat = [row.reshape(1, -1) for row in rows]
    return function.map(flat[0].size)(*flat).full().reshape(rows[0].shape)


@dataclass(frozen=True)
class Curve:
    """A curve ``y(x)`` on quadrature points.

    Attributes
    ----------
    x, y, slope : numpy.ndarray, shape (N,)
        Abscissa, ordinate and dy/dx.
    weights : numpy.ndarray, shape (N,)
        Weights dx of the quadrature.
    """

    x: Array
    y: Array
    slope: Array
    weights: Array

    @classmethod
    def parametric(cls, curve: Callable[[Any], tuple[Any, Any]], end: float, points: int = 64) -> Curve:
        """Sample ``theta -> (x, y)`` for theta in 0 .. `end` at Gauss's points.

        A parameter with ``dx/dtheta = 0`` where y' is infinite keeps the quadrature spectral there. The
        derivatives are complex steps, so `curve` must be analytic.
        """
        nodes, weights = np.polynomial.legendre.leggauss(points)
        theta = end * (nodes + 1) / 2
        step = 1e-30
        x, y = curve(theta)
        dx, dy = (part.imag / step for part in curve(theta + 1j * step))
        return cls(x, y, dy / dx, end / 2 * weights * dx)

    def varied(self, epsilon: float, variation: Callable[[Array], tuple[Array, Array]]) -> Curve:
        """Return the curve (2.38), ``y + epsilon phi``; `variation` gives phi and its derivative at x."""
        phi, phi_slope = variation(self.x)
        return Curve(self.x, self.y + epsilon * phi, self.slope + epsilon * phi_slope, self.weights)

    def functional(self, conditions: EulerLagrange) -> float:
        """Return J, (2.53)."""
        return float(self.weights @ conditions.integrand(self.y, self.slope, self.x))


def best_polygon(
    cost: Callable[[Expression, Expression, Expression], Expression],
    x: ArrayLike,
    y_a: float,
    y_b: float,
    guess: ArrayLike | None = None,
) -> tuple[Array, float]:
    """Return the ordinates of the polygon of least cost, Euler's own way to (2.66), and the cost.

    Setting to zero the derivative of the summed cost by one corner's ordinate gives (2.66) in the limit of
    short pieces.

    Parameters
    ----------
    cost : callable
        Cost of a straight piece, ``(dx, y_left, y_right)``; must accept CasADi symbols.
    x : array_like, shape (N + 1,)
        Abscissae of the corners, increasing.
    y_a, y_b : float
        Ordinates of the ends, (2.54).
    guess : array_like, shape (N + 1,), optional
        Ordinates to begin with; by default those of the straight line between the ends.

    Returns
    -------
    y : numpy.ndarray, shape (N + 1,)
    cost : float

    Raises
    ------
    ValueError
        If the abscissae do not increase, or the guess has another shape.
    ConvergenceError
        If IPOPT does not converge; it names the largest derivative of the cost.
    """
    places = np.asarray(x, float)
    dx = np.diff(places)
    if not (len(dx) > 1 and np.all(dx > 0)):
        raise ValueError(f"abscissae of a polygon must be three or more and increase; steps are {dx}")
    line = y_a + (y_b - y_a) * (places - places[0]) / (places[-1] - places[0])
    first_guess = line if guess is None else np.asarray(guess, float)
    if first_guess.shape != places.shape:
        raise ValueError(f"guess of a polygon has shape {first_guess.shape}, and {places.shape} is needed")
    inner = ca.MX.sym("y", len(dx) - 1)
    left, right, piece = ca.SX.sym("l"), ca.SX.sym("r"), ca.SX.sym("dx")
    # the first piece stands apart: a cost may be smooth inside and not in a fixed end
    first = ca.Function("first", [right], [cost(dx[0], y_a, right)])
    each = ca.Function("piece", [piece, left, right], [cost(piece, left, right)])
    others = each.map(len(dx) - 1)(dx[None, 1:], inner.T, ca.horzcat(inner[1:].T, y_b))
    total = first(inner[0]) + ca.sum2(others)
    options: dict[str, Any] = {
        "print_time": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": 1e-11,
        "show_eval_warnings": False,
    }
    programme: Any = {"x": inner, "f": total}
    solver = ca.nlpsol("polygon", "ipopt", programme, options)
    run = solver(x0=first_guess[1:-1])
    if solver.stats()["return_status"] != "Solve_Succeeded":
        slope = ca.Function("slope", [inner], [ca.gradient(total, inner)])(run["x"]).full().ravel()
        worst = int(np.argmax(np.abs(slope)))
        raise ConvergenceError(
            f"best polygon: IPOPT says {solver.stats()['return_status']}; the largest derivative of the cost "
            f"is that of corner {worst + 1}, {slope[worst]:.3g}"
        )
    return np.concatenate(([y_a], run["x"].full().ravel(), [y_b])), float(run["f"])
