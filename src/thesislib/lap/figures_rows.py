"""The rows of Table 4.2 as pictures: what each one gains, and how far that depends on the start."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from .channels import Array
from .style import (
    BLACK,
    BLUE,
    FULL,
    GREEN,
    GREY,
    HOLLOW,
    LIGHT,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    legend_above,
    picture,
    styled,
)

_STARTS: Final = (
    (BLUE, "o"),
    (ORANGE, "s"),
    (GREEN, "^"),
    (PURPLE, "D"),
    (SKY, "v"),
    (VERMILION, "P"),
)
"""Colour and marker of each start."""


@styled
def lap_times_beside_thesis(
    rows: Mapping[str, str],
    thesis_s: Mapping[str, float],
    ours_s: Mapping[str, float],
    *,
    aims_s: Mapping[str, float] | None = None,
) -> Figure:
    """Table 4.2 at a glance: each row's lap time less the baseline's, the thesis's and ours.

    On the left the differences, on the right how far ours lies from the thesis's.

    Parameters
    ----------
    rows : mapping of str to str
        Letter of each row, from top to bottom, to a few words that describe it.
    thesis_s, ours_s : mapping of str to float
        Row to lap time less that of the baseline, s; negative is faster.
    aims_s : mapping of str to float, optional
        Row to the distance in s from the thesis that is aimed at, drawn as a band on the right.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is no row, or one has no difference or one that is not finite.
    """
    for owner, differences in (("the thesis", thesis_s), ("this run", ours_s)):
        for row in rows:
            if not math.isfinite(differences.get(row, math.nan)):
                raise ValueError(f"row {row} needs a lap-time difference of {owner} that is a finite number")
    if not rows:
        raise ValueError("there is no row to draw")
    thesis = np.array([thesis_s[row] for row in rows])
    ours = np.array([ours_s[row] for row in rows])
    places = np.arange(len(rows))
    figure = picture(1.2 + 0.3 * len(rows))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.1, 1.0))
    _both_differences(left, thesis, ours)
    left.set_yticks(places, [f"{words}  {row}" for row, words in rows.items()])
    left.set_ylim(len(rows) - 0.4, -0.6)
    aims = {place: aims_s[row] for place, row in enumerate(rows) if row in aims_s} if aims_s else {}
    if aims:
        half = np.array(list(aims.values()))
        right.barh(list(aims), 2.0 * half, 0.72, -half, color=LIGHT, label="aim")
    right.plot(ours - thesis, places, color=BLUE, **FULL)
    reach = 1.2 * max(float(np.max(np.abs(ours - thesis))), *aims.values(), 1e-3)
    right.set_xlim(-reach, reach)
    right.set_xlabel("less thesis's (s)")
    for axes in (left, right):
        axes.axvline(0.0, color=GREY, linewidth=0.9, zorder=0.8)
        axes.tick_params(axis="y", length=0.0)
    legend_above(left, also=(right,))
    return figure


def _both_differences(axes: Axes, thesis: Array, ours: Array) -> None:
    """Draw the left panel of :func:`lap_times_beside_thesis`, our differences written out."""
    places = np.arange(len(ours))
    lower, upper = np.minimum(thesis, ours), np.maximum(thesis, ours)
    axes.hlines(places, lower, upper, color=GREY, linewidth=1.5)
    axes.plot(thesis, places, color=BLACK, **HOLLOW, label="thesis")
    axes.plot(ours, places, color=BLUE, **FULL, label="this run")
    for place in np.flatnonzero(ours):  # the baseline's own is nought and needs no number
        axes.annotate(
            f"{ours[place]:+.2f}".replace("-", "−"),
            (lower[place], place),
            xytext=(-8.0, 0.0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=9.5,
            color=BLUE,
        )
    span = float(upper.max() - lower.min()) or 1.0
    axes.set_xlim(lower.min() - 0.26 * span, upper.max() + 0.08 * span)
    axes.set_xlabel("lap time less row C's (s)")


@styled
def spread_of_starts(times_s: Mapping[str, Mapping[str, float]], *, linear_ms: float = 1.0) -> Figure:
    """How far the lap time of each row depends on where its solve began.

    Parameters
    ----------
    times_s : mapping of str to mapping
        Row, from top to bottom, to its starts: name of the start to lap time in s, NaN where the solver
        found no lap.
    linear_ms : float
        Excess over the row's best, in ms, up to which the scale is linear; beyond, it is logarithmic.

    Returns
    -------
    matplotlib.figure.Figure
        The excess of each start over the best of its row; a cross at the right edge is a start without lap.

    Raises
    ------
    ValueError
        If there is no row, one has no lap at all, or there are more starts than markers.
    """
    if not times_s:
        raise ValueError("there is no row to draw")
    starts = list(dict.fromkeys(start for row in times_s.values() for start in row))
    if len(starts) > len(_STARTS):
        raise ValueError(
            f"{len(starts)} starts are more than the {len(_STARTS)} that stay apart in a picture"
        )
    for row, times in times_s.items():
        if not any(math.isfinite(time) for time in times.values()):
            raise ValueError(f"row {row} has no lap from any start")
    best = {row: np.nanmin(list(times.values())) for row, times in times_s.items()}
    figure = picture(1.2 + 0.27 * len(times_s))
    axes = figure.add_subplot()
    step = 0.5 / max(len(starts), 1)
    for number, (start, (colour, marker)) in enumerate(zip(starts, _STARTS, strict=False)):
        beside = step * (number - 0.5 * (len(starts) - 1))
        own = [(place, row) for place, row in enumerate(times_s) if start in times_s[row]]
        excess = np.array([1e3 * (times_s[row][start] - best[row]) for _, row in own])
        places = np.array([place + beside for place, _ in own])
        axes.plot(excess, places, color=colour, linestyle="", marker=marker, markersize=5.5, label=start)
        failed = np.isnan(excess)
        axes.plot(
            np.full(np.count_nonzero(failed), 0.98),
            places[failed],
            color=colour,
            linestyle="",
            marker="x",
            markersize=7.0,
            markeredgewidth=1.8,
            clip_on=False,
            transform=axes.get_yaxis_transform(),
        )
    axes.set_xscale("symlog", linthresh=linear_ms)
    axes.set_xlim(left=-0.15 * linear_ms)
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.set_xlabel("lap time over the best of the row (ms)")
    axes.set_yticks(range(len(times_s)), list(times_s))
    axes.set_ylabel("row")
    axes.set_ylim(len(times_s) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0.0)
    legend_above(axes)
    return figure
