"""Figures 4.6 and 4.8 of the thesis: the lap on the map.

Maps are drawn in SAE ground axes, x east and y south, with y downwards: north is up.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from .channels import Array, Lap, Track, along_lap, beside, speed, whole_lap
from .style import (
    BLACK,
    GREEN,
    GREY,
    LIGHT,
    MPS_TO_KMH,
    SPEED_COLOURS,
    VERMILION,
    Corner,
    legend_above,
    picture,
    styled,
)


def ground_axes(axes: Axes) -> None:
    """Make `axes` a map in SAE ground axes with north up and one scale both ways."""
    axes.set_aspect("equal")
    if not axes.yaxis_inverted():
        axes.invert_yaxis()
    axes.set_xlabel("x, east (m)")
    axes.set_ylabel("y, south (m)")


def racing_line(lap: Lap, corners: Sequence[Corner] | None = None) -> Figure:
    """Figure 4.6: the racing line on the map, coloured by speed, with the corners' distances.

    Parameters
    ----------
    lap : Lap
    corners : sequence of (number, distance in m, direction), optional
        Corners to name, with their distance from the start line.
    """
    return coloured_line(lap, MPS_TO_KMH * speed(lap), "speed (km/h)", corners, colours=SPEED_COLOURS)


@styled
def coloured_line(
    lap: Lap,
    values: Array,
    name: str,
    corners: Sequence[Corner] | None = None,
    *,
    colours: Colormap,
    norm: Normalize | None = None,
) -> Figure:
    """The racing line on the map, coloured by a channel.

    Parameters
    ----------
    lap : Lap
    values : ndarray (N,)
        The channel at ``lap.s``.
    name : str
        Its name and unit, for the colour bar.
    corners : sequence of (number, distance in m, direction), optional
        Corners to name, with their distance from the start line.
    colours : matplotlib colour map
    norm : matplotlib norm, optional
        From the channel to the colour map; by default linear from its smallest to its largest value.
    """
    figure = picture(7.2)
    axes = figure.add_subplot()
    s = np.linspace(0.0, lap.track.length, 1500)
    axes.plot(*beside(lap.track, s, 0.0), color=LIGHT, linewidth=7.0, solid_joinstyle="round", zorder=1)
    s, n = whole_lap(lap, lap["n"])
    x, y = beside(lap.track, s, n)
    channel = whole_lap(lap, values)[1]
    points = np.column_stack((x, y))
    line = LineCollection(
        np.stack((points[:-1], points[1:]), axis=1).tolist(),
        cmap=colours,
        norm=norm,
        linewidths=3.0,
        capstyle="round",
        zorder=2,
    )
    line.set_array(0.5 * (channel[:-1] + channel[1:]))
    axes.add_collection(line)
    start = _start_line(axes, lap.track)
    ground_axes(axes)
    axes.margins(0.1)
    _corner_names(axes, lap.track, corners or (), start)
    bar = figure.colorbar(line, ax=axes, location="bottom", shrink=0.7, aspect=32, pad=0.02)
    bar.set_label(name)
    return figure


def _place(track: Track, s: float, n: float) -> Array:
    """Map coordinates (2,) of the point at s and n, in m."""
    return np.concatenate(beside(track, np.array([s]), np.array([n])))


def _start_line(axes: Axes, track: Track) -> Array:
    """Draw the start line and an arrow the way the lap is driven; return where its name stands."""
    size = 0.01 * track.length
    across = np.stack((_place(track, 0.0, -0.6 * size), _place(track, 0.0, 0.6 * size)))
    axes.plot(across[:, 0], across[:, 1], color=BLACK, linewidth=2.0, zorder=3)
    tail, tip = _place(track, 0.0, size), _place(track, 3.0 * size, size)
    ends = (float(tail[0]), float(tail[1])), (float(tip[0]), float(tip[1]))
    axes.add_patch(FancyArrowPatch(*ends, arrowstyle="-|>", mutation_scale=12, color=BLACK))
    name = _place(track, 0.0, -1.7 * size)
    axes.annotate("start", (name[0], name[1]), ha="center", va="center", fontsize=9.5)
    return name


def places_beside_road(
    track: Track,
    corners: Sequence[Corner],
    half_size: tuple[float, float],
    radii: Sequence[float],
    taken: Sequence[Array] = (),
) -> Array:
    """Choose where the names of corners stand: near them, off the road, clear of each other.

    Parameters
    ----------
    track : Track
    corners : sequence of (number, distance in m, direction)
    half_size : (float, float)
        Half of a name's width and height on the map, as shares of the lap's length.
    radii : sequence of float
        Distances from the corner to try, as shares of the lap's length.
    taken : sequence of ndarray (2,)
        Places in m that are no longer free.

    Returns
    -------
    ndarray (len(corners), 2)
        Middles of the names, x and y in m.
    """
    stations = np.linspace(0.0, track.length, 800)
    road = np.column_stack(beside(track, stations, 0.0))
    margin = 0.008 * track.length
    low, high = road.min(axis=0) - margin, road.max(axis=0) + margin
    half = np.array(half_size) * track.length
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = np.column_stack((np.cos(angles), np.sin(angles)))
    names = np.array(taken, dtype=float).reshape(-1, 2)
    for _, s, _ in corners:
        here = _place(track, s, 0.0)
        spots = np.concatenate([here + radius * track.length * ring for radius in radii])
        on_road = np.all(np.abs(road[None] - spots[:, None]) < 1.15 * half, axis=2).sum(axis=1)
        on_names = np.all(np.abs(names[None] - spots[:, None]) < 2.0 * half, axis=2).sum(axis=1)
        # a name is read with the road next to it, which must be the corner's own
        nearest = stations[np.argmin(np.linalg.norm(road[None] - spots[:, None], axis=2), axis=1)]
        apart = np.abs((nearest - s + 0.5 * track.length) % track.length - 0.5 * track.length)
        elsewhere = apart > 0.03 * track.length
        outside = np.any((spots < low) | (spots > high), axis=1)
        distance = np.linalg.norm(spots - here, axis=1) / track.length
        crowding = 2.5 * on_road + 60.0 * on_names + 30.0 * outside + 30.0 * elsewhere + 200.0 * distance
        best = spots[np.argmin(crowding)]
        names = np.vstack((names, best))
    return names[len(taken) :]


def _corner_names(axes: Axes, track: Track, corners: Sequence[Corner], start: Array) -> None:
    """Write number and distance beside each corner, tied to it by a thin line."""
    places = places_beside_road(track, corners, (0.0128, 0.0082), (0.017, 0.022, 0.028, 0.036), [start])
    for (number, s, _), (x, y) in zip(corners, places, strict=True):
        road_x, road_y = _place(track, s, 0.0)
        axes.annotate(
            f"{number}\n{s:.0f} m",
            (road_x, road_y),
            xytext=(x, y),
            ha="center",
            va="center",
            fontsize=9.5,
            linespacing=0.95,
            arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 3},
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
        )


@styled
def mesh_on_map(lap: Lap, *, from_m: float = 3000.0, to_m: float = 4500.0) -> Figure:
    """Figure 4.8: mesh and collocation points on the racing line of one part of the lap.

    Parameters
    ----------
    from_m, to_m : float
        Part of the lap, in m along the centre line.

    Raises
    ------
    ValueError
        If the part is empty or leaves the lap.
    """
    length = lap.track.length
    if not 0.0 <= from_m < to_m <= length:
        raise ValueError(f"a part of the lap from {from_m} to {to_m} m must lie within 0 .. {length} m")
    figure = picture(6.0)
    axes = figure.add_subplot()
    centre = np.linspace(from_m, to_m, 800)
    axes.plot(*beside(lap.track, centre, 0.0), color=GREEN, linewidth=1.0, label="centre line")
    inside = (lap.s >= from_m) & (lap.s <= to_m)
    axes.plot(
        *beside(lap.track, lap.s[inside], lap["n"][inside]),
        ".",
        color=BLACK,
        markersize=2.5,
        label=f"{np.count_nonzero(inside)} collocation points",
    )
    mesh = lap.mesh_points[(lap.mesh_points >= from_m) & (lap.mesh_points <= to_m)]
    axes.plot(
        *beside(lap.track, mesh, along_lap(lap, lap["n"], mesh)),
        "o",
        color=VERMILION,
        markerfacecolor="none",
        markersize=5.0,
        markeredgewidth=0.9,
        label=f"{mesh.size} mesh points",
    )
    ground_axes(axes)
    for s in np.arange(np.ceil(from_m / 250.0) * 250.0, to_m + 1.0, 250.0):
        x, y = _place(lap.track, float(s), -0.0085 * length)
        axes.annotate(f"{s:.0f} m", (float(x), float(y)), fontsize=9.5, ha="center", va="center", color=GREY)
    axes.margins(0.09)
    legend_above(axes, columns=3)
    return figure
