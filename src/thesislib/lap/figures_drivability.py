"""Pictures of how drivable the car is: stability along the lap, its price in lap time, steady cornering."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm
from matplotlib.figure import Figure

from .aero_balance import Drivability
from .channels import Lap
from .handling import STANDARD_GRAVITY, Cornering, degrees_per_g, linear_understeer_gradient
from .maps import coloured_line
from .style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    MPS_TO_KMH,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Corner,
    distance_axis,
    legend_above,
    picture,
    styled,
)
from .yaw_stability import YawStability

STABILITY_COLOURS: Final = LinearSegmentedColormap.from_list(
    "stability", [BLUE, SKY, "#EFEFEF", ORANGE, VERMILION, "#7A2A00"], N=256
)
"""Blue where a slide dies out, grey where it stays, red where it grows."""

_CURVES: Final = (BLACK, VERMILION, BLUE, GREEN)
_SPEEDS: Final = (PURPLE, BLUE, SKY, GREEN, ORANGE, VERMILION, BLACK)
_FASTEST_DECAY = -15.0  # 1/s; a car on the straight lies far below, and nobody asks how far


@styled
def growth_along_lap(
    stabilities: Mapping[str, YawStability], length: float, corners: Sequence[Corner] | None = None
) -> Figure:
    """Growth rate of a small slide along the lap, with the hands still; one panel for each lap.

    Parameters
    ----------
    stabilities : mapping of str to YawStability
        By name of the lap.
    length : float
        Length of the lap, m.
    corners : sequence of (number, distance in m, direction), optional
    """
    figure = picture(1.0 + 1.9 * len(stabilities))
    panels = figure.subplots(len(stabilities), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    highest = max(each.largest_growth for each in stabilities.values())
    for axes, (name, each) in zip(panels, stabilities.items(), strict=True):
        share = f"{name}: unstable for {100.0 * each.unstable_share:.0f} % of the lap time"
        axes.plot(each.s, each.growth, color=BLACK, linewidth=1.0)
        axes.fill_between(
            each.s, 0.0, each.growth, where=each.unstable, color=VERMILION, linewidth=0.0, label=share
        )
        axes.axhline(0.0, color=GREY, linewidth=0.9)
        axes.set_ylim(_FASTEST_DECAY, 1.12 * max(highest, 1.0))
        axes.set_ylabel("growth rate (1/s)")
        distance_axis(axes, length, corners if axes is panels[0] else None)
        legend_above(axes, corners=corners if axes is panels[0] else None, above_corners=1.22)
        if axes is not panels[-1]:
            axes.set_xlabel("")
    return figure


@styled
def growth_on_map(lap: Lap, stability: YawStability, corners: Sequence[Corner] | None = None) -> Figure:
    """The racing line on the map, coloured by the growth rate of a small slide."""
    highest = max(stability.largest_growth, 1.0)
    return coloured_line(
        lap,
        np.maximum(stability.growth, _FASTEST_DECAY),
        "growth rate of a slide (1/s), red unstable",
        corners,
        colours=STABILITY_COLOURS,
        norm=TwoSlopeNorm(0.0, _FASTEST_DECAY, highest),
    )


@styled
def time_and_stability(
    swept: Sequence[Drivability], others: Sequence[Drivability] = (), *, front: Sequence[Drivability] = ()
) -> Figure:
    """Lap time against stability: laps of a swept balance, and others for comparison.

    Parameters
    ----------
    swept : sequence of Drivability
        Laps of the sweep, in its order; they are joined.
    others : sequence of Drivability
        Single laps, named in the picture.
    front : sequence of Drivability
        Laps that no other beats, ringed.

    Names stand in the lower panel; a lap is at the same lap time in the upper one.
    """
    figure = picture(5.6)
    panels = figure.subplots(2, 1, sharex=True)
    shares = {id(each): 100.0 * each.unstable_share for each in (*swept, *others, *front)}
    growths = {id(each): each.largest_growth for each in (*swept, *others, *front)}
    for axes, ordinate, name in (
        (panels[0], shares, "unstable time share (%)"),
        (panels[1], growths, "largest growth rate (1/s)"),
    ):
        axes.plot(
            [each.lap_time for each in swept],
            [ordinate[id(each)] for each in swept],
            "o-",
            color=BLUE,
            markersize=5.0,
            label=r"balance swept, $a_\mathrm{off}$",
        )
        if others:
            axes.plot(
                [each.lap_time for each in others],
                [ordinate[id(each)] for each in others],
                "s",
                color=VERMILION,
                markersize=5.0,
                label="rows of Table 4.2",
            )
        if front and axes is panels[0]:
            axes.plot(
                [each.lap_time for each in front],
                [ordinate[id(each)] for each in front],
                "o",
                color=BLACK,
                markerfacecolor="none",
                markersize=10.0,
                label="no lap is faster and more stable",
            )
        axes.set_ylabel(name)
        axes.margins(x=0.08, y=0.15)
    fastest = min((each.lap_time for each in swept), default=0.0)
    passed = False
    for each in swept:
        _named(panels[1], each, BLUE, "right", -12.0 if passed else 4.0)
        passed = passed or each.lap_time == fastest
    for each in others:
        _named(panels[1], each, VERMILION, "left", -9.0)
    panels[1].set_xlabel("lap time (s)")
    legend_above(panels[0], columns=2)
    return figure


@styled
def handling_diagram(branches: Sequence[Cornering]) -> Figure:
    """Steer angle less the geometric one over lateral acceleration, for several speeds, up to the limit.

    Dashed where the car is unstable with the hands still; a cross where the engine can no longer keep the
    speed, a dot at the limit of grip.

    Parameters
    ----------
    branches : sequence of Cornering
        One for each speed.
    """
    figure = picture(4.4)
    axes = figure.add_subplot()
    for branch, colour in zip(branches, _cycled(len(branches)), strict=True):
        a_y = branch.lateral_acceleration / STANDARD_GRAVITY
        steer = np.degrees(branch.steer_for_slip)
        stable = branch.growth <= 0.0
        axes.plot(
            a_y,
            np.where(stable, steer, np.nan),
            color=colour,
            label=f"{MPS_TO_KMH * branch.speed:.0f} km/h",
        )
        axes.plot(a_y, np.where(_touching(~stable), steer, np.nan), color=colour, linestyle="--")
        axes.plot(a_y[-1], steer[-1], "o", color=colour, markersize=5.0)
        limited = branch.power_limit / STANDARD_GRAVITY
        if 0.0 < limited < a_y[-1]:
            axes.plot(limited, np.interp(limited, a_y, steer), "x", color=colour, markersize=7.0)
    axes.axhline(0.0, color=GREY, linewidth=0.9)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("lateral acceleration, $a_y$ (g)")
    axes.set_ylabel(r"steer less geometric, $\delta - l/R$ (°)")
    legend_above(axes, columns=4)
    return figure


@styled
def cornering_over_speed(branches: Sequence[Cornering]) -> Figure:
    """Understeer gradient in straight running, and the limit of lateral acceleration, over speed.

    Parameters
    ----------
    branches : sequence of Cornering
        In order of speed.
    """
    figure = picture(5.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    kmh = [MPS_TO_KMH * each.speed for each in branches]
    full = [degrees_per_g(each.understeer_gradient[0]) for each in branches]
    linear = [degrees_per_g(linear_understeer_gradient(each)) for each in branches]
    upper.plot(kmh, full, "o-", color=BLUE, markersize=4.5, label="full car")
    upper.plot(kmh, linear, "--", color=BLACK, label="linear single-track car")
    upper.axhline(0.0, color=GREY, linewidth=0.9)
    upper.set_ylabel("understeer (°/g)")
    grip = [each.limit / STANDARD_GRAVITY for each in branches]
    power = [each.power_limit / STANDARD_GRAVITY for each in branches]
    lower.plot(kmh, grip, "o-", color=VERMILION, markersize=4.5, label="limit of grip")
    lower.plot(kmh, power, "--", color=BLACK, label="limit of power")
    lower.set_ylim(bottom=0.0)
    lower.set_ylabel("lateral acceleration (g)")
    lower.set_xlabel("speed (km/h)")
    for axes in (upper, lower):
        legend_above(axes, columns=2)
    return figure


@styled
def cost_along_lap(
    densities: Mapping[str, tuple[np.ndarray, np.ndarray, float]],
    length: float,
    corners: Sequence[Corner] | None = None,
) -> Figure:
    """Where along the lap a change of the equations acts: its time so far, from the start line.

    Parameters
    ----------
    densities : mapping of str to (s, gain, total)
        By name of the change: distance of the points (N,) in m, the change of lap time that acts before each
        of them (N,) in s, and all of it in s.
    length : float
        Length of the lap, m.
    corners : sequence of (number, distance in m, direction), optional
    """
    figure = picture(4.0)
    axes = figure.add_subplot()
    for (name, (s, gained, total)), colour in zip(densities.items(), _CURVES, strict=False):
        axes.plot(s, 1e3 * gained, color=colour, label=f"{name}, {1e3 * total:+.0f} ms".replace("-", "−"))
    axes.axhline(0.0, color=GREY, linewidth=0.9)
    axes.set_ylabel("change of lap time so far (ms)")
    distance_axis(axes, length, corners)
    legend_above(axes, columns=1, corners=corners)
    return figure


def _named(axes: Axes, lap: Drivability, colour: str, side: Literal["left", "right"], above: float) -> None:
    """Write a lap's short name beside its point, so many points above it."""
    axes.annotate(
        lap.name.removeprefix("a_off = ").removeprefix("row "),
        (lap.lap_time, lap.largest_growth),
        xytext=(-6.0 if side == "right" else 6.0, above),
        textcoords="offset points",
        ha=side,
        fontsize=9.5,
        color=colour,
    )


def _cycled(count: int) -> list[str]:
    """Return so many colours, slow to fast."""
    return [_SPEEDS[place % len(_SPEEDS)] for place in range(count)]


def _touching(chosen: np.ndarray) -> np.ndarray:
    """Return what is chosen and the neighbour before it, so that two parts of a curve meet."""
    return np.asarray(chosen | np.append(chosen[1:], False))
