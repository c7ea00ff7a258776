"""A nonlinear programme (2.20), its automatic derivatives, and its KKT conditions (2.22)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Array", "NotConvergedError", "Optimum", "Programme", "column"]

Array = NDArray[np.float64]

_CONDITIONS = {
    "stationarity": "stationarity (2.22a), component",
    "equalities": "equality (2.22b)",
    "inequalities": "inequality (2.22c)",
    "signs": "sign of the multiplier (2.22d)",
    "complementarity": "complementarity (2.22e)",
}


class NotConvergedError(RuntimeError):
    """An iteration that stopped before its conditions held; the message names the worst of them."""


def column(values: Any) -> Array:
    """Return what CasADi or a user gives as a vector of doubles, shape (n,)."""
    return np.array(values, dtype=np.float64).ravel()


@dataclass(frozen=True)
class Programme:
    """Minimise f(x) subject to g(x) = 0 and h(x) <= 0 (2.20).

    Parameters
    ----------
    objective : callable
        From a vector of CasADi symbols to the expression of f.
    size : int
        Number n of variables.
    equalities, inequalities : callable, optional
        From the same vector to a list of the expressions of g and of h.
    name : str
        What error messages call it.

    Raises
    ------
    ValueError
        If there is no variable.
    """

    objective: Callable[[Any], Any]
    size: int
    equalities: Callable[[Any], Sequence[Any]] = field(default=lambda x: ())
    inequalities: Callable[[Any], Sequence[Any]] = field(default=lambda x: ())
    name: str = "programme"

    def __post_init__(self) -> None:
        if self.size < 1:
            raise ValueError(f"{self.name}: size = {self.size}, but a programme has at least one variable")

    @cached_property
    def expressions(self) -> dict[str, ca.SX]:
        """The symbols x and the expressions f, g, h in them, as :func:`casadi.nlpsol` could take them."""
        x = ca.SX.sym("x", self.size)
        g, h = (ca.vertcat(ca.SX(0, 1), *rows(x)) for rows in (self.equalities, self.inequalities))
        return {"x": x, "f": ca.SX(self.objective(x)), "g": g, "h": h}

    @cached_property
    def _functions(self) -> dict[str, ca.Function]:
        x, f, g, h = (self.expressions[key] for key in "xfgh")
        lam, mu = ca.SX.sym("lambda", g.numel()), ca.SX.sym("mu", h.numel())
        lagrangian = f + ca.dot(lam, g) + ca.dot(mu, h)  # (2.21)
        gradient = ca.gradient(f, x)
        curvature = ca.hessian(lagrangian, x)[0]
        return {
            "value": ca.Function("f", [x], [f]),
            "gradient": ca.Function("df", [x], [gradient]),
            "constraints": ca.Function("c", [x], [g, h]),
            "first": ca.Function("first", [x], [gradient, g, ca.jacobian(g, x), h, ca.jacobian(h, x)]),
            "hessian": ca.Function("ddL", [x, lam, mu], [curvature]),
        }

    @property
    def equality_count(self) -> int:
        """Number of rows of g."""
        return int(self.expressions["g"].numel())

    @property
    def inequality_count(self) -> int:
        """Number of rows of h."""
        return int(self.expressions["h"].numel())

    def start(self, x: ArrayLike) -> Array:
        """Return a starting point as an array, shape (n,).

        Raises
        ------
        ValueError
            If it has not n finite components, or f, g or h is not finite there.
        """
        point = column(x)
        if point.size != self.size or not np.all(np.isfinite(point)):
            raise ValueError(f"{self.name}: the start {point} has to have {self.size} finite components")
        rows = (np.array([self.value(point)]), *self.constraints(point))
        for letter, values in zip("fgh", rows, strict=True):
            if not np.all(np.isfinite(values)):
                raise ValueError(
                    f"{self.name}: {letter} is {values} at the start {point}; it has to be finite"
                )
        return point

    def value(self, x: Array) -> float:
        """Return f(x)."""
        return float(self._functions["value"](x))

    def gradient(self, x: Array) -> Array:
        """Return the gradient of f (2.4), shape (n,)."""
        return column(self._functions["gradient"](x))

    def constraints(self, x: Array) -> tuple[Array, Array]:
        """Return g(x) and h(x), shapes (n_g,) and (n_h,)."""
        g, h = self._functions["constraints"](x)
        return column(g), column(h)

    def first_order(self, x: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return the gradient of f, then g with its gradients, then h with its gradients.

        Gradients are the columns, as in the thesis: shapes (n,), (n_g,), (n, n_g), (n_h,), (n, n_h).
        """
        df, g, dg, h, dh = self._functions["first"](x)
        return column(df), column(g), np.array(dg.full()).T, column(h), np.array(dh.full()).T

    def hessian(self, x: Array, lam: ArrayLike = (), mu: ArrayLike = ()) -> Array:
        """Return the Hessian of the Lagrangian (2.21) in x, shape (n, n); of f if there is no constraint."""
        return np.array(self._functions["hessian"](x, column(lam), column(mu)).full())

    def kkt_residuals(self, x: Array, lam: Array, mu: Array) -> dict[str, Array]:
        """Return by how much each of the conditions (2.22a) to (2.22e) is violated at a point.

        Parameters
        ----------
        x, lam, mu : numpy.ndarray, shapes (n,), (n_g,), (n_h,)
            Point and multipliers.

        Returns
        -------
        dict of str to numpy.ndarray
            Magnitudes by condition. (2.22e) is split into its rows, which have one sign.
        """
        df, g, dg, h, dh = self.first_order(x)
        return {
            "stationarity": np.abs(df + dg @ lam + dh @ mu),
            "equalities": np.abs(g),
            "inequalities": np.maximum(h, 0.0),
            "signs": np.maximum(-mu, 0.0),
            "complementarity": np.abs(mu * h),
        }

    def kkt_residual(self, x: Array, lam: Array, mu: Array) -> float:
        """Return the largest violation of the conditions (2.22) at a point."""
        rows = self.kkt_residuals(x, lam, mu).values()
        return float(np.max(np.concatenate(list(rows))))

    def not_converged(
        self, x: Array, lam: Array, mu: Array, tolerance: float, what: str
    ) -> NotConvergedError:
        """Return the error that names the most violated condition of (2.22) at the point reached.

        Multipliers grow without bound where constraints contradict each other, and with them (2.22a) and
        (2.22e): for the comparison these two are divided by the largest multiplier if that is above one.
        """
        rows = {name: row for name, row in self.kkt_residuals(x, lam, mu).items() if row.size}
        size = np.max(np.abs(np.concatenate((lam, mu))), initial=1.0)
        weights = {"stationarity": 1.0 / size, "complementarity": 1.0 / size}
        weighed = {
            name: np.nan_to_num(weights.get(name, 1.0) * row, nan=np.inf) for name, row in rows.items()
        }
        worst = max(weighed, key=lambda name: float(weighed[name].max()))
        row = int(np.argmax(weighed[worst]))
        return NotConvergedError(
            f"{self.name}: {what}; the most violated condition is {_CONDITIONS[worst]} {row + 1}, "
            f"by {rows[worst][row]:.2g} where {tolerance:.1g} is allowed"
        )


@dataclass(frozen=True)
class Optimum:
    """A point that satisfies the KKT conditions, and the way there.

    Attributes
    ----------
    x, lam, mu : numpy.ndarray, shapes (n,), (n_g,), (n_h,)
        Point and multipliers of (2.21).
    points : numpy.ndarray, shape (K + 1, n)
        The iterates, from the start to `x`.
    residuals : numpy.ndarray, shape (K + 1,)
        Largest violation of (2.22) at each of them, each with its own multipliers.
    """

    x: Array
    lam: Array
    mu: Array
    points: Array
    residuals: Array

    @property
    def iterations(self) -> int:
        """Number K of iterations."""
        return len(self.points) - 1
