"""Plots of section 2.1: a valley with several floors, and three ways down a curved one.

Each function draws into a figure that it is given and returns it: size and style are the page's choice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from thesislib.classical.descent import Descent
from thesislib.classical.palette import BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, SKY, VERMILION
from thesislib.classical.programme import Array, Programme

__all__ = ["Stationary", "convergence", "paths", "valley"]

_MINIMA, _MAXIMA = (SKY, GREEN, BLUE), (ORANGE, VERMILION)
_METHODS = (VERMILION, GREEN, BLUE)


class Stationary(NamedTuple):
    """A stationary point of a function of one variable: place, value, second derivative."""

    x: float
    f: float
    curvature: float

    @property
    def minimum(self) -> bool:
        """Whether (2.7) holds."""
        return self.curvature > 0.0


def valley(
    figure: Figure,
    x: Array,
    f: Array,
    stationary: Sequence[Stationary],
    starts: Array,
    ends: Mapping[str, Array],
) -> Figure:
    """Draw a function of one variable, and below it where methods end that begin at each place (figure 2.1).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    x, f : numpy.ndarray, shape (N,)
        The function.
    stationary : sequence of Stationary
        Its stationary points, at most three minima and two maxima.
    starts : numpy.ndarray, shape (S,)
        Where the methods begin.
    ends : mapping of str to numpy.ndarray of int, shape (S,)
        By method, the index of the stationary point that each start leads to; -1 for none.
    """
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1 + 0.3 * len(ends)))
    top.plot(x, f, color=BLACK)
    minima, maxima = iter(_MINIMA), iter(_MAXIMA)
    colours = [next(minima) if point.minimum else next(maxima) for point in stationary]
    lowest = min(point.f for point in stationary)
    for point, colour in zip(stationary, colours, strict=True):
        kind = "minimum" if point.minimum else "maximum"
        scope = "global " if point.f == lowest else "local "
        top.plot(point.x, point.f, "o" if point.minimum else "^", color=colour, markersize=9)
        top.annotate(
            scope + kind,
            (point.x, point.f),
            xytext=(0, -14 if point.minimum else 9),
            textcoords="offset points",
            ha="center",
            va="center",
        )
    reach = f.max() - lowest
    top.set(ylabel="f(x)", ylim=(lowest - 0.16 * reach, f.max() + 0.05 * reach))
    for row, reached in enumerate(ends.values()):
        # a start that leads nowhere stays grey
        shades = [colours[end] if end >= 0 else LIGHT for end in reached]
        bottom.vlines(starts, -row - 0.32, -row + 0.32, colors=shades, linewidth=2.6)
    bottom.set_yticks(-np.arange(len(ends)), list(ends))
    bottom.set(xlabel="x, where the method begins", ylim=(0.6 - len(ends), 0.6))
    bottom.grid(visible=False)
    return figure


def paths(
    figure: Figure,
    function: Programme,
    ways: Mapping[str, Descent],
    window: tuple[tuple[float, float], tuple[float, float]],
) -> Figure:
    """Draw the first steps of several methods on the contours of a function of two variables.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    function : Programme
        Function of two variables.
    ways : mapping of str to Descent
        At most three methods; each begins at the same point and ends in the minimum.
    window : pair of pairs of float
        Ranges of the two variables.
    """
    x, y = (np.linspace(*span, 61) for span in window)
    values = np.array([[function.value(np.array([a, b])) for a in x] for b in y])
    grid = figure.subplots(1, len(ways), sharex=True, sharey=True)
    for axes, (name, way), colour in zip(np.atleast_1d(grid), ways.items(), _METHODS, strict=False):
        axes.contour(x, y, values, levels=np.geomspace(0.02, 60.0, 9), colors=GREY, linewidths=0.6)
        axes.plot(*way.points.T, ".-", color=colour, linewidth=1.0, markersize=5)
        axes.plot(*way.points[0], "s", color=BLACK, markersize=6)
        axes.plot(*way.x, "*", color=BLACK, markersize=11)
        axes.set(xlim=window[0], ylim=window[1], xlabel="$x_1$")
        axes.set_title(f"{name}\n{way.iterations} steps", fontsize=10)
    np.atleast_1d(grid)[0].set_ylabel("$x_2$")
    return figure


def convergence(figure: Figure, errors: Mapping[str, Array], floor: float = 1e-14) -> Figure:
    """Draw errors against iterations, and each error against the one before it, with lines of two orders.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    errors : mapping of str to numpy.ndarray, shape (K + 1,)
        Distances from the solution by method, at most three.
    floor : float
        Errors below this are rounding and left out.
    """
    left, right = figure.subplots(1, 2)
    for (name, sequence), colour in zip(errors.items(), _METHODS, strict=False):
        kept = sequence[sequence > floor]
        left.loglog(np.arange(1, kept.size + 1), kept, ".-", color=colour, label=name, markersize=4)
        near = kept[kept < 0.5]
        right.loglog(near[:-1], near[1:], ".", color=colour, markersize=7, label=name)
    e = np.geomspace(1e-7, 1.0, 50)
    right.loglog(e, e, color=GREY, linewidth=0.9, linestyle="dashed", label="first order")
    right.loglog(e, e**2, color=GREY, linewidth=0.9, linestyle="dotted", label="second order")
    left.set(xlabel="iteration", ylabel=r"error $e_k = \Vert x_k - x^\ast\Vert$")
    right.set(xlabel="error $e_k$", ylabel="next error $e_{k+1}$", xlim=(1e-7, 1.0), ylim=(floor, 2.0))
    right.legend(loc="lower right", fontsize=9)
    for axis in (left.xaxis, left.yaxis, right.xaxis, right.yaxis):
        axis.set_minor_locator(NullLocator())
    return figure
