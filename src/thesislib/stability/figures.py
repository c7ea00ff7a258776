"""Figures of chapter 7. Each function draws into a figure that it is given and returns it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle
from numpy.typing import NDArray

from thesislib.stability.bicycle import Bicycle
from thesislib.stability.phase_plane import TrueRegion
from thesislib.stability.tyres import FIT_RANGE, Tyre

Array = NDArray[np.float64]

# Okabe and Ito, and a grey readable on white
_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9")
_BLACK, _GREY, _LIGHT = "#000000", "#767676", "#C8C8C8"


def bicycle(figure: Figure, a: float, b: float, delta: float = 0.25) -> Figure:
    """Draw the single-track car from above, to scale, with its symbols (figure 7.1)."""
    axes = figure.subplots()
    axes.plot([-b, a], [0, 0], color=_BLACK, lw=2)
    for x, angle in ((-b, 0.0), (a, delta)):
        wheel = Rectangle((x - 0.3, -0.09), 0.6, 0.18, angle=np.degrees(angle), rotation_point="center")
        wheel.set(facecolor=_LIGHT, edgecolor=_BLACK, zorder=3)
        axes.add_patch(wheel)
    axes.plot(0, 0, "o", color=_BLACK, ms=6, zorder=4)
    across = np.array([-np.sin(delta), np.cos(delta)])
    along = np.array([np.cos(delta), np.sin(delta)])
    arrows = [
        ((0, 0), (0.75, 0), "$u$", _COLOURS[0]),
        ((0, 0), (0, 0.5), "$v$", _COLOURS[0]),
        ((-b, 0), (-b, 0.6), "$F_{ry}$", _COLOURS[3]),
        ((-b, 0), (-b + 0.7, 0.0), "$F_{rx}$", _COLOURS[3]),
        ((a, 0), tuple(np.array([a, 0]) + 0.6 * across), "$F_{fy}$", _COLOURS[3]),
        ((a, 0), tuple(np.array([a, 0]) + 0.75 * along), "$F_{fx}$", _COLOURS[3]),
    ]
    for tail, head, name, colour in arrows:
        axes.add_patch(
            FancyArrowPatch(tail, head, arrowstyle="-|>", mutation_scale=12, color=colour, zorder=5)
        )
        axes.annotate(name, head, xytext=(3, 6), textcoords="offset points", color=colour)
    turn = np.linspace(-0.6, 1.0, 30)
    axes.plot(0.28 * np.cos(turn + 3.0), 0.28 * np.sin(turn + 3.0), color=_COLOURS[2])
    axes.annotate("$\\omega$", (-0.42, 0.12), color=_COLOURS[2])
    axes.annotate("$\\delta$", (a + 0.98, 0.05))
    axes.plot([a, a + 0.95], [0, 0], "--", color=_GREY, lw=0.8)
    for left, right, name in ((0, a, "$a$"), (-b, 0, "$b$")):
        axes.annotate("", (left, -0.35), (right, -0.35), arrowprops={"arrowstyle": "<->", "color": _GREY})
        axes.annotate(name, ((left + right) / 2, -0.5), ha="center")
    axes.set(xlim=(-b - 0.6, a + 1.2), ylim=(0.85, -0.65), aspect="equal")
    axes.set_xlabel("x, forward (m)")
    axes.set_ylabel("y, to the right (m)")
    axes.grid(False)
    return figure


def tyre_fits(figure: Figure, tyre: Tyre, fits: Mapping[str, Tyre], reach: float = 0.9) -> Figure:
    """Draw an axle's force with its fits, and the fits' errors below (figure 7.2)."""
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    alpha = np.linspace(-reach, reach, 601)
    dots = np.linspace(-FIT_RANGE, FIT_RANGE, 57)
    upper.plot(dots, tyre.force(dots) / 1e3, "o", color=_BLACK, ms=3, label="Magic Formula")
    for colour, (name, fit) in zip(_COLOURS, fits.items(), strict=False):
        upper.plot(alpha, fit.force(alpha) / 1e3, color=colour, label=name)
        lower.plot(alpha, (fit.force(alpha) - tyre.force(alpha)) / 1e3, color=colour)
    upper.set(ylim=(-9, 9), ylabel="front axle force $F_{fy}$ (kN)")
    lower.set(ylim=(-1.5, 1.5), ylabel="error (kN)", xlabel="slip angle α (rad)")
    for axes in (upper, lower):
        axes.axvspan(-FIT_RANGE, FIT_RANGE, color="#F2F2F2", zorder=0)
    upper.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def two_portraits(figure: Figure, model: Bicycle, full: Bicycle, limits: tuple[float, float]) -> Figure:
    """Draw a model's phase portrait, and the full car's motions dashed (figures 7.3, 7.4)."""
    axes = figure.subplots()
    v, w = limits
    portrait(axes, model, v, w)
    portrait(axes, full, v, w, colour=_COLOURS[3], dashed=True)
    for car, colour, name, size in (
        (full, _COLOURS[2], "full model", 11),
        (model, _COLOURS[4], "this model", 7),
    ):
        points = car.equilibria()
        axes.plot(*points.T, "*", color=colour, ms=size, label=f"equilibria, {name}", zorder=6)
    axes.set(xlim=(-v, v), ylim=(-w, w))
    axes.plot([], [], color=_LIGHT, label="motions, this model")
    axes.plot([], [], "--", color=_COLOURS[3], lw=0.8, label="motions, full model")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def portrait(
    axes: Axes, car: Bicycle, v: float, w: float, *, colour: str = _LIGHT, dashed: bool = False
) -> None:
    """Draw motions in the phase plane, |lateral speed| <= v in m/s and |yaw rate| <= w in rad/s."""
    grid = np.stack(np.meshgrid(np.linspace(-v, v, 61), np.linspace(-w, w, 61)), axis=-1)
    rates = car.rates(grid)
    lines = axes.streamplot(
        grid[..., 0],
        grid[..., 1],
        rates[..., 0],
        rates[..., 1],
        color=colour,
        linewidth=0.6 if dashed else 0.9,
        density=0.7 if dashed else 0.9,
        arrowsize=0.7,
        zorder=1,
    )
    if dashed:
        lines.lines.set_linestyle("--")
    _state_axes(axes)


def _state_axes(axes: Axes) -> None:
    axes.set_xlabel("lateral speed v (m/s)")
    axes.set_ylabel("yaw rate ω (rad/s)")


def regions(
    figure: Figure,
    truth: TrueRegion,
    boundaries: Mapping[str, Array],
    *,
    view: tuple[float, float] = (6.0, 1.5),
    dashed: Mapping[str, Array] | None = None,
) -> Figure:
    """Draw certified sets over the phase portrait and the true boundary (figures 7.5 to 7.7, 7.14, 7.15).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    truth : TrueRegion
    boundaries : mapping of str to array, shape (n, 2)
        Label to boundary, drawn in solid lines.
    view : tuple of float
        Half-widths of the axes, m/s and rad/s.
    dashed : mapping, optional
        Further boundaries, in dashed lines.
    """
    axes = figure.subplots()
    portrait(axes, truth.car, *view)
    true_boundary(axes, truth.manifolds, truth.saddles)
    for colour, (name, boundary) in zip(_COLOURS, boundaries.items(), strict=False):
        axes.plot(*_closed(boundary).T, color=colour, label=name, zorder=4)
    for colour, (name, boundary) in zip(_COLOURS[::-1], (dashed or {}).items(), strict=False):
        axes.plot(*_closed(boundary).T, "--", color=colour, label=name, zorder=4)
    axes.set(xlim=(-view[0], view[0]), ylim=(-view[1], view[1]))
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3)
    return figure


def true_boundary(axes: Axes, manifolds: Sequence[Array], saddles: Array) -> None:
    """Draw the saddles and their stable manifolds."""
    for k, manifold in enumerate(manifolds):
        axes.plot(*manifold.T, color=_BLACK, lw=1.2, zorder=3, label="true boundary" if k == 0 else None)
    axes.plot(*np.asarray(saddles).T, "*", color=_COLOURS[2], ms=10, zorder=6, label="saddles")


def _closed(boundary: Array) -> Array:
    return np.concatenate([boundary, boundary[:1]])


def panels(figure: Figure, cases: Mapping[str, Mapping[str, Any]], cars: Mapping[str, Bicycle]) -> Figure:
    """Draw one certified set in each panel, with portrait, true boundary and trim (figures 7.8 to 7.10)."""
    view = [
        max(1.15 * float(np.abs(case["boundary"][:, k]).max()) for case in cases.values()) for k in (0, 1)
    ]
    all_axes = np.atleast_1d(figure.subplots(1, len(cases), sharey=True))
    for k, (axes, (name, case)) in enumerate(zip(all_axes, cases.items(), strict=True)):
        portrait(axes, cars[name], *view)
        true_boundary(axes, (case["manifold_1"], case["manifold_2"]), case["saddles"])
        axes.plot(*_closed(case["boundary"]).T, color=_COLOURS[0], label="certified", zorder=4)
        axes.plot(*case["trim"], "*", color=_COLOURS[3], ms=10, zorder=6, label="trim")
        axes.set(xlim=(-view[0], view[0]), ylim=(-view[1], view[1]), title=name)
        if k:
            axes.set_ylabel("")
    figure.legend(*all_axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def overlay(figure: Figure, cases: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw several cars' certified sets and, dotted, their true boundaries (figures 7.11 to 7.13)."""
    axes = figure.subplots()
    for colour, (name, case) in zip(_COLOURS, cases.items(), strict=False):
        axes.plot(*_closed(case["boundary"]).T, color=colour, label=name, zorder=4)
        for manifold in (case["manifold_1"], case["manifold_2"]):
            axes.plot(*manifold.T, color=colour, lw=0.7, ls=":", zorder=3)
    view = [max(1.1 * float(np.abs(case["boundary"][:, k]).max()) for case in cases.values()) for k in (0, 1)]
    axes.plot([], [], ":", color=_GREY, lw=0.9, label="true boundaries")
    axes.set(xlim=(-view[0], view[0]), ylim=(-view[1], view[1]))
    _state_axes(axes)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def slip_sets(figure: Figure, boundaries: Mapping[str, Array], reach: float = 0.35) -> Figure:
    """Draw sets in slip coordinates, degrees."""
    axes = figure.subplots()
    for colour, (name, boundary) in zip(_COLOURS, boundaries.items(), strict=False):
        axes.plot(*np.degrees(_closed(boundary)).T, color=colour, label=name)
    limit = np.degrees(reach)
    axes.set(xlim=(-limit, limit), ylim=(-limit, limit))
    axes.set_xlabel("front slip $(v + a\\omega)/u_0$ (°)")
    axes.set_ylabel("rear slip $(v - b\\omega)/u_0$ (°)")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def area_maps(figure: Figure, maps: Sequence[tuple[str, str, Array, Array, Array]]) -> Figure:
    """Draw contours of the certified area, one panel for each (x label, y label, x, y, area[y, x])."""
    all_axes = np.atleast_1d(figure.subplots(1, len(maps)))
    for axes, (x_label, y_label, x, y, area) in zip(all_axes, maps, strict=True):
        filled = axes.contourf(x, y, area, levels=9, cmap="viridis")
        axes.plot(*(grid.ravel() for grid in np.meshgrid(x, y)), ".", color="white", ms=3)
        figure.colorbar(filled, ax=axes, label="certified area (m/s · rad/s)")
        axes.set(xlabel=x_label, ylabel=y_label)
    return figure


