"""The phase plane: saddles, their stable manifolds, and the true region of attraction between them.

The region of attraction of the trim is bounded by the stable manifolds of the two saddles beside it. Each is
traced backwards in time from its saddle. The strip between them has no end, so that its area, and the part
of it that an estimate covers, need a window.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from thesislib.stability.bicycle import Bicycle

Points = NDArray[np.float64]

_OFFSET = (
    1e-6  # of a manifold's first point from its saddle, in slip coordinates: its curvature enters squared
)
_BETWEEN = 30  # points of a manifold for each step of the integrator
_LOST = 3.0  # rad: a motion that has reached this slip is not followed further
_FAR = 1.6  # rad: a manifold is followed until a slip is this large


@dataclass(frozen=True)
class Window:
    """A convex part of the plane: all x with normals @ x <= limits.

    Attributes
    ----------
    name : str
        How the window is written on a page.
    normals : array, shape (n, 2)
    limits : array, shape (n,)
    """

    name: str
    normals: Points
    limits: Points

    def clip(self, polygon: Points) -> Points:
        """Return the part of a polygon inside the window (Sutherland and Hodgman)."""
        for normal, limit in zip(self.normals, self.limits, strict=True):
            if len(polygon) == 0:
                return polygon
            excess = polygon @ normal - limit
            before, previous = np.roll(excess, 1), np.roll(polygon, 1, axis=0)
            crosses, kept = (before <= 0) != (excess <= 0), excess <= 0
            share = np.where(crosses, before, 0.0) / np.where(crosses, before - excess, 1.0)
            crossing = previous + share[:, None] * (polygon - previous)
            # on each side of the polygon, first where it crosses the line, then its end
            both = np.stack([crossing, polygon], axis=1).reshape(-1, 2)
            polygon = both[np.column_stack([crosses, kept]).reshape(-1)]
        return polygon

    def area(self, polygon: Points) -> float:
        """Return the area of a polygon's part inside the window, in (m/s)(rad/s) for states."""
        return polygon_area(self.clip(polygon))

    def contains(self, points: Points) -> NDArray[np.bool_]:
        """Return which points, shape (n, 2), are inside."""
        return np.asarray((points @ self.normals.T <= self.limits).all(axis=-1))


def polygon_area(polygon: Points) -> float:
    """Return the area inside a closed polygon, shape (n, 2)."""
    if len(polygon) < 3:
        return 0.0
    x, y = (polygon - polygon.mean(axis=0)).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


@dataclass(frozen=True)
class TrueRegion:
    """The region of attraction of a car's trim, as simulation draws it.

    Attributes
    ----------
    car : Bicycle
    trim : array, shape (2,)
        The stable equilibrium (v, omega).
    saddles : array, shape (2, 2)
        The two equilibria beside it, by their v.
    manifolds : tuple of two arrays, shape (n, 2)
        Their stable manifolds, from end to end.
    boundary : array, shape (n, 2)
        Both joined to a closed polygon.
    """

    car: Bicycle
    trim: Points
    saddles: Points
    manifolds: tuple[Points, Points]
    boundary: Points

    def speed_window(self, factor: float = 1.0) -> Window:
        """Return the strip of lateral speeds between the saddles, or `factor` times as wide."""
        low, high = self.saddles[:, 0]
        middle, half = (low + high) / 2, factor * (high - low) / 2
        name = "|v| <= |v_saddle|" if factor == 1.0 else f"|v| <= {factor:g} |v_saddle|"
        return Window(name, np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([middle + half, half - middle]))

    def slip_window(self, reach: float = 0.35) -> Window:
        """Return the parallelogram of slips up to `reach`, rad."""
        rows = self.car.matrix
        steer = np.array([self.car.delta, 0.0])
        return Window(
            f"|alpha| <= {reach:g} rad",
            np.concatenate([rows, -rows]),
            np.concatenate([reach + steer, reach - steer]),
        )

    def largest_level(self, shape: Callable[[Points], Points]) -> float:
        """Return the smallest value of a shape function on the manifolds: no beta can exceed it.

        Parameters
        ----------
        shape : callable
            s(x - trim) of states (n, 2).
        """
        levels = []
        for manifold in self.manifolds:
            level = shape(manifold - self.trim)
            i = int(np.clip(np.argmin(level), 1, len(level) - 2))
            below, here, above = level[i - 1 : i + 2]
            bend = below - 2 * here + above
            # the lowest point of the parabola through the three lowest samples, if it lies between them
            inner = bend > 0 and abs(above - below) <= 2 * bend
            levels.append(here - (above - below) ** 2 / (8 * bend) if inner else min(below, here, above))
        return float(min(levels))


