"""Figures 4.13 to 4.18 of the thesis: what a change of set-up does along the lap.

Front stays blue and rear red. Where two laps share an axle's colour, the first lap is solid and the
reference dashed; where an axle stands alone, the reference is black.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .channels import Array, Lap, speed, whole_lap
from .comparison import common_points, difference, time_gained
from .style import (
    BLACK,
    FRONT,
    GREEN,
    GREY,
    MPS_TO_KMH,
    REAR,
    Corner,
    axis_on_the_right,
    distance_axis,
    legend_above,
    picture,
    shared_distance_axis,
    styled,
)

Names = tuple[str, str]
"""What the legend calls the lap and the reference."""

REFERENCE: Final[Mapping[str, Any]] = {"linestyle": "--", "linewidth": 1.1}
"""The strokes of the reference where an axle's colour is taken."""


@styled
def ride_heights_of_two(
    lap: Lap,
    reference: Lap,
    corners: Sequence[Corner] | None = None,
    *,
    names: Names = ("row F", "row E"),
    bound_mm: float | None = 15.0,
) -> Figure:
    """Figure 4.13: ride heights of a lap, solid, and of a reference, dashed.

    Ride heights are displacements along z, downwards: the car sinks as they grow.

    Parameters
    ----------
    lap, reference : Lap
    corners : sequence of (number, distance in m, direction), optional
    names : (str, str)
        What the legend calls them.
    bound_mm : float, optional
        Largest front ride height that the problem allows, in mm.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = picture(4.4)
    axes = figure.add_subplot()
    for channel, axle, colour in (("h_f", "front", FRONT), ("h_r", "rear", REAR)):
        _two(axes, lap, reference, 1e3 * lap[channel], 1e3 * reference[channel], axle, colour, names)
    if bound_mm is not None:
        axes.axhline(bound_mm, color=GREY, linewidth=1.0, linestyle=":", label=f"bound, {bound_mm:g} mm")
    axes.set_ylabel("height, down positive (mm)")
    distance_axis(axes, lap.track.length, corners)
    legend_above(axes, columns=3, corners=corners)
    return figure


@styled
def front_downforce_of_two(
    lap: Lap,
    reference: Lap,
    corners: Sequence[Corner] | None = None,
    *,
    names: Names = ("row F", "row E"),
) -> Figure:
    """Figure 4.14: front downforce coefficients of two laps, and the time that the first is ahead.

    Parameters
    ----------
    lap, reference : Lap
    corners : sequence of (number, distance in m, direction), optional
    names : (str, str)
        What the legend calls them.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the laps are of different roads.
    """
    figure = picture(3.6)
    axes = figure.add_subplot()
    _coefficients(axes, lap, reference, "C_L_front", FRONT, names)
    axes.set_ylabel("front downforce, $C_L^f$ (1)")
    distance_axis(axes, lap.track.length, corners)
    gain = _gain_on_the_right(axes, lap, reference)
    legend_above(axes, corners=corners, also=(gain,))
    return figure


@styled
def rear_downforce_of_two(
    lap: Lap,
    reference: Lap,
    corners: Sequence[Corner] | None = None,
    *,
    names: Names = ("row I", "row C"),
) -> Figure:
    """Figure 4.15: rear downforce coefficients of two laps, and the roll angle of the first.

    Parameters
    ----------
    lap, reference : Lap
    corners : sequence of (number, distance in m, direction), optional
    names : (str, str)
        What the legend calls them.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = picture(4.4)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    _coefficients(upper, lap, reference, "C_L_rear", REAR, names)
    upper.set_ylabel("rear downforce, $C_L^r$ (1)")
    lower.plot(
        *whole_lap(lap, np.degrees(lap["phi_r"])),
        color=BLACK,
        linestyle="--",
        label=f"roll angle, {names[0]}",
    )
    lower.set_ylabel("roll (°)")
    shared_distance_axis(upper, lower, lap.track.length, corners)
    return figure


