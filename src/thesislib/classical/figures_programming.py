"""Plots of section 2.2: ways to a constrained minimum, and the path that smoothed complementarity takes.

Each function draws into a figure that it is given and returns it: size and style are the page's choice.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from thesislib.classical.palette import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION
from thesislib.classical.programme import Array, Optimum, Programme

__all__ = ["central_path", "side_by_side"]

_METHODS = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"))


def side_by_side(
    figure: Figure,
    programme: Programme,
    optima: Mapping[str, Optimum],
    window: tuple[tuple[float, float], tuple[float, float]],
) -> Figure:
    """Draw a programme of two variables with the iterates of several methods, and their residuals.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    programme : Programme
        Two variables, one equality, one inequality.
    optima : mapping of str to Optimum
        At most three methods.
    window : pair of pairs of float
        Ranges of the two variables.
    """
    plane, decay = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    x, y = (np.linspace(*span, 61) for span in window)
    points = [np.array([a, b]) for b in y for a in x]
    f = np.array([programme.value(point) for point in points]).reshape(y.size, x.size)
    g, h = (
        np.array(rows).reshape(y.size, x.size)
        for rows in zip(*(np.concatenate(programme.constraints(point)) for point in points), strict=True)
    )
    plane.contour(x, y, f, levels=np.arange(0.5, 20.0, 1.0), colors=GREY, linewidths=0.5)
    plane.contourf(x, y, h, levels=[-np.inf, 0.0], colors=[SKY], alpha=0.3)
    plane.contour(x, y, g, levels=[0.0], colors=BLACK, linewidths=1.4)
    for (name, way), (colour, marker) in zip(optima.items(), _METHODS, strict=False):
        plane.plot(*way.points.T, marker + "-", color=colour, linewidth=0.9, markersize=5, label=name)
        decay.semilogy(way.residuals, marker + "-", color=colour, markersize=5, label=name)
    plane.plot(*next(iter(optima.values())).x, "*", color=BLACK, markersize=12)
    plane.set(xlabel="$x_1$", ylabel="$x_2$", xlim=window[0], ylim=window[1])
    decay.set(xlabel="iteration", ylabel="largest violation of (2.22)")
    decay.legend(loc="upper right")
    return figure


def central_path(
    figure: Figure,
    gammas: Array,
    slacks: Array,
    multipliers: Array,
    conditions: Mapping[str, Array],
    iterates: tuple[Array, Array],
) -> Figure:
    """Draw smoothed complementarity with the points of the central path, and condition numbers along it.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    gammas : numpy.ndarray, shape (G,)
        Values of the smoothing parameter of (2.30c).
    slacks, multipliers : numpy.ndarray, shape (G,)
        -h and mu on the path.
    conditions : mapping of str to numpy.ndarray, shape (G,)
        Condition numbers by name of the matrix, at most two.
    iterates : pair of numpy.ndarray, shape (K,)
        -h and mu of a method's own iterates.
    """
    left, right = figure.subplots(1, 2)
    wide, high = 1.15 * max(iterates[0].max(), slacks.max()), 1.35 * max(iterates[1].max(), multipliers.max())
    left.plot([0, 0, wide], [high, 0, 0], color=BLACK, linewidth=3.0, solid_capstyle="butt", clip_on=False)
    s = np.linspace(1e-4, wide, 2000)
    for gamma in gammas[gammas > 1e-3 * high * wide]:
        left.plot(s, gamma / s, color=GREY, linewidth=0.8)
    left.plot(slacks, multipliers, "o-", color=ORANGE, markersize=5, label="central path")
    left.plot(*iterates, "s-", color=BLUE, linewidth=0.9, markersize=4, label="iterates")
    left.set(
        xlabel="slack of the inequality, $-h$", ylabel=r"multiplier $\mu$", xlim=(0, wide), ylim=(0, high)
    )
    left.legend(loc="upper right")
    for (name, numbers), colour in zip(conditions.items(), (BLUE, VERMILION), strict=False):
        right.loglog(gammas, numbers, "o-", color=colour, markersize=4, label=name)
    right.set(xlabel=r"smoothing parameter $\gamma$", ylabel="condition number")
    right.invert_xaxis()
    right.legend(loc="upper left")
    return figure
