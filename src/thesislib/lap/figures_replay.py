"""Pictures of a replay: where motion and rest of the axles differ, and how a moving axle rings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from .channels import speed, whole_lap
from .style import (
    BLACK,
    FRONT,
    GREY,
    MPS_TO_KMH,
    REAR,
    Corner,
    corner_numbers,
    distance_axis,
    legend_above,
    picture,
    styled,
)

if TYPE_CHECKING:
    from .replay import Replay

_COLOURS = {"front": FRONT, "rear": REAR}


@styled
def ride_height_errors(replay: Replay, corners: Sequence[Corner] | None = None) -> Figure:
    """Ride heights of the metamodel in their two errors along the lap, and the downforce of the first.

    Parameters
    ----------
    replay : Replay
    corners : sequence of (number, distance in m, direction), optional
    """
    lap, length = replay.lap, replay.lap.track.length
    moving, table = replay.quasi_static, replay.table_error
    figure = picture(6.2)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=(3.0, 2.0, 3.0))
    for axle, colour in _COLOURS.items():
        panels[0].plot(
            *whole_lap(lap, 1e3 * moving.height[axle]), color=colour, linewidth=1.0, label=f"{axle} axle"
        )
        panels[1].plot(*whole_lap(lap, 1e3 * table.height[axle]), color=colour, linewidth=1.0)
        panels[2].plot(*whole_lap(lap, moving.downforce[axle]), color=colour, linewidth=1.0)
    for axes, label in zip(
        panels,
        (
            "motion less rest,\nheight (mm)",
            "rest less table,\nheight (mm)",
            "motion less rest,\ndownforce (N)",
        ),
        strict=True,
    ):
        axes.set_ylabel(label)
        distance_axis(axes, length)
        corner_numbers(axes, length, corners, labels=axes is panels[0])
        if axes is not panels[-1]:
            axes.set_xlabel("")
    legend_above(panels[0], corners=corners, above_corners=1.2)
    return figure


@styled
def moving_ride_heights(
    replay: Replay, from_m: float, to_m: float, *, bound_mm: float | None = None
) -> Figure:
    """Ride heights in motion, at rest and by the table on one part of the lap, and the speed there.

    Parameters
    ----------
    replay : Replay
    from_m, to_m : float
        Part of the lap, in m along the centre line.
    bound_mm : float, optional
        Largest front ride height that the problem allows, in mm.

    Raises
    ------
    ValueError
        If the part is empty or leaves the lap.
    """
    lap = replay.lap
    if not 0.0 <= from_m < to_m <= lap.track.length:
        raise ValueError(
            f"a part of the lap from {from_m} to {to_m} m must lie within 0 .. {lap.track.length} m"
        )
    inside = (lap.s >= from_m) & (lap.s <= to_m)
    s = lap.s[inside]
    figure = picture(5.4)
    front, rear, lower = figure.subplots(3, 1, sharex=True, height_ratios=(3.0, 3.0, 1.2))
    for axes, name, colour in ((front, "h_f", FRONT), (rear, "h_r", REAR)):
        moving, at_rest, table = (
            1e3 * getattr(posture, name)[inside] for posture in (replay.moving, replay.at_rest, replay.table)
        )
        axle = "front" if name == "h_f" else "rear"
        axes.plot(s, moving, color=colour, label=f"{axle}, in motion")
        axes.plot(s, at_rest, color=BLACK, linewidth=1.0, label="at rest")
        axes.plot(s, table, color=GREY, linestyle=":", linewidth=1.8, label="table")
        axes.set_ylabel("height, down\npositive (mm)")
    if bound_mm is not None:
        front.axhline(bound_mm, color=FRONT, linewidth=1.0, linestyle="--", label=f"bound, {bound_mm:g} mm")
    for axes in (front, rear):
        legend_above(axes)
    lower.plot(s, MPS_TO_KMH * speed(lap)[inside], color=BLACK, linestyle="-.")
    lower.set_ylabel("speed\n(km/h)")
    lower.set_xlim(float(np.min(s)), float(np.max(s)))
    lower.set_xlabel("distance along the centre line, s (m)")
    return figure
