"""Smoother and rougher variants of a centre line, at a stated distance from it.

How much of the measured points' unevenness is road is a choice, and lap time depends on it: a smoother line
has milder corners. The smoother line minimises the integral of e^2 + w (dC/ds)^2 over its offset e from the
original, the criterion by which such lines are identified from measured points. The curvature is linearised
in e there, C + e'' + C^2 e, and exact in the line that is returned. A rougher line is offset to the other
side of the original in the same places.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.optimize import brentq

from thesislib.roads.centreline import Array, CentreLine

LARGEST_OFFSET_M = 1.0
_SAMPLES_PER_STATION = 8
_POLISH_STEPS = 4  # Newton steps; each squares a gap that is small already


def smoothed(road: CentreLine, rms_m: float) -> CentreLine:
    """Return a variant of ``road`` that lies ``rms_m`` away from it.

    The result has as many stations as ``road``, evenly spaced, the same interpolant, and closes to rounding
    error: the station curvatures get the smallest correction (in the sense of least squares) that makes the
    lap end where it starts. The edges of the road stay where they are, so the half-widths change by the
    offset and are negative where a strongly smoothed line runs beside the road.

    Parameters
    ----------
    road : CentreLine
        The original.
    rms_m : float
        Root mean square of the offset in m, at most 1; positive for a smoother line, negative for a rougher
        one, 0 for the original.

    Returns
    -------
    CentreLine
        With ``attributes["offset_rms_m"]``, the offset as measured on the finished line; see `offsets`.

    Raises
    ------
    ValueError
        If ``rms_m`` is not finite or beyond 1 m, where the line leaves the road in places.
    """
    if not abs(rms_m) <= LARGEST_OFFSET_M:
        raise ValueError(
            f"An offset of {rms_m} m rms is outside -{LARGEST_OFFSET_M:g} .. {LARGEST_OFFSET_M:g} m."
        )
    if rms_m == 0.0:
        return road

    side, kind = (1.0, "smoother") if rms_m > 0 else (-1.0, "rougher")

    def variant(log_weight: float) -> CentreLine:
        return _shifted(road, side * smoothing_offset(road, math.exp(log_weight)), kind)

    def excess(log_weight: float) -> float:
        return math.log(_rms(offsets(variant(log_weight), road)) / abs(rms_m))

    # m^4; on a circuit of 5 m stations these move the line by micrometres and by metres
    log_weight = brentq(excess, 0.0, math.log(1e8), xtol=1e-6)
    line = variant(log_weight)
    aside = offsets(line, road)
    right, left = road.widths(line.s * (road.length / line.length))
    return replace(
        line,
        station_width_right=right - aside,
        station_width_left=left + aside,
        attributes={**road.attributes, "offset_rms_m": f"{_rms(aside):.6f}"},
    )


def offsets(road: CentreLine, reference: CentreLine) -> Array:
    """Return how far each station of ``road`` lies to the right of ``reference``, m, shape (N,).

    The distance is taken along the normal of ``reference``; both roads must describe the same circuit with
    nearby starting points.
    """
    x, y = road.position(road.s)
    s = road.s * (reference.length / road.length)
    for _ in range(8):
        x_r, y_r = reference.position(s)
        heading = reference.heading(s)
        along = (x - x_r) * np.cos(heading) + (y - y_r) * np.sin(heading)
        aside = (y - y_r) * np.cos(heading) - (x - x_r) * np.sin(heading)
        s = s + along / (1 - aside * reference.curvature(s))
    return aside


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _uniform_stations(road: CentreLine) -> Array:
    return np.linspace(0.0, road.length, road.s.size, endpoint=False)


def smoothing_offset(road: CentreLine, weight: float) -> Array:
    """Return the offset to the right that minimises the integral of e^2 + weight (d/ds (C + e'' + C^2 e))^2.

    Parameters
    ----------
    road : CentreLine
        The original.
    weight : float
        Weight of the rate of curvature, m^4.

    Returns
    -------
    numpy.ndarray, shape (N,)
        Offset in m at as many evenly spaced stations as ``road`` has, between which derivatives are
        differences.
    """
    count = road.s.size
    spacing = road.length / count
    curvature = road.curvature(_uniform_stations(road))
    ahead = sparse.eye_array(count, k=1) + sparse.eye_array(count, k=1 - count)
    same = sparse.eye_array(count)
    rate = (ahead - same) / spacing
    curvature_change = (ahead - 2 * same + ahead.T) / spacing**2 + sparse.diags_array(curvature**2)
    rate_change = rate @ curvature_change
    normal_matrix = sparse.csc_array(same + weight * (rate_change.T @ rate_change))
    return np.asarray(sparse.linalg.spsolve(normal_matrix, -weight * (rate_change.T @ (rate @ curvature))))


def _shifted(road: CentreLine, aside: Array, kind: str) -> CentreLine:
    """Return the line that runs ``aside`` metres to the right of ``road``, with its exact curvature."""
    stations = np.append(_uniform_stations(road), road.length)
    offset = make_interp_spline(stations, np.append(aside, aside[0]), k=5, bc_type="periodic")
    s = np.linspace(0.0, road.length, _SAMPLES_PER_STATION * road.s.size + 1)
    C = road.curvature(s)
    # velocity of the shifted point per metre of the original, along and across the original tangent
    along, across = 1 - C * offset(s), offset(s, 1)
    speed = np.hypot(along, across)
    along_rate = -road.curvature_rate(s) * offset(s) - C * offset(s, 1)
    turning = C + (offset(s, 2) * along - across * along_rate) / speed**2
    distance = CubicSpline(s, speed, bc_type="periodic").antiderivative()(s)
    length = float(distance[-1])
    curvature = CubicSpline(distance, turning / speed, bc_type="periodic")
    new_stations = np.linspace(0.0, length, road.s.size, endpoint=False)
    x, y, heading = road.start
    return _closed(
        replace(
            road,
            name=f"{road.name}, {kind}",
            s=new_stations,
            station_curvature=curvature(new_stations),
            length=length,
            start=(
                x - math.sin(heading) * float(aside[0]),
                y + math.cos(heading) * float(aside[0]),
                heading + math.atan2(across[0], along[0]),
            ),
        )
    )


def _closed(road: CentreLine) -> CentreLine:
    """Return ``road`` with the least change of its station curvatures that closes the lap.

    A change dC(s) turns the rest of the lap: the end moves by minus the integral of (y_end - y) dC along x,
    by the integral of (x_end - x) dC along y, and the heading by the integral of dC.
    """
    turns = road.closure().turns
    for _ in range(_POLISH_STEPS):
        x, y = road.position(road.s)
        x_end, y_end = road.end()
        spacing = road.length / road.s.size
        influence = spacing * np.array([-(y_end - y), x_end - x, np.ones_like(x)])
        turned = float(road.heading(road.length) - road.start[2])
        gap = np.array([x_end - road.start[0], y_end - road.start[1], turned - 2 * math.pi * turns])
        change = np.linalg.lstsq(influence, -gap, rcond=None)[0]
        road = replace(road, station_curvature=road.station_curvature + change)
    return road
