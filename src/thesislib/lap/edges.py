"""Where the wheels are on the road, and the edges that they must keep to.

The thesis keeps the mass centre within a constant distance of the centre line and calls the wheels within a
road of variable width an easy addition (section 4.4). A point of the car that lies X before and Y beside the
foot of the mass centre on the centre line, in the road's axes, is at the lateral distance

    n = (1 - sqrt((1 - C Y)^2 + (C X)^2)) / C

if the curvature C is constant from the one foot to the other: the distance from a circle. The usual form
n = Y leaves out C X^2/2, which is a decimetre in a hairpin.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thesislib.lap.channels import beside
from thesislib.roads import CentreLine
from thesislib.vehicles.elementary import elementary
from thesislib.vehicles.racing_car import WHEELS

Array = NDArray[np.float64]

Edges = Literal["centre", "wheels"]
"""What has to stay on the road: the mass centre, within a constant width, or all four wheels."""

_STEPS = 30
_FOUND_M = 1e-9


def contact_points(values: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Return x forward and y right of the four contact centres from the mass centre, in m.

    Parameters
    ----------
    values : mapping
        Numbers of the car: ``a``, ``wheelbase``, ``w_f``, ``w_r`` in m; floats or casadi expressions.
    """
    places = {}
    for wheel in WHEELS:
        side = 1.0 if wheel[1] == "r" else -1.0
        if wheel[0] == "f":
            places[wheel] = values["a"], side * values["w_f"]
        else:
            places[wheel] = values["a"] - values["wheelbase"], side * values["w_r"]
    return places


def in_road_axes(n: Any, xi: Any, point: tuple[Any, Any]) -> tuple[Any, Any]:
    """Return how far a point of the car lies before and beside the foot of the mass centre, in m.

    Parameters
    ----------
    n : float, numpy.ndarray or casadi expression
        Lateral distance of the mass centre, m.
    xi
        Angle from the road's direction to the car's, rad.
    point : pair
        x forward and y right from the mass centre, m.
    """
    x, y = point
    xp = elementary(n, xi, x, y)
    return x * xp.cos(xi) - y * xp.sin(xi), n + x * xp.sin(xi) + y * xp.cos(xi)


def lateral_distance(n: Any, xi: Any, curvature: Any, point: tuple[Any, Any]) -> Any:
    """Return the lateral distance of a point of the car from the centre line, in m, positive to the right.

    Exact where the curvature does not change between the feet of mass centre and point.

    Parameters
    ----------
    n, xi, point
        As of `in_road_axes`.
    curvature : float, numpy.ndarray or casadi expression
        Of the centre line at the foot of the mass centre, 1/m.
    """
    ahead, beside = in_road_axes(n, xi, point)
    xp = elementary(curvature, ahead, beside)
    from_centre = xp.sqrt((1 - curvature * beside) ** 2 + (curvature * ahead) ** 2)
    return (2 * beside - curvature * (ahead**2 + beside**2)) / (1 + from_centre)


def edge_data(track: CentreLine, values: Mapping[str, float]) -> dict[str, Callable[[Array], Array]]:
    """Return the half-width beside each wheel as a function of the mass centre's distance along the road.

    It is the road's half-width where the axle is, its distance from the mass centre further on or back; the
    few decimetres by which a bend moves the foot of a wheel are left out, which data cannot follow.
    `wheels_on_road` tells what that comes to.

    Parameters
    ----------
    track : CentreLine
        The road.
    values : mapping
        Numbers of the car, see `contact_points`.

    Returns
    -------
    dict
        ``width_fl`` …: functions of s in m to half-widths in m.
    """

    def width(side: int, ahead: float) -> Callable[[Array], Array]:
        return lambda s: track.widths(np.asarray(s) + ahead)[side]

    return {
        f"width_{wheel}": width(0 if wheel[1] == "r" else 1, point[0])
        for wheel, point in contact_points(values).items()
    }


def widest(track: CentreLine) -> float:
    """Return the largest half-width of a road, m."""
    return float(max(track.station_width_right.max(), track.station_width_left.max()))


def refuse_narrow(track: CentreLine, values: Mapping[str, float], margin: float) -> None:
    """Refuse a road on which the wheels have no room.

    Parameters
    ----------
    track : CentreLine
        The road.
    values : mapping
        Numbers of the car, see `contact_points`.
    margin : float
        Room between a contact centre and the edge, m.

    Raises
    ------
    ValueError
        If the margin is below zero, or the road is somewhere no wider than the car and both margins.
    """
    if not margin >= 0.0:
        raise ValueError(f"wheel_margin_m = {margin:g} must be 0 or above.")
    width = track.station_width_right + track.station_width_left
    needed = 2.0 * (max(values["w_f"], values["w_r"]) + margin)
    narrowest = int(np.argmin(width))
    if not width[narrowest] > needed:
        raise ValueError(
            f"{track.name}: {width[narrowest]:g} m of road at s = {track.s[narrowest]:g} m are too narrow "
            f"for wheels that need {needed:g} m, margins of {margin:g} m included."
        )


