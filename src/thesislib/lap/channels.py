"""What the pictures read from a lap, and the channels derived from it.

A lap is anything that has the members of :class:`Lap`; the pictures need no solver to be drawn.
Derived channels live here rather than inside a plot, so that a chapter records the very numbers
that it shows.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

WHEEL_NAMES = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}


class Track(Protocol):
    """A closed centre line in SAE ground axes: x east, y south, headings clockwise."""

    @property
    def length(self) -> float:
        """Length of the lap in m."""

    def position(self, s: ArrayLike, /) -> tuple[Array, Array]:
        """Coordinates x (east) and y (south) in m at the distances `s` in m."""

    def heading(self, s: ArrayLike, /) -> Array:
        """Angle in rad from x, clockwise seen from above, at the distances `s` in m."""


class Lap(Protocol):
    """A solved lap, sampled at its N collocation points."""

    @property
    def track(self) -> Track:
        """The centre line that was driven."""

    @property
    def time(self) -> float:
        """Lap time in s."""

    @property
    def s(self) -> Array:
        """Distance (N,) of the collocation points in m, from the start line."""

    @property
    def t(self) -> Array:
        """Elapsed time (N,) in s."""

    @property
    def mesh_points(self) -> Array:
        """Distance (K + 1,) in m of the ends of the K mesh intervals."""

    def __getitem__(self, name: str, /) -> Array:
        """The channel (N,) of that name in SI units."""

    def activity(self, name: str, /) -> NDArray[np.bool_]:
        """Where (N,) the constraint of that name is active."""


def along_lap(lap: Lap, values: ArrayLike, distance: ArrayLike) -> Array:
    """Values of a channel at other distances, linear between collocation points and periodic.

    Parameters
    ----------
    values : array_like (N,)
        The channel at ``lap.s``.
    distance : array_like (M,)
        Distances in m.

    Returns
    -------
    ndarray (M,)
    """
    samples = np.asarray(values, dtype=float)
    return np.interp(np.asarray(distance, dtype=float), lap.s, samples, period=lap.track.length)


def whole_lap(lap: Lap, values: ArrayLike) -> tuple[Array, Array]:
    """Distance and channel from the start line to the start line, both ends included.

    The collocation points leave out one end of the lap at least; without the ends a curve would stop
    short of the frame.

    Returns
    -------
    s, values : ndarray
    """
    inside = lap.s[(lap.s > 0.0) & (lap.s < lap.track.length)]
    s = np.concatenate(([0.0], inside, [lap.track.length]))
    return s, along_lap(lap, values, s)


def beside(track: Track, s: ArrayLike, n: ArrayLike) -> tuple[Array, Array]:
    """Ground coordinates of points at the lateral distance n, positive to the right (4.5).

    Parameters
    ----------
    s : array_like (M,)
        Distance along the centre line in m.
    n : array_like (M,) or float
        Lateral distance in m.

    Returns
    -------
    x, y : ndarray (M,)
        East and south coordinates in m.
    """
    along = np.asarray(s, dtype=float)
    lateral = np.asarray(n, dtype=float)
    x, y = track.position(along)
    theta = track.heading(along)
    return x - lateral * np.sin(theta), y + lateral * np.cos(theta)


def speed(lap: Lap) -> Array:
    """Speed (N,) of the mass centre in m/s."""
    return np.hypot(lap["u"], lap["v"])


def steer_rate(lap: Lap) -> Array:
    """Rate of the steering angle (N,) in rad/s, by differences over elapsed time around the lap."""
    delta = np.concatenate(([lap["delta"][-1]], lap["delta"], [lap["delta"][0]]))
    t = np.concatenate(([lap.t[-1] - lap.time], lap.t, [lap.t[0] + lap.time]))
    return np.asarray(np.gradient(delta, t)[1:-1])


def time_shares(lap: Lap) -> Array:
    """Part (N,) of the lap time in s for which each collocation point stands, half-way to its neighbours."""
    edges = np.concatenate(([0.0], 0.5 * (lap.t[1:] + lap.t[:-1]), [lap.time]))
    return np.diff(edges)


def brake_share(lap: Lap, *, least_force_N: float = 1000.0) -> Array:
    """Front axle's share (N,) of the braking force, NaN where the car hardly brakes.

    An axle brakes with the negative part of the sum of its longitudinal tyre forces, so that the share
    lies in 0 .. 1 and is 1 where the front brakes against a driving rear.

    Parameters
    ----------
    least_force_N : float
        Braking force of both axles, in N, below which the share means nothing and is NaN.
    """
    front = np.maximum(-(lap["F_flx"] + lap["F_frx"]), 0.0)
    rear = np.maximum(-(lap["F_rlx"] + lap["F_rrx"]), 0.0)
    total = front + rear
    braking = total >= least_force_N
    return np.where(braking, front / np.where(braking, total, 1.0), np.nan)


def active_spans(lap: Lap, active: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Stretches ``(start, length)`` in m along which a constraint is active.

    Each collocation point stands for the stretch half-way to its neighbours; a stretch across the
    start line comes in two parts.

    Parameters
    ----------
    active : ndarray of bool (N,)
    """
    edges = np.concatenate(([0.0], 0.5 * (lap.s[1:] + lap.s[:-1]), [lap.track.length]))
    changes = np.diff(np.concatenate(([False], active, [False])).astype(int))
    starts, ends = edges[np.flatnonzero(changes == 1)], edges[np.flatnonzero(changes == -1)]
    return [(float(start), float(end - start)) for start, end in zip(starts, ends, strict=True)]
