"""Pictures of two laps on one road: how far each goes to its edges, and what that is worth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from .channels import beside, speed, whole_lap
from .comparison import difference, time_gained
from .edges import wheels_on_road
from .maps import ground_axes
from .style import (
    BLACK,
    BLUE,
    GREY,
    LIGHT,
    MPS_TO_KMH,
    VERMILION,
    Corner,
    corner_numbers,
    distance_axis,
    legend_above,
    picture,
    styled,
)

if TYPE_CHECKING:
    from .minimum_time import Lap

COLOURS = (BLUE, VERMILION)
"""Of the lap that is compared, and of the lap it is compared with."""


@styled
def compared_laps(
    laps: Mapping[str, Lap], half_width_m: float, corners: Sequence[Corner] | None = None
) -> Figure:
    """Lateral distances of two laps in their corridors, their speeds, and the time that one gains.

    Parameters
    ----------
    laps : mapping of Lap
        By name: the lap on the whole road, and the lap whose mass centre stays near the centre line.
    half_width_m : float
        The corridor of the second, m.
    corners : sequence of (number, distance in m, direction), optional
    """
    lap, base = laps.values()
    length = lap.track.length
    figure = picture(6.6)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=(3.0, 2.0, 2.0))
    s = np.linspace(0.0, length, 1500)
    right, left = lap.track.widths(s)
    panels[0].fill_between(s, -left, right, color=LIGHT, linewidth=0.0, label="road")
    for side in (-half_width_m, half_width_m):
        panels[0].axhline(side, color=GREY, linewidth=0.8, linestyle="--")
    for colour, (name, one) in zip(COLOURS, laps.items(), strict=True):
        panels[0].plot(*whole_lap(one, one["n"]), color=colour, linewidth=1.1, label=name)
    panels[1].plot(s, MPS_TO_KMH * difference(lap, base, speed, s), color=BLACK, linewidth=1.1)
    panels[2].plot(s, time_gained(lap, base, s), color=BLACK)
    for axes, label in zip(
        panels,
        ("lateral distance of the\nmass centre, n (m)", "gain of speed\n(km/h)", "gain of time\n(s)"),
        strict=True,
    ):
        axes.set_ylabel(label)
        distance_axis(axes, length)
        corner_numbers(axes, length, corners, labels=axes is panels[0])
        if axes is not panels[-1]:
            axes.set_xlabel("")
    panels[0].invert_yaxis()
    legend_above(panels[0], columns=3, corners=corners, above_corners=1.2)
    return figure


@styled
def wheel_tracks_on_map(
    laps: Mapping[str, Lap], half_width_m: float, *, from_m: float, to_m: float
) -> Figure:
    """Map of one part of the road with its edges, the paths of two mass centres and of the outer wheels.

    Parameters
    ----------
    laps : mapping of Lap
        By name: the lap on the whole road, whose wheels are drawn, and the lap in the corridor.
    half_width_m : float
        The corridor of the second, m.
    from_m, to_m : float
        Part of the lap, in m along the centre line.

    Raises
    ------
    ValueError
        If the part is empty or leaves the lap.
    """
    lap, _ = laps.values()
    track = lap.track
    if not 0.0 <= from_m < to_m <= track.length:
        raise ValueError(f"a part of the lap from {from_m} to {to_m} m must lie within 0 .. {track.length} m")
    figure = picture(6.0)
    axes = figure.add_subplot()
    s = np.linspace(from_m, to_m, 800)
    right, left = track.widths(s)
    for label, edge in (("edges of the road", right), (None, -left)):
        axes.plot(*beside(track, s, edge), color=BLACK, linewidth=1.4, label=label)
    for label, side in ((f"{half_width_m:g} m from the centre line", half_width_m), (None, -half_width_m)):
        axes.plot(*beside(track, s, side), color=GREY, linewidth=0.9, linestyle="--", label=label)
    for colour, (name, one) in zip(COLOURS, laps.items(), strict=True):
        inside = (one.s >= from_m) & (one.s <= to_m)
        place = one.s[inside], one["n"][inside]
        axes.plot(*beside(track, *place), color=colour, linewidth=1.8, label=name)
        if one is not lap:
            continue
        wheels = wheels_on_road(track, *place, one["xi"][inside], one.car.values)
        for number, wheel in enumerate(wheels.values()):
            path = beside(track, wheel.s, wheel.lateral)
            axes.plot(*path, color=colour, linewidth=0.6, label=None if number else "its four wheels")
    ground_axes(axes)
    legend_above(axes, columns=2)
    return figure