def beyond_edge(
    n: Any, xi: Any, curvature: Any, values: Mapping[str, Any], widths: Mapping[str, Any]
) -> dict[str, Any]:
    """Return how far each contact centre lies beyond its edge of the road, in m: at most 0 on the road.

    Parameters
    ----------
    n, xi, curvature
        As of `lateral_distance`.
    values : mapping
        Numbers of the car, see `contact_points`.
    widths : mapping
        Values of the functions of `edge_data` there, m.

    Returns
    -------
    dict
        ``edge_fl`` …
    """
    found = {}
    for wheel, point in contact_points(values).items():
        side = 1 if wheel[1] == "r" else -1
        found[f"edge_{wheel}"] = side * lateral_distance(n, xi, curvature, point) - widths[f"width_{wheel}"]
    return found


def used_width(
    track: CentreLine, s: Array, n: Array, xi: Array, values: Mapping[str, float], margin: float
) -> dict[str, Array]:
    """Return which part of the half-width the outer wheel of each side uses: 1 at the edge.

    Parameters
    ----------
    track : CentreLine
        The road.
    s, n, xi : numpy.ndarray, shape (N,)
        Distance and lateral distance of the mass centre in m, and heading error in rad.
    values : mapping
        Numbers of the car, see `contact_points`.
    margin : float
        Room that is kept between a contact centre and the edge, m.

    Returns
    -------
    dict
        ``left`` and ``right``, shape (N,).
    """
    widths = {name: along(s) for name, along in edge_data(track, values).items()}
    beyond = beyond_edge(n, xi, track.curvature(s), values, widths)
    used = {wheel: 1.0 + (beyond[f"edge_{wheel}"] + margin) / widths[f"width_{wheel}"] for wheel in WHEELS}
    return {
        "left": np.maximum(used["fl"], used["rl"]),
        "right": np.maximum(used["fr"], used["rr"]),
    }


@dataclass(frozen=True)
class OnRoad:
    """Where a point of the car is on the road, in true geometry.

    Attributes
    ----------
    s : numpy.ndarray, shape (N,)
        Distance in m of the foot of its perpendicular on the centre line.
    lateral : numpy.ndarray, shape (N,)
        Its distance from there in m, positive to the right.
    room : numpy.ndarray, shape (N,)
        What is left of the road beyond it, m, to the right of a right wheel and to the left of a left one.
    """

    s: Array
    lateral: Array
    room: Array


def wheels_on_road(
    track: CentreLine, s: ArrayLike, n: ArrayLike, xi: ArrayLike, values: Mapping[str, float]
) -> dict[str, OnRoad]:
    """Return where the contact centres are, by their places on the ground rather than by a formula.

    The mass centre and the four points are placed on the map, and the foot of each is searched on the centre
    line itself.

    Parameters
    ----------
    track : CentreLine
        The road.
    s, n, xi : array_like, shape (N,)
        Distance and lateral distance of the mass centre in m, and angle from the road's to the car's
        direction in rad.
    values : mapping
        Numbers of the car, see `contact_points`.

    Returns
    -------
    dict of OnRoad
        By wheel: fl, fr, rl, rr.

    Raises
    ------
    ValueError
        If a point has no foot near its own place, because it is as far out as the centre of curvature.
    """
    along = np.asarray(s, dtype=float)
    x, y = beside(track, along, n)
    yaw = track.heading(along) + np.asarray(xi, dtype=float)
    found = {}
    for wheel, (ahead, right) in contact_points(values).items():
        wheel_x = x + ahead * np.cos(yaw) - right * np.sin(yaw)
        wheel_y = y + ahead * np.sin(yaw) + right * np.cos(yaw)
        foot, lateral = _foot(track, wheel_x, wheel_y, along + ahead)
        widths = track.widths(foot)
        room = widths[0] - lateral if wheel[1] == "r" else widths[1] + lateral
        found[wheel] = OnRoad(foot, lateral, room)
    return found


def _foot(track: CentreLine, x: Array, y: Array, near: Array) -> tuple[Array, Array]:
    """Return distance and lateral distance of points by Newton's method on their feet."""
    s, nearer = near, np.full(near.shape, True)
    for _ in range(_STEPS):
        at_x, at_y = track.position(s)
        theta = track.heading(s)
        along = (x - at_x) * np.cos(theta) + (y - at_y) * np.sin(theta)
        lateral = (y - at_y) * np.cos(theta) - (x - at_x) * np.sin(theta)
        stretch = 1.0 - track.curvature(s) * lateral
        nearer &= stretch > 0.0  # than the centre of curvature; from beyond it the far side is found
        step = along / stretch
        s = s + step
        if float(np.abs(step).max(initial=0.0)) < _FOUND_M:
            break
    lost = np.flatnonzero(~(nearer & (np.abs(step) < _FOUND_M)))
    if lost.size:
        at = lost[0]
        raise ValueError(
            f"{track.name}: a point at {lateral[at]:g} m from the centre line near s = {near[at]:g} m has no "
            "foot on it; it must be nearer to the line than the line's centre of curvature."
        )
    return s, lateral
