"""Figures of sections 2.3 to 2.6: variations, the minimum principle, shooting, penalties and convergence.

Each function draws into a figure that it is given and returns it: size and style are the page's choice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from .comparison import Measurement, by_method
from .control_problem import Array
from .indirect_collocation import wall
from .indirect_shooting import Propagation
from .minimum_principle import FastestStop

# Okabe and Ito's colours, which stay apart for colour-blind readers, and a grey readable on white
BLACK: Final = "#000000"
BLUE: Final = "#0072B2"
GREEN: Final = "#009E73"
ORANGE: Final = "#E69F00"
RED: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
SKY: Final = "#56B4E9"
GREY: Final = "#767676"
MARKED: Final = (
    (BLUE, "o"),
    (RED, "s"),
    (GREEN, "^"),
    (ORANGE, "D"),
    (PURPLE, "v"),
    (SKY, "P"),
    (BLACK, "X"),
)


def growth_of_functional(
    figure: Figure, epsilon: Array, growth: Mapping[str, Array], curves: Mapping[str, tuple[Array, Array]]
) -> Figure:
    """Draw curves and, beside them, how the functional grows as each is varied (theorem 2.2).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    epsilon : numpy.ndarray, shape (N,)
        Sizes of the variation, m.
    growth : mapping of str to numpy.ndarray, shape (N,)
        Name of a curve to the change of its functional, s; drawn as absolute values.
    curves : mapping of str to (x, y)
        Name of a curve to its points in m, y downwards.
    """
    left, right = figure.subplots(1, 2)
    for (colour, _), (name, (x, y)) in zip(MARKED, curves.items(), strict=False):
        left.plot(x, y, color=colour, label=name)
    left.invert_yaxis()
    left.set(xlabel="distance x (m)", ylabel="depth y (m)")
    left.legend()
    for (colour, marker), (name, change) in zip(MARKED, growth.items(), strict=False):
        right.loglog(epsilon, np.abs(change), marker, color=colour, linestyle="-", markersize=4, label=name)
    right.set(xlabel="size of the variation, ε (m)", ylabel="change of the time, |ΔJ| (s)")
    right.legend()
    return figure


def bang_bang(figure: Figure, stop: FastestStop, t: Array, p: Array, u: Array, hamiltonian: Array) -> Figure:
    """Draw a time-optimal transfer: in the phase plane, and control, costate and Hamiltonian over time.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    stop : FastestStop
        The transfer by hand.
    t, p, u, hamiltonian : numpy.ndarray, shapes (N,), (4, N), (N,), (N,)
        The integrated one.
    """
    left, right = figure.subplots(1, 2)
    speed = np.linspace(-1, 1, 101) * 1.15 * np.max(np.abs(p[1]))
    curve = -speed * np.abs(speed) / (2 * stop.limit)
    left.plot(curve, speed, color=GREY, linestyle="--", label="switching curve")
    for sign, colour, name in ((-1, RED, "u = −u_max"), (1, BLUE, "u = +u_max")):
        held = np.sign(u) == sign
        left.plot(np.where(held, p[0], np.nan), np.where(held, p[1], np.nan), color=colour, label=name)
    left.plot(p[0, 0], p[1, 0], "o", color=BLACK)
    left.set(xlabel="position x (m)", ylabel="speed v (m/s)")
    _legend_above(left)
    right.plot(t, u, color=BLUE, drawstyle="steps-post", label="control u (m/s²)")
    right.plot(t, p[3], color=GREEN, label="costate of speed (s²/m)")
    right.plot(t, hamiltonian, color=BLACK, linestyle=":", linewidth=2.5, label="Hamiltonian")
    right.set(xlabel="time t (s)")
    _legend_above(right)
    return figure


def growth_of_errors(
    figure: Figure, t: Array, exact: Array, astray: Mapping[float, Propagation], right_one: Propagation
) -> Figure:
    """Draw what becomes of errors in the initial costate, and the transition matrix that says so.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    t, exact : numpy.ndarray, shape (N,)
        Times in s and the optimal state there.
    astray : mapping of float to Propagation
        Error of the initial costate to the trajectory with it.
    right_one : Propagation
        The trajectory without one.
    """
    left, right = figure.subplots(1, 2)
    shades = np.linspace(0.25, 1.0, len(astray))
    for (error, run), shade in zip(astray.items(), shades, strict=True):
        left.plot(run.t, run.p[0], color=(0.84 * shade, 0.37 * shade, 0.0), label=f"{error:.0e}")
    left.plot(t, exact, color=BLACK, linestyle="--", label="0")
    left.set(xlabel="time t (s)", ylabel="state x", ylim=(-1.1, 1.1))
    _legend_above(left, title="error of λ(0)", columns=3)
    stretch = np.linalg.svd(np.moveaxis(right_one.transition, 2, 0), compute_uv=False)
    right.semilogy(right_one.t, stretch[:, 0], color=RED, label="longest half-axis")
    right.semilogy(right_one.t, stretch[:, 1], color=BLUE, label="shortest half-axis")
    right.semilogy(right_one.t, stretch.prod(axis=1), color=BLACK, linestyle=":", label="their product")
    right.set(xlabel="time t (s)", ylabel="stretch of a small disc in (x, λ)")
    _legend_above(right)
    return figure


def penalties(figure: Figure, s: Array, depths: Sequence[float], n: int) -> Figure:
    """Draw figure 2.2, the penalty (2.109) for several depths.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    s : numpy.ndarray, shape (N,)
        Constrained quantity.
    depths : sequence of float
        Values of h.
    n : int
        Exponent.
    """
    axes = figure.subplots()
    for h, (colour, _), dashes in zip(depths, MARKED, ("-", "--", ":", "-."), strict=False):
        axes.plot(s, wall(s, h, n), dashes, color=colour, label=f"h = {h:g}")
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.set(xlabel="constrained quantity s", ylabel="penalty $p_b$", ylim=(0, 5))
    axes.legend(title=f"n = {n}")
    return figure


def under_the_ceiling(
    figure: Figure, t: Array, exact: Array, heights: Mapping[float, tuple[Array, Array]], ceiling: float
) -> Figure:
    """Draw heights under a ceiling that penalties of several depths hold, and their errors.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    t, exact : numpy.ndarray, shape (N,)
        Times in s and heights in m of the constrained optimum.
    heights : mapping of float to (t, x)
        Depth h in m to times and heights.
    ceiling : float
        In m.
    """
    left, right = figure.subplots(1, 2)
    left.axhline(ceiling, color=GREY, linewidth=0.8)
    left.plot(t, exact, color=BLACK, linestyle="--", label="exact")
    shown = list(heights)[:: max(1, len(heights) // 3)]
    for h, (colour, _) in zip(shown, MARKED, strict=False):
        left.plot(*heights[h], color=colour, label=f"h = {h:g} m")
    left.set(xlabel="time t (s)", ylabel="height x (m)")
    left.legend()
    miss = [np.max(np.abs(x - np.interp(times, t, exact))) for times, x in heights.values()]
    right.loglog(list(heights), miss, "o-", color=BLUE)
    right.set(xlabel="depth of the penalty, h (m)", ylabel="largest error of the height (m)")
    right.set_ylim(_whole_decades(miss))
    return figure


def convergence(
    figure: Figure, steps: ArrayLike, curves: Mapping[str, ArrayLike], *, abscissa: str, ordinate: str
) -> Figure:
    """Draw errors against numbers of steps on logarithmic axes.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    steps : array_like, shape (N,)
    curves : mapping of str to array_like, shape (N,)
        Errors by name.
    abscissa, ordinate : str
        Labels with units.
    """
    axes = figure.subplots()
    for (colour, marker), (name, error) in zip(MARKED, curves.items(), strict=False):
        axes.loglog(steps, np.asarray(error), marker, linestyle="-", color=colour, label=name)
    axes.set(xlabel=abscissa, ylabel=ordinate)
    axes.legend()
    return figure


def error_against_time(figure: Figure, measurements: Sequence[Measurement]) -> Figure:
    """Draw the state error of every method against its number of unknowns, and against CPU time.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    measurements : sequence of Measurement
        Those of one method are joined by a line.
    """
    left, right = figure.subplots(1, 2, sharey=True)
    for (colour, marker), (method, group) in zip(
        cycle(MARKED), by_method(measurements).items(), strict=False
    ):
        error = [each.state_error for each in group]
        line = {"marker": marker, "linestyle": "-", "color": colour, "markersize": 5}
        left.loglog([each.unknowns for each in group], error, **line)
        right.loglog([each.cpu_s for each in group], error, label=method, **line)
    left.set(xlabel="unknowns", ylabel="largest error of the state")
    right.set(xlabel="CPU time (s)", xlim=_whole_decades([each.cpu_s for each in measurements]))
    figure.legend(loc="outside upper center", ncols=3)
    return figure


def basin(figure: Figure, horizons: Array, offsets: Array) -> Figure:
    """Draw the largest error of a guess from which single shooting converges, against the horizon.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    horizons, offsets : numpy.ndarray, shape (N,)
        Horizons in s, and largest errors of the initial costate.
    """
    axes = figure.subplots()
    axes.semilogy(horizons, offsets, "o-", color=BLUE, label="found by trying")
    axes.semilogy(horizons, np.exp(-horizons), "--", color=BLACK, label="$e^{-t_f}$")
    axes.set(xlabel="horizon $t_f$ (s)", ylabel="largest error of the guess of λ(0)")
    axes.legend()
    return figure


def _whole_decades(values: ArrayLike) -> tuple[float, float]:
    """Return powers of ten around the values: limits at which a logarithmic axis has room for its labels."""
    logarithms = np.log10(np.asarray(values, float))
    low, high = np.floor(logarithms.min()), np.ceil(logarithms.max())
    return float(10**low), float(10 ** max(high, low + 1))


def _legend_above(axes: Axes, *, title: str | None = None, columns: int = 1) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, ncols=columns, title=title)