def true_region(car: Bicycle) -> TrueRegion:
    """Return the true region of attraction of a car's trim.

    Raises
    ------
    ValueError
        If there is no stable trim, or not one saddle on either side of it: what then bounds the region
        is not a pair of stable manifolds.
    """
    trim = car.trim()
    saddles = [x for x in car.equilibria() if np.linalg.det(car.jacobian(x)) < 0]
    left = [x for x in saddles if x[0] < trim[0]]
    right = [x for x in saddles if x[0] > trim[0]]
    if not left or not right:
        raise ValueError(
            f"At u_0 = {car.u_0:g} m/s and delta = {np.degrees(car.delta):g}° the car has a saddle on "
            f"{'one side' if left or right else 'neither side'} of its trim only; the true region "
            "is drawn between two."
        )
    pair = np.array([left[-1], right[0]])
    first, second = (stable_manifold(car, saddle) for saddle in pair)
    # joined the wrong way round, the polygon crosses itself and its two halves cancel
    joined = max((np.concatenate([first, end]) for end in (second, second[::-1])), key=polygon_area)
    return TrueRegion(car, trim, pair, (first, second), joined)


def stable_manifold(car: Bicycle, saddle: Points) -> Points:
    """Return the stable manifold of a saddle, traced backwards both ways, shape (n, 2).

    Its points are thirty to a step of the integrator.
    """
    values, vectors = np.linalg.eig(car.jacobian(saddle))
    direction = car.to_slip(vectors[:, np.argmin(values.real)].real)
    direction = direction / np.linalg.norm(direction)

    def backwards(_: float, xi: Points) -> Points:
        return np.asarray(-car.to_slip(car.rates(car.from_slip(xi))))

    def far(_: float, xi: Points) -> float:
        return float(np.abs(xi).max() - _FAR)

    far.terminal = True  # type: ignore[attr-defined]
    branches = []
    for sign in (1.0, -1.0):
        start = car.to_slip(saddle) + sign * _OFFSET * direction
        traced = solve_ivp(
            backwards, (0.0, 200.0), start, "DOP853", rtol=1e-10, atol=1e-12, events=far, dense_output=True
        )
        # where the motion creeps away from the saddle, points would crowd
        steps = np.arange(_BETWEEN * (len(traced.t) - 1) + 1) / _BETWEEN
        points = traced.sol(np.interp(steps, np.arange(len(traced.t)), traced.t)).T
        branches.append(points[np.abs(points - car.to_slip(saddle)).max(axis=-1) > 1e-4])
    return np.asarray(car.from_slip(np.concatenate([branches[1][::-1], branches[0]])))


class LateralMotion(Protocol):
    """What is asked of a car to follow its motions."""

    def trim(self) -> Points:
        """Return the equilibrium (v, omega)."""

    def rates(self, x: Any) -> Any:
        """Return d(v, omega)/dt of states (..., 2)."""

    def to_slip(self, x: Any) -> Any:
        """Return slip coordinates of states (..., 2)."""


def escapes(car: LateralMotion, starts: Points, *, time: float = 20.0, step: float = 0.01) -> int:
    """Return how many motions from `starts` do not come within 0.01 rad of slip of the trim.

    Parameters
    ----------
    car, starts, time, step
        As of `returns`.
    """
    return int(np.count_nonzero(~returns(car, starts, time=time, step=step)))


def returns(
    car: LateralMotion, starts: Points, *, time: float = 20.0, step: float = 0.01, arrival: float = 0.01
) -> NDArray[np.bool_]:
    """Return which motions from `starts` come back to the trim, shape (n,).

    All at once, by the classical Runge-Kutta method; what has arrived is not followed further, nor what has
    reached a slip coordinate of 3 (72°).

    Parameters
    ----------
    car : LateralMotion
    starts : array, shape (n, 2)
        States (v, omega).
    time, step : float
        Longest motion and length of a step, s.
    arrival : float
        A motion has come back within this distance of the trim, rad of slip.
    """
    x, trim = np.array(starts, dtype=float), car.trim()
    back, moving = np.zeros(len(x), bool), np.arange(len(x))
    for _ in range(round(time / step)):
        k_1 = car.rates(x)
        k_2 = car.rates(x + step / 2 * k_1)
        k_3 = car.rates(x + step / 2 * k_2)
        k_4 = car.rates(x + step * k_3)
        x = x + step / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)
        away = np.abs(car.to_slip(x - trim)).max(axis=-1)
        back[moving[away < arrival]] = True
        followed = (away >= arrival) & (away < _LOST)
        x, moving = x[followed], moving[followed]
        if len(x) == 0:
            break
    return back
