"""Strokes of a technical drawing in SAE axes: x to the right, y downwards, angles clockwise.

With y downwards on the page, the page itself is the ground seen from above with z into the page, and
an angle drawn from x towards y is positive, as a right-hand turn is.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, Polygon

from .channels import Array
from .style import BLACK, WIDTH, Picture

Point = tuple[float, float]


def sheet(x: tuple[float, float], y: tuple[float, float]) -> tuple[Picture, Axes]:
    """An empty drawing of the page's width: x from left to right, y from top to bottom.

    Parameters
    ----------
    x, y : (float, float)
        Ranges of the drawing, in units of its own.
    """
    figure = Picture(figsize=(WIDTH, WIDTH * (y[1] - y[0]) / (x[1] - x[0])))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(*x)
    axes.set_ylim(y[1], y[0])
    axes.set_aspect("equal")
    return figure, axes


def away(start: Point, angle: float, distance: float, sideways: float = 0.0) -> Point:
    """The point at a distance along `angle` (rad, clockwise from x) and `sideways` to its right."""
    along, across = np.cos(angle), np.sin(angle)
    return (
        start[0] + float(distance * along - sideways * across),
        start[1] + float(distance * across + sideways * along),
    )


def arrow(
    axes: Axes,
    tail: Point,
    tip: Point,
    *,
    colour: str = BLACK,
    width: float = 1.6,
    ends: str = "-|>",
    dashed: bool = False,
) -> None:
    """Draw a straight arrow; `ends` is matplotlib's arrow style, ``<|-|>`` for a dimension."""
    axes.add_patch(
        FancyArrowPatch(
            tail,
            tip,
            arrowstyle=ends,
            mutation_scale=6.0 + 4.0 * width,
            shrinkA=0.0,
            shrinkB=0.0,
            color=colour,
            linewidth=width,
            linestyle="--" if dashed else "-",
            zorder=4,
        )
    )


def stroke(axes: Axes, *points: Point, colour: str = BLACK, width: float = 0.9, style: str = "-") -> None:
    """Draw a thin line through points."""
    x, y = zip(*points, strict=True)
    axes.plot(x, y, color=colour, linewidth=width, linestyle=style, zorder=2)


def name(axes: Axes, at: Point, text: str, *, colour: str = BLACK, size: float = 12.0) -> None:
    """Write a symbol or a word, on a white ground so that no line runs through it."""
    axes.annotate(
        text,
        at,
        ha="center",
        va="center",
        color=colour,
        fontsize=size,
        zorder=6,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.8},
    )


def dimension(axes: Axes, start: Point, end: Point, text: str, *, colour: str = BLACK) -> None:
    """Draw a dimension between two points, its symbol in the middle."""
    arrow(axes, start, end, ends="<|-|>", width=0.9, colour=colour)
    name(axes, (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])), text, colour=colour)


def arc_points(centre: Point, radius: float, start: float, end: float) -> Array:
    """Points (80, 2) of a circular arc; angles in rad, clockwise from x."""
    angles = np.linspace(start, end, 80)
    return np.column_stack((centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)))


def angle(
    axes: Axes,
    centre: Point,
    radius: float,
    start: float,
    end: float,
    text: str,
    *,
    colour: str = BLACK,
    clear: float = 0.25,
) -> None:
    """Draw an angle as an arc with its arrow at the end, its symbol `clear` outside the arc."""
    points = arc_points(centre, radius, start, end)
    axes.plot(points[:-6, 0], points[:-6, 1], color=colour, linewidth=1.2, zorder=3)
    tail, tip = (float(points[-8, 0]), float(points[-8, 1])), (float(points[-1, 0]), float(points[-1, 1]))
    arrow(axes, tail, tip, colour=colour, width=1.0)
    name(axes, away(centre, 0.5 * (start + end), radius + clear), text, colour=colour)


def block(axes: Axes, centre: Point, length: float, width: float, heading: float, *, fill: str) -> None:
    """Draw a rectangle seen from above, `length` along its heading."""
    corners = [
        away(centre, heading, 0.5 * length * forward, 0.5 * width * right)
        for forward, right in ((1, 1), (1, -1), (-1, -1), (-1, 1))
    ]
    axes.add_patch(Polygon(corners, facecolor=fill, edgecolor=BLACK, linewidth=1.0, zorder=2))


def into_page(axes: Axes, at: Point, text: str, *, shift: Point) -> None:
    """Draw an axis that points into the page: a circled cross, its symbol shifted aside."""
    axes.plot(*at, "o", color=BLACK, markerfacecolor="white", markersize=11.0, zorder=5)
    axes.plot(*at, "x", color=BLACK, markersize=7.0, zorder=6)
    name(axes, (at[0] + shift[0], at[1] + shift[1]), text)
