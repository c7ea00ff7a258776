"""Two laps of one road, place by place: what differs, who is ahead, and where that was gained.

Laps that are compared seldom have the same mesh; each is interpolated to common distances.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicHermiteSpline

from .channels import Array, Lap, active_spans, along_lap, whole_lap

SAME_LENGTH: Final = 1e-9
"""Relative difference of two roads' lengths below which the roads count as one."""


def common_points(lap: Lap, reference: Lap) -> Array:
    """Collocation points (M,) of both laps in m, in order, with both ends of the lap.

    Raises
    ------
    ValueError
        If the laps are of roads of different lengths.
    """
    _refuse_other_roads(lap, reference)
    return np.unique(np.concatenate(([0.0], lap.s, reference.s, [reference.track.length])))


def elapsed_time(lap: Lap, distance: ArrayLike) -> Array:
    """Time in s since the start line was crossed.

    Between collocation points it is the cubic that has their times and, as slopes, their slownesses (4.4):
    on an interval of h metres it errs by h⁴/384 of the slowness's third derivative at most.

    Parameters
    ----------
    lap : Lap
        Its channel ``"slowness"`` in s/m is read.
    distance : array_like (M,)
        Distances in m, from the start line, 0, to its next crossing, the length of the road.

    Returns
    -------
    ndarray (M,)

    Raises
    ------
    ValueError
        If a distance lies outside the lap.
    """
    places = np.asarray(distance, dtype=float)
    length = lap.track.length
    outside = places[~((places >= 0.0) & (places <= length))]
    if outside.size:
        raise ValueError(f"the distance {outside.flat[0]:g} m lies outside the lap of 0 .. {length:g} m")
    s, slowness = whole_lap(lap, lap["slowness"])
    inside = (lap.s > 0.0) & (lap.s < length)
    t = np.concatenate(([0.0], lap.t[inside], [lap.time]))
    return np.asarray(CubicHermiteSpline(s, t, slowness)(places))


def time_gained(lap: Lap, reference: Lap, distance: ArrayLike) -> Array:
    """Time in s by which `lap` is ahead of `reference`; at the end, the difference of the lap times.

    Parameters
    ----------
    lap, reference : Lap
    distance : array_like (M,)
        Distances in m.

    Returns
    -------
    ndarray (M,)
        Positive where `lap` has passed earlier.

    Raises
    ------
    ValueError
        As `common_points` and `elapsed_time`.
    """
    _refuse_other_roads(lap, reference)
    return elapsed_time(reference, distance) - elapsed_time(lap, distance)


def difference(lap: Lap, reference: Lap, quantity: Callable[[Lap], ArrayLike], distance: ArrayLike) -> Array:
    """A quantity of `lap` less that of `reference`, in the quantity's own unit.

    Parameters
    ----------
    lap, reference : Lap
    quantity : callable
        Lap to values (N,) at its collocation points, such as `channels.speed`.
    distance : array_like (M,)
        Distances in m; the values are linear between collocation points and periodic.

    Returns
    -------
    ndarray (M,)

    Raises
    ------
    ValueError
        As `common_points`.
    """
    _refuse_other_roads(lap, reference)
    return along_lap(lap, quantity(lap), distance) - along_lap(reference, quantity(reference), distance)


def time_gained_where(lap: Lap, reference: Lap, active: NDArray[np.bool_]) -> float:
    """Time in s that `lap` gains on `reference` along a part of the road.

    Parameters
    ----------
    lap, reference : Lap
    active : ndarray of bool (N,)
        The part, at the collocation points of `reference`; each stands for the stretch half-way to its
        neighbours.

    Returns
    -------
    float
        Positive where `lap` is the faster; over parts that make up the lap, the gains add up to the
        difference of the lap times.

    Raises
    ------
    ValueError
        As `common_points`.
    """
    spans = np.array(active_spans(reference, active)).reshape(-1, 2)
    # a sum of starts and lengths may end a rounding error beyond the lap
    ends = np.minimum(spans.sum(axis=1), reference.track.length)
    return float(np.sum(np.diff(time_gained(lap, reference, np.column_stack((spans[:, 0], ends))))))


def phases(lap: Lap) -> dict[str, NDArray[np.bool_]]:
    """Where (N,) the car slows down, where the tyres and where the engine limits its gain of speed.

    Returns
    -------
    dict
        ``"slowing"``: the speed of the mass centre falls. ``"power"``: it does not, and the engine gives
        all it has. ``"traction"``: it does not, and the engine has more to give: the way through and out of
        a corner. Each collocation point is in exactly one of them.
    """
    slowing = lap["u"] * lap["a_x"] + lap["v"] * lap["a_y"] < 0.0
    power = ~slowing & lap.activity("power")
    return {"slowing": slowing, "traction": ~slowing & ~power, "power": power}


def _refuse_other_roads(lap: Lap, reference: Lap) -> None:
    """Raise `ValueError` for laps of roads of different lengths."""
    length, other = lap.track.length, reference.track.length
    if not math.isclose(length, other, rel_tol=SAME_LENGTH):
        raise ValueError(
            f"a lap of {length:.3f} m and one of {other:.3f} m are of different roads; "
            "only laps of one road can be compared place by place"
        )