@styled
def aero_balance(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Figure 4.16: the aerodynamic balance as a control, u_CoP, and the speed.

    Parameters
    ----------
    lap : Lap
        With the channel ``"u_CoP"``: downforce coefficient moved from the front to the rear axle.
    corners : sequence of (number, distance in m, direction), optional

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = picture(4.4)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    upper.plot(*whole_lap(lap, lap["u_CoP"]), color=REAR, label=r"balance, $u_\mathrm{CoP}$")
    upper.axhline(0.0, color=GREY, linewidth=0.8, zorder=0.8)
    upper.set_ylabel("moved to the rear (1)")
    lower.plot(*whole_lap(lap, MPS_TO_KMH * speed(lap)), color=BLACK, linestyle="--", label="speed")
    lower.set_ylabel("speed (km/h)")
    shared_distance_axis(upper, lower, lap.track.length, corners)
    return figure


@styled
def aerodynamic_forces_of_two(
    lap: Lap,
    reference: Lap,
    corners: Sequence[Corner] | None = None,
    *,
    names: Names = ("row P", "row C"),
) -> Figure:
    """Figure 4.17: downforce of both axles and drag of a lap, solid, and of a reference, dashed.

    Parameters
    ----------
    lap, reference : Lap
    corners : sequence of (number, distance in m, direction), optional
    names : (str, str)
        What the legend calls them.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = picture(4.4)
    axes = figure.add_subplot()
    for channel, sign, force, colour in (
        ("F_az_rear", 1.0, "rear", REAR),
        ("F_az_front", 1.0, "front", FRONT),
        ("F_ax", -1.0, "drag", BLACK),
    ):
        kilo = 1e-3 * sign
        _two(axes, lap, reference, kilo * lap[channel], kilo * reference[channel], force, colour, names)
    axes.set_ylabel("force (kN)")
    axes.set_ylim(bottom=0.0)
    distance_axis(axes, lap.track.length, corners)
    legend_above(axes, columns=3, corners=corners)
    return figure


@styled
def speed_gain(
    lap: Lap,
    reference: Lap,
    corners: Sequence[Corner] | None = None,
    *,
    names: Names = ("row P", "row C"),
) -> Figure:
    """Figure 4.18: by how much a lap is faster than a reference, and the time that it is ahead.

    Parameters
    ----------
    lap, reference : Lap
    corners : sequence of (number, distance in m, direction), optional
    names : (str, str)
        What the legend calls them.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the laps are of different roads.
    """
    figure = picture(3.6)
    axes = figure.add_subplot()
    s = common_points(lap, reference)
    faster = MPS_TO_KMH * difference(lap, reference, speed, s)
    axes.plot(s, faster, color=BLACK, linewidth=1.2, label=f"speed, {names[0]} less {names[1]}")
    axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=0.8)
    axes.set_ylabel("speed difference (km/h)")
    distance_axis(axes, lap.track.length, corners)
    gain = _gain_on_the_right(axes, lap, reference)
    legend_above(axes, corners=corners, also=(gain,))
    return figure


def _two(
    axes: Axes,
    lap: Lap,
    reference: Lap,
    values: Array,
    others: Array,
    what: str,
    colour: str,
    names: Names,
) -> None:
    """Draw one quantity of both laps in one colour, the reference dashed and beneath."""
    axes.plot(*whole_lap(lap, values), color=colour, label=f"{what}, {names[0]}")
    axes.plot(
        *whole_lap(reference, others), color=colour, **REFERENCE, zorder=1.9, label=f"{what}, {names[1]}"
    )


def _coefficients(axes: Axes, lap: Lap, reference: Lap, channel: str, colour: str, names: Names) -> None:
    """Draw an axle's downforce coefficient of both laps, the reference in black and beneath."""
    axes.plot(*whole_lap(lap, lap[channel]), color=colour, label=names[0])
    axes.plot(
        *whole_lap(reference, reference[channel]), color=BLACK, linewidth=1.0, zorder=1.9, label=names[1]
    )


def _gain_on_the_right(axes: Axes, lap: Lap, reference: Lap) -> Axes:
    """Draw the time gained on an ordinate of its own and return that."""
    right = axis_on_the_right(axes, "time gained (s)", GREEN)
    s = common_points(lap, reference)
    gained = time_gained(lap, reference, s)
    right.plot(s, gained, color=GREEN, linestyle="--", linewidth=1.8, label=f"gained, {gained[-1]:.2f} s")
    return right
