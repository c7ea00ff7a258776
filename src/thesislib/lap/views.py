"""What an expert looks at in a lap, beyond the thesis's figures.

The use of the tyres (g-g plot, combined slip), the driver's hands and feet (steer rate, brake share),
which constraint holds the car where, and what each open modelling choice is worth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from .channels import WHEEL_NAMES, Lap, active_spans, brake_share, speed, steer_rate, whole_lap
from .style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    MPS_TO_KMH,
    ORANGE,
    PURPLE,
    SKY,
    SPEED_COLOURS,
    VERMILION,
    WHEELS,
    Corner,
    corner_numbers,
    distance_axis,
    legend_above,
    picture,
    styled,
)

STANDARD_GRAVITY: Final = 9.80665  # m/s^2, the unit of a g-g plot

CONSTRAINTS: Final = {
    "power": ("engine power", VERMILION),
    "ride_height": ("front ride height", BLUE),
    "left_edge": ("left edge of the road", GREEN),
    "right_edge": ("right edge of the road", SKY),
    "kappa_front": ("front slip bound", PURPLE),
    "kappa_rear": ("rear slip bound", ORANGE),
}
"""Constraints whose activity a lap can tell, with their name and colour on the strip."""


@styled
def g_g(lap: Lap) -> Figure:
    """Longitudinal over lateral acceleration of the whole lap, coloured by speed.

    Acceleration forward is up and to the right is right, in units of standard gravity.
    """
    figure = picture(5.0)
    axes = figure.add_subplot()
    points = axes.scatter(
        lap["a_y"] / STANDARD_GRAVITY,
        lap["a_x"] / STANDARD_GRAVITY,
        c=MPS_TO_KMH * speed(lap),
        cmap=SPEED_COLOURS,
        s=7.0,
        linewidths=0.0,
    )
    axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=0.8)
    axes.axvline(0.0, color=GREY, linewidth=0.8, zorder=0.8)
    axes.set_aspect("equal")
    axes.set_xlabel("lateral acceleration, $a_y$ (g)")
    axes.set_ylabel("longitudinal acceleration, $a_x$ (g)")
    figure.colorbar(points, ax=axes, aspect=30, pad=0.02).set_label("speed (km/h)")
    return figure


@styled
def combined_slip(lap: Lap, corners: Sequence[Corner] | None = None, *, peak: float = 0.751) -> Figure:
    """Combined slip rho (B.9) of each wheel along the lap, with the slip of the greatest force.

    Parameters
    ----------
    lap : Lap
    corners : sequence of (number, distance in m, direction), optional
    peak : float
        Combined slip at which a tyre gives its greatest force; with the shape factors of Table B.1 as
        printed it is 0.751 and not 1.
    """
    figure = picture(6.4)
    panels = figure.subplots(4, 1, sharex=True, sharey=True)
    for axes, (wheel, colour) in zip(panels, WHEELS.items(), strict=True):
        axes.plot(*whole_lap(lap, lap[f"rho_{wheel}"]), color=colour, linewidth=1.2)
        axes.axhline(
            peak, color=BLACK, linewidth=1.0, linestyle="--", label=rf"greatest force, $\rho$ = {peak:g}"
        )
        axes.set_ylabel(f"{WHEEL_NAMES[wheel]}\n" + rf"$\rho_{{{wheel}}}$ (1)")
        axes.set_xlim(0.0, lap.track.length)
        axes.set_ylim(bottom=0.0)
        corner_numbers(axes, lap.track.length, corners, labels=axes is panels[0])
    legend_above(panels[0], corners=corners, above_corners=1.2)
    panels[-1].set_xlabel("distance along the centre line, s (m)")
    return figure


@styled
def front_brake_share(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Front axle's share of the braking force along the lap, where the car brakes."""
    figure = picture(3.0)
    axes = figure.add_subplot()
    share = 100.0 * brake_share(lap)
    axes.plot(lap.s, share, color=BLUE, marker=".", markersize=2.5, label="front axle's share")
    middle = float(np.nanmedian(share))
    axes.axhline(middle, color=BLACK, linestyle="--", linewidth=1.0, label=f"median {middle:.0f} %")
    axes.set_ylabel("share of braking (%)")
    axes.set_ylim(0.0, 103.0)
    distance_axis(axes, lap.track.length, corners)
    legend_above(axes, corners=corners)
    return figure


@styled
def steering_rate(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Steering angle and its rate along the lap, at the road wheels; positive to the right."""
    figure = picture(4.4)
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.plot(*whole_lap(lap, np.degrees(lap["delta"])), color=BLACK, label=r"angle, $\delta$")
    lower.plot(
        *whole_lap(lap, np.degrees(steer_rate(lap))),
        color=BLUE,
        label=r"rate, $\mathrm{d}\delta/\mathrm{d}t$",
    )
    upper.set_ylabel("steer angle (°)")
    lower.set_ylabel("steer rate (°/s)")
    distance_axis(upper, lap.track.length, corners)
    upper.set_xlabel("")
    distance_axis(lower, lap.track.length)
    corner_numbers(lower, lap.track.length, corners, labels=False)
    return figure


@styled
def active_constraints(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Where along the lap each constraint is active, and along which share of it."""
    figure = picture(3.2)
    axes = figure.add_subplot()
    names = []
    for row, (constraint, (label, colour)) in enumerate(CONSTRAINTS.items()):
        spans = active_spans(lap, lap.activity(constraint))
        axes.broken_barh(spans, (row - 0.36, 0.72), facecolors=colour)
        share = 100.0 * sum(length for _, length in spans) / lap.track.length
        names.append(f"{label}, {share:.1f} %")
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(axis="y", length=0.0)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    for row in range(1, len(names)):
        axes.axhline(row - 0.5, color=LIGHT, linewidth=0.7)
    distance_axis(axes, lap.track.length, corners, clear=0.055)
    return figure


@styled
def lap_time_differences(names: Sequence[str], differences_s: Sequence[float]) -> Figure:
    """What each modelling choice that the thesis leaves open is worth in lap time.

    Parameters
    ----------
    names : sequence of str
        The choices, one line each.
    differences_s : sequence of float
        Lap time with the choice less the lap time of the reference, in s; negative is faster.

    Raises
    ------
    ValueError
        If there is not one difference for each name.
    """
    if len(names) != len(differences_s):
        raise ValueError(f"{len(names)} choices cannot have {len(differences_s)} lap-time differences")
    order = sorted(range(len(names)), key=lambda choice: abs(differences_s[choice]), reverse=True)
    values = [float(differences_s[choice]) for choice in order]
    figure = picture(1.0 + 0.36 * max(len(order), 1))
    axes = figure.add_subplot()
    bars = axes.barh(
        range(len(order)), values, color=[BLUE if value < 0.0 else VERMILION for value in values]
    )
    axes.bar_label(
        bars, labels=[f"{value:+.3f}".replace("-", "−") for value in values], padding=3, fontsize=10
    )
    axes.set_yticks(range(len(order)), [names[choice] for choice in order])
    axes.tick_params(axis="y", length=0.0)
    axes.invert_yaxis()
    axes.axvline(0.0, color=BLACK, linewidth=0.9)
    axes.grid(visible=False, axis="y")
    axes.margins(x=0.2)
    axes.set_xlabel("lap-time difference (s), blue faster, red slower")
    return figure
