"""The centre line of a closed road in the plane.

A centre line is a table of curvature over distance together with its interpolant, the periodic cubic
spline: the same stations joined in another way do not close. Heading and position follow by integration
from one pose.

SAE ground axes: x east, y south, z down; heading clockwise from +x seen from above; curvature positive in a
right-hand turn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline, make_interp_spline

Array = NDArray[np.float64]

# Eight Gauss points integrate cos and sin of the quartic heading over one station spacing to rounding
# error: the heading changes there by a fraction of a radian.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Closure:
    """How far the end of one lap is from its start.

    Attributes
    ----------
    distance : float
        Distance between the two points, m.
    heading : float
        Change of heading beyond whole turns, rad.
    turns : int
        Whole turns of the heading, +1 for a road driven clockwise.
    """

    distance: float
    heading: float
    turns: int


@dataclass(frozen=True, eq=False)
class CentreLine:
    """A closed centre line.

    Attributes
    ----------
    name : str
        Name of the road.
    s : numpy.ndarray, shape (N,)
        Stations in m, increasing, the first at 0 and the last below ``length``.
    station_curvature : numpy.ndarray, shape (N,)
        Curvature at the stations, 1/m.
    length : float
        Period of the road, m.
    start : tuple of float
        Position x, y in m and heading in rad at s = 0.
    station_width_right, station_width_left : numpy.ndarray, shape (N,)
        Half-widths at the stations, m.
    attributes : mapping of str to str
        What the file says of itself: source, licence and so on.
    """

    name: str
    s: Array
    station_curvature: Array
    length: float
    start: tuple[float, float, float]
    station_width_right: Array
    station_width_left: Array
    attributes: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def _spline(self) -> BSpline:
        stations = np.append(self.s, self.length)
        values = np.append(self.station_curvature, self.station_curvature[0])
        return make_interp_spline(stations, values, k=3, bc_type="periodic")

    @cached_property
    def _turning(self) -> Any:
        return self._spline.antiderivative()

    @cached_property
    def _station_positions(self) -> tuple[Array, Array]:
        """Positions at the stations and, as last entry, after one lap."""
        ends = np.append(self.s, self.length)
        dx, dy = self._displacement(ends[:-1], ends[1:])
        return (
            self.start[0] + np.concatenate([[0.0], np.cumsum(dx)]),
            self.start[1] + np.concatenate([[0.0], np.cumsum(dy)]),
        )

    def _displacement(self, begin: Array, end: Array) -> tuple[Array, Array]:
        """Integrate the tangent from ``begin`` to ``end``, both within one lap and one station spacing."""
        half = (end - begin) / 2
        points = begin[..., None] + half[..., None] * (1 + _NODES)
        heading = self.start[2] + self._turning(points) - self._turning(0.0)
        return half * (np.cos(heading) @ _WEIGHTS), half * (np.sin(heading) @ _WEIGHTS)

    def curvature(self, s: ArrayLike) -> Array:
        """Return the curvature in 1/m at ``s`` in m, any shape, repeating with the lap."""
        return np.asarray(self._spline(np.mod(s, self.length)))

    def curvature_rate(self, s: ArrayLike) -> Array:
        """Return the derivative of the curvature in 1/m² at ``s`` in m, any shape."""
        return np.asarray(self._spline(np.mod(s, self.length), 1))

    def curvature_function(self) -> casadi.Function:
        """Return the curvature as a casadi function s -> C, equal to `curvature` to rounding error.

        It is the same B-spline. It accepts numbers and MX expressions; casadi has no spline in SX, so an
        SX model takes the curvature as an input.
        """
        spline = self._spline
        inside = casadi.Function.bspline("spline", [spline.t.tolist()], spline.c.tolist(), [spline.k], 1)
        s = casadi.MX.sym("s")
        wrapped = s - self.length * casadi.floor(s / self.length)
        return casadi.Function("curvature", [s], [inside(wrapped)], ["s"], ["C"])

    def heading(self, s: ArrayLike) -> Array:
        """Return the heading in rad at ``s`` in m, any shape; it grows by the road's turns every lap."""
        laps, within = np.divmod(np.asarray(s, dtype=float), self.length)
        start = self._turning(0.0)
        per_lap = self._turning(self.length) - start
        return np.asarray(self.start[2] + self._turning(within) - start + laps * per_lap)

    def position(self, s: ArrayLike) -> tuple[Array, Array]:
        """Return x (east) and y (south) in m at ``s`` in m, any shape, repeating with the lap."""
        within = np.mod(np.asarray(s, dtype=float), self.length)
        station = np.searchsorted(self.s, within, side="right") - 1
        dx, dy = self._displacement(self.s[station], within)
        x, y = self._station_positions
        return x[station] + dx, y[station] + dy

    def widths(self, s: ArrayLike) -> tuple[Array, Array]:
        """Return the half-widths to the right and to the left in m at ``s`` in m, linear between stations."""
        within = np.mod(np.asarray(s, dtype=float), self.length)
        stations = np.append(self.s, self.length)
        right = np.append(self.station_width_right, self.station_width_right[0])
        left = np.append(self.station_width_left, self.station_width_left[0])
        return np.interp(within, stations, right), np.interp(within, stations, left)

    def end(self) -> tuple[float, float]:
        """Return x and y in m after one lap; the start again, but for the gap of `closure`."""
        x, y = self._station_positions
        return float(x[-1]), float(y[-1])

    def closure(self) -> Closure:
        """Return how well the curvature table closes on itself after one lap."""
        x_end, y_end = self.end()
        turned = float(self._turning(self.length) - self._turning(0.0))
        turns = round(turned / (2 * np.pi))
        return Closure(
            float(np.hypot(x_end - self.start[0], y_end - self.start[1])),
            turned - 2 * np.pi * turns,
            turns,
        )
