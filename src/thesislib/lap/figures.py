"""Figures 4.5, 4.7 and 4.9 to 4.12 of the thesis, drawn from a lap (4.6 and 4.8: :mod:`.maps`).

Each function returns a figure and changes no global state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.figure import Figure

from .channels import Array, Lap, speed, whole_lap
from .style import (
    BLACK,
    FRONT,
    MPS_TO_KMH,
    PURPLE,
    REAR,
    VERMILION,
    Corner,
    distance_axis,
    legend_above,
    picture,
    shared_distance_axis,
    styled,
)

Coefficients = Callable[[Array, Array], tuple[Array, Array]]
"""Ride heights (h_f, h_r) in m to the downforce coefficients (C_L_front, C_L_rear)."""


@styled
def downforce_maps(
    coefficients: Coefficients,
    *,
    h_f_mm: tuple[float, float] = (-14.0, 15.0),
    h_r_mm: tuple[float, float] = (-75.0, -37.0),
    lap: Lap | None = None,
) -> Figure:
    """Figure 4.5: downforce coefficients over both ride heights, without side slip, steer or roll.

    Ride heights are displacements along z, downwards: the car sinks as they grow.

    Parameters
    ----------
    coefficients : callable
        ``(h_f, h_r) -> (C_L_front, C_L_rear)``, heights in m, arrays of one shape.
    h_f_mm, h_r_mm : (float, float)
        Ranges of the front and rear ride height in mm.
    lap : Lap, optional
        A lap whose ride heights are laid over both maps.

    Returns
    -------
    matplotlib.figure.Figure
    """
    front, rear = np.meshgrid(np.linspace(*h_f_mm, 60), np.linspace(*h_r_mm, 61))
    maps = coefficients(1e-3 * front, 1e-3 * rear)
    figure = picture(3.5)
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, values, name in ((left, maps[0], "front, $C_L^f$"), (right, maps[1], "rear, $C_L^r$")):
        axes.contourf(front, rear, values, levels=14, cmap="cividis", alpha=0.85)
        lines = axes.contour(front, rear, values, levels=7, colors=BLACK, linewidths=0.8)
        texts = axes.clabel(lines, fmt="%.2f", fontsize=9.5)
        for text in texts:
            text.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6})
        if lap is not None:
            axes.plot(
                1e3 * lap["h_f"], 1e3 * lap["h_r"], ".", color=VERMILION, markersize=2, label="this lap"
            )
        axes.set_title(name)
        axes.set_xlabel("front height, $h_f$ (mm)")
        axes.grid(False)
        axes.set_xlim(*h_f_mm)
        axes.set_ylim(*h_r_mm)
    left.set_ylabel("rear height, $h_r$ (mm)")
    if lap is not None:
        left.legend(loc="upper left", markerscale=4, frameon=True)
    return figure


@styled
def speed_trace(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Figure 4.7: speed of the mass centre along the lap, its highest and lowest marked."""
    figure = picture(3.3)
    axes = figure.add_subplot()
    s, mps = whole_lap(lap, speed(lap))
    kmh = MPS_TO_KMH * mps
    axes.plot(s, kmh, color=BLACK, label=f"lap time {lap.time:.2f} s")
    for place, marker, colour in ((int(np.argmax(kmh)), "^", FRONT), (int(np.argmin(kmh)), "v", REAR)):
        name = f"{kmh[place]:.1f} km/h at {s[place]:.0f} m"
        axes.plot(s[place], kmh[place], marker, color=colour, label=name, clip_on=False, zorder=3)
    axes.set_ylabel("speed (km/h)")
    distance_axis(axes, lap.track.length, corners)
    legend_above(axes, corners=corners)
    return figure


@styled
def ride_heights(lap: Lap, corners: Sequence[Corner] | None = None, *, bound_mm: float = 15.0) -> Figure:
    """Figure 4.9: front and rear ride heights, the front's bound, and the speed.

    Ride heights are displacements along z, downwards: the car sinks as they grow.

    Parameters
    ----------
    lap : Lap
    corners : sequence of (number, distance in m, direction), optional
    bound_mm : float
        Largest front ride height that the problem allows, in mm.
    """
    figure = picture(4.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    s, front = whole_lap(lap, 1e3 * lap["h_f"])
    upper.plot(s, front, color=FRONT, label="front, $h_f$")
    upper.plot(*whole_lap(lap, 1e3 * lap["h_r"]), color=REAR, label="rear, $h_r$")
    upper.axhline(bound_mm, color=FRONT, linewidth=1.0, linestyle="--", label=f"bound, {bound_mm:g} mm")
    upper.set_ylabel("height, down positive (mm)")
    lower.plot(s, MPS_TO_KMH * whole_lap(lap, speed(lap))[1], color=BLACK, linestyle="-.", label="speed")
    lower.set_ylabel("speed (km/h)")
    shared_distance_axis(upper, lower, lap.track.length, corners)
    return figure


@styled
def roll_angles(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Figure 4.10: roll angles of both axles, which (4.19) makes equal."""
    figure = picture(3.1)
    axes = figure.add_subplot()
    axes.plot(*whole_lap(lap, np.degrees(lap["phi_f"])), color=FRONT, linewidth=2.6, label=r"front, $\phi_f$")
    axes.plot(*whole_lap(lap, np.degrees(lap["phi_r"])), color=REAR, linestyle="--", label=r"rear, $\phi_r$")
    axes.set_ylabel("roll angle (°)")
    distance_axis(axes, lap.track.length, corners)
    legend_above(axes, corners=corners)
    return figure


@styled
def aerodynamic_coefficients(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Figure 4.11: drag coefficient and the downforce coefficients of both axles."""
    figure = picture(4.2)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    upper.plot(*whole_lap(lap, lap["C_L_front"]), color=FRONT, label="front downforce, $C_L^f$")
    upper.plot(*whole_lap(lap, lap["C_L_rear"]), color=REAR, label="rear downforce, $C_L^r$")
    lower.plot(*whole_lap(lap, lap["C_D"]), color=BLACK, label="drag, $C_D$")
    # the drag hardly moves; on an axis of its own breadth it would look as if it did
    middle = float(np.mean(lap["C_D"]))
    lower.set_ylim(middle - 0.05, middle + 0.05)
    upper.set_ylabel("coefficient (1)")
    lower.set_ylabel("drag (1)")
    shared_distance_axis(upper, lower, lap.track.length, corners)
    return figure


@styled
def aerodynamic_forces(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Figure 4.12: downforce of both axles (4.22), (4.23), their sum, and the drag (4.24)."""
    figure = picture(3.5)
    axes = figure.add_subplot()
    total = lap["F_az_front"] + lap["F_az_rear"]
    axes.plot(*whole_lap(lap, 1e-3 * total), color=PURPLE, linestyle="--", label="total downforce")
    axes.plot(*whole_lap(lap, 1e-3 * lap["F_az_front"]), color=FRONT, label="front, $F_{az}^f$")
    axes.plot(*whole_lap(lap, 1e-3 * lap["F_az_rear"]), color=REAR, label="rear, $F_{az}^r$")
    axes.plot(*whole_lap(lap, -1e-3 * lap["F_ax"]), color=BLACK, label="drag, $-F_{ax}$")
    axes.set_ylabel("force (kN)")
    axes.set_ylim(bottom=0.0)
    distance_axis(axes, lap.track.length, corners)
    legend_above(axes, corners=corners)
    return figure