def margins(figure: Figure, cases: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw certified sets of disturbances, with the certified ellipse and the simulated one, a panel each.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    cases : mapping of str to mapping
        Title to a result of `thesislib.stability.margins.margin_case`.
    """
    all_axes = np.atleast_1d(figure.subplots(1, len(cases)))
    turn = np.linspace(0, 2 * np.pi, 181)
    for axes, (name, case) in zip(all_axes, cases.items(), strict=True):
        v, w = _closed(case["boundary"]).T
        axes.plot(v, np.degrees(w), color=_COLOURS[0], label="certified", zorder=4)
        for key, colour, dashes, label in (
            ("energy", _COLOURS[2], "-", "largest certified ellipse"),
            ("simulated_energy", _BLACK, "--", "largest ellipse by simulation"),
        ):
            ellipse = case[key] * np.cos(turn), np.degrees(case[key] / case["gyration"] * np.sin(turn))
            axes.plot(*ellipse, dashes, color=colour, label=label, zorder=3)
        axes.plot(0, 0, "*", color=_COLOURS[3], ms=9, zorder=6, label="trim")
        axes.set(title=name)
    figure.supxlabel("change of lateral speed (m/s)", fontsize="medium")
    all_axes[0].set_ylabel("change of yaw rate (°/s)")
    figure.legend(*all_axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure
