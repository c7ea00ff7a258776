"""Figures of sections 2.6.4 to 2.8: quadrature points, refinement, smoothing and singular arcs.

Each function draws into a figure that it is given and returns it: size and style are the page's choice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from thesislib.classical.palette import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION
from thesislib.classical.programme import Array

__all__ = ["histories", "points_of_rules", "refinement", "smoothed"]

_MARKED: Final = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"), (ORANGE, "D"), (SKY, "v"), (BLACK, "P"))


def points_of_rules(figure: Figure, rules: Mapping[str, tuple[Array, Array]]) -> Figure:
    """Draw figure 2.3: the points of quadrature rules on -1 .. 1, each as large as its weight.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    rules : mapping of str to (points, weights)
        Arrays of shape (N,) by name of the rule; the first is drawn on top.
    """
    axes = figure.subplots()
    heights = np.arange(len(rules))[::-1]
    for (colour, _), height, (points, weights) in zip(_MARKED, heights, rules.values(), strict=False):
        axes.axhline(height, color=GREY, linewidth=0.8, zorder=1)
        axes.scatter(points, np.full(len(points), height), s=160 * weights, color=colour, zorder=2)
    for end in (-1, 1):
        axes.axvline(end, color=GREY, linewidth=0.8, linestyle="dotted")
    axes.set_yticks(heights, list(rules))
    axes.set(xlabel="τ", ylim=(-0.6, len(rules) - 0.4))
    axes.grid(visible=False)
    return figure


def refinement(
    figure: Figure, errors: Mapping[str, tuple[Array, Array]], estimates: Mapping[str, ArrayLike]
) -> Figure:
    """Draw errors against numbers of points and, beside them, estimates against errors.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    errors : mapping of str to (points, errors)
        Arrays of shape (N,) by way of refinement.
    estimates : mapping of str to (errors, estimates)
        Shape (2, N) by problem.
    """
    left, right = figure.subplots(1, 2)
    for (colour, marker), (name, (points, error)) in zip(_MARKED, errors.items(), strict=False):
        left.loglog(points, error, marker, color=colour, linestyle="-", markersize=4, label=name)
    left.set(xlabel="collocation points", ylabel="largest error of the state")
    left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)
    for (colour, marker), (name, pair) in zip(_MARKED[3:], estimates.items(), strict=False):
        right.loglog(*np.asarray(pair), marker, color=colour, markersize=5, label=name)
    everything = np.concatenate([np.asarray(pair).ravel() for pair in estimates.values()])
    ends = np.array([everything.min(), everything.max()])
    right.loglog(ends, ends, color=GREY, linestyle="dashed", label="estimate = error")
    right.set(xlabel="largest relative error of the states", ylabel="its estimate (2.162)")
    right.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)
    return figure


def smoothed(figure: Figure, x: Array, functions: Mapping[str, tuple[Array, Array]]) -> Figure:
    """Draw a function with a corner, its smooth stand-ins, and the slopes of all.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    x : numpy.ndarray, shape (N,)
        Arguments.
    functions : mapping of str to (values, slopes)
        Arrays of shape (N,) by name; the first is the one with the corner.
    """
    axes = figure.subplots(1, 2)
    styles = [(BLACK, "--"), *((colour, "-") for colour, _ in _MARKED)]
    for (colour, dashes), (name, curves) in zip(styles, functions.items(), strict=False):
        for panel, curve in zip(axes, curves, strict=True):
            panel.plot(x, curve, dashes, color=colour, label=name)
    axes[0].set(xlabel="x", ylabel="max(x, 0)")
    axes[1].set(xlabel="x", ylabel="slope of max(x, 0)")
    axes[1].legend(loc="upper left")
    return figure


def histories(
    figure: Figure, runs: Mapping[str, Sequence[tuple[Array, Array]]], exact: tuple[Array, Array]
) -> Figure:
    """Draw a control over time, one panel for every way of solving, over the exact one.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    runs : mapping of str to sequence of (t, u)
        Times in s and thrusts in lbf at the collocation points, one pair for every phase, by name.
    exact : (t, u)
        The control to compare with, drawn grey below the others.
    """
    panels = figure.subplots(2, -(-len(runs) // 2), sharex=True, sharey=True, squeeze=False).ravel()
    for panel, (colour, marker), (name, phases) in zip(panels, _MARKED, runs.items(), strict=False):
        panel.plot(*exact, color=GREY, linewidth=3, alpha=0.35)
        for t, u in phases:
            panel.plot(t, u, marker, color=colour, markersize=2.5, linestyle="-", linewidth=0.8)
        panel.set_title(name)
    for panel in panels[-(-len(runs) // 2) :]:
        panel.set_xlabel("time t (s)")
    figure.supylabel("thrust T (lbf)", fontsize=11)
    return figure
