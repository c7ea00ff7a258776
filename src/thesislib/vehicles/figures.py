"""Plots of the tyre (appendix B) and of the car on a straight (appendix C).

Each function draws into a figure that it is given and returns it: size and resolution are the page's choice.
Colours run from light to dark with the plotted parameter and stay apart for colour-blind readers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

Array = NDArray[np.float64]

_PRINTED, _AT_ONE, _NOTE = "#0072B2", "#D55E00", "#767676"  # Okabe and Ito, and a grey readable on white


def longitudinal_force(
    figure: Figure, kappa: Array, by_load: Mapping[float, Array], by_angle: Mapping[float, Array], load: float
) -> Figure:
    """Draw longitudinal force against longitudinal slip: pure slip left, combined slip right (figure B.1).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    kappa : numpy.ndarray, shape (N,)
        Longitudinal slip.
    by_load : mapping of float to numpy.ndarray, shape (N,)
        Normal load in N to force in N without side slip; the lightest load gets the lightest colour.
    by_angle : mapping of float to numpy.ndarray, shape (N,)
        Slip angle in degrees to force in N; the smallest angle gets the darkest colour.
    load : float
        Normal load of the right-hand diagram, N.
    """
    left, right = figure.subplots(1, 2)
    for colour, (newtons, force) in zip(_shades(len(by_load)), by_load.items(), strict=True):
        left.plot(kappa, force / 1e3, color=colour, label=f"{newtons / 1e3:g} kN")
    for colour, (degrees, force) in zip(_shades(len(by_angle))[::-1], by_angle.items(), strict=True):
        right.plot(kappa, force / 1e3, color=colour, label=f"{degrees:g}°")
    left.legend(title="normal load", fontsize="small", frameon=False)
    right.legend(title="slip angle α", fontsize="small", frameon=False)
    left.set_title("no side slip")
    right.set_title(f"normal load {load / 1e3:g} kN")
    for axes in (left, right):
        _plain(axes)
        axes.set_xlabel("longitudinal slip κ")
        axes.set_ylabel("longitudinal force $F_x$ (kN)")
    return figure


def force_magnitude(
    figure: Figure,
    kappa: Array,
    alpha: Array,
    magnitude: Array,
    rho: Array,
    peaks: Sequence[tuple[float, str]],
) -> Figure:
    """Draw the magnitude of the combined force as a surface and as contours (figure B.2).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    kappa : numpy.ndarray, shape (K,)
        Longitudinal slip.
    alpha : numpy.ndarray, shape (A,)
        Slip angle, rad.
    magnitude, rho : numpy.ndarray, shape (A, K)
        Force in N and combined slip on the grid.
    peaks : sequence of two (float, str)
        Values of rho to draw on the contours, the first dashed, the second dotted, with their labels.
    """
    grid = figure.add_gridspec(1, 2, width_ratios=(1.0, 1.0))
    surface = figure.add_subplot(grid[0], projection="3d")
    contours = figure.add_subplot(grid[1])
    slip, degrees = np.meshgrid(kappa, np.degrees(alpha))
    surface.plot_surface(slip, degrees, magnitude / 1e3, cmap="viridis", rcount=60, ccount=60, linewidth=0)
    surface.set_xlabel("κ")
    surface.set_ylabel("α (°)")
    surface.set_box_aspect(None, zoom=1.1)
    surface.tick_params(labelsize="x-small", pad=-1)
    surface.xaxis.set_major_locator(MaxNLocator(4))
    surface.yaxis.set_major_locator(MaxNLocator(4))
    filled = contours.contourf(slip, degrees, magnitude / 1e3, levels=16, cmap="viridis")
    figure.colorbar(filled, ax=contours, label="force (kN)")
    for (value, label), style in zip(peaks, ("dashed", "dotted"), strict=True):
        contours.contour(slip, degrees, rho, levels=[value], colors="black", linestyles=style)
        contours.plot([], [], color="black", linestyle=style, label=label)
    contours.legend(fontsize="small", framealpha=0.9, loc="lower right")
    contours.set_xlabel("longitudinal slip κ")
    contours.set_ylabel("slip angle α (°)")
    return figure


def shape_factor_readings(figure: Figure, rho: Array, printed: Array, at_one: Array, peak: float) -> Figure:
    """Draw the friction curve under the two readings of the stiffness factor S (B.12), (B.13).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    rho : numpy.ndarray, shape (N,)
        Combined slip.
    printed, at_one : numpy.ndarray, shape (N,)
        Friction over its peak, sin(Q arctan(S rho)), with S as printed and with S = tan(pi/(2Q)).
    peak : float
        Combined slip at the peak of the printed reading.
    """
    axes = figure.subplots()
    _plain(axes)
    axes.plot(rho, printed, color=_PRINTED, label="$S = \\pi/(2\\,\\arctan Q)$, as printed")
    axes.plot(rho, at_one, color=_AT_ONE, label="$S = \\tan(\\pi/(2Q))$")
    for where, colour in ((peak, _PRINTED), (1.0, _AT_ONE)):
        axes.plot([where, where], [0.0, 1.0], color=colour, linestyle="dotted", linewidth=1.2)
        axes.plot([where], [1.0], color=colour, marker="o", markersize=5)
        side = "right" if where < 1.0 else "left"
        axes.annotate(
            f"peak at ρ = {where:.3f}" if where != 1.0 else "peak at ρ = 1",
            (where, 1.0),
            xytext=(-6 if side == "right" else 6, 5),
            textcoords="offset points",
            ha=side,
            color=colour,
        )
    axes.set_xlabel("combined slip ρ")
    axes.set_ylabel("friction over its peak")
    axes.set_xlim(float(rho[0]), float(rho[-1]))
    axes.set_ylim(0.0, 1.12)
    axes.legend(loc="lower right", frameon=False)
    return figure


def peak_friction(
    figure: Figure, load: Array, mu_x: Array, mu_y: Array, measured: tuple[float, float]
) -> Figure:
    """Draw peak friction coefficients and peak forces against normal load (B.3), (B.4).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    load : numpy.ndarray, shape (N,)
        Normal load, N.
    mu_x, mu_y : numpy.ndarray, shape (N,)
        Longitudinal and lateral peak friction coefficients.
    measured : tuple of float
        The two loads of the table, N; outside them the line is an extrapolation.
    """
    left, right = figure.subplots(1, 2)
    for name, mu, colour in (("longitudinal", mu_x, _PRINTED), ("lateral", mu_y, _AT_ONE)):
        left.plot(load / 1e3, mu, color=colour, label=name)
        right.plot(load / 1e3, mu * load / 1e3, color=colour, label=name)
    left.set_ylabel("peak friction coefficient")
    right.set_ylabel("peak force (kN)")
    for axes in (left, right):
        _plain(axes)
        axes.axvspan(measured[0] / 1e3, measured[1] / 1e3, color=_NOTE, alpha=0.12, linewidth=0)
        axes.set_xlabel("normal load (kN)")
        axes.set_xlim(float(load[0]) / 1e3, float(load[-1]) / 1e3)
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="lower right", frameon=False)
    return figure


def straight_line(
    figure: Figure, speed: Array, forces: Mapping[str, Array], power: Array, engine: float, weight: float
) -> Figure:
    """Draw aerodynamic forces against weight, and drag power against engine power, over speed.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    speed : numpy.ndarray, shape (N,)
        Forward speed, m/s; the axis shows km/h.
    forces : mapping of str to numpy.ndarray, shape (N,)
        Names and magnitudes in N, at most three.
    power : numpy.ndarray, shape (N,)
        Power spent on drag, W.
    engine : float
        Peak engine power, W.
    weight : float
        Weight of the car, N.
    """
    left, right = figure.subplots(1, 2)
    kmh = 3.6 * speed
    for (name, force), colour in zip(forces.items(), (_PRINTED, "#56B4E9", _AT_ONE), strict=False):
        left.plot(kmh, force / 1e3, color=colour, label=name)
    left.axhline(weight / 1e3, color=_NOTE, linestyle="dashed", label="weight")
    left.set_ylabel("force (kN)")
    right.plot(kmh, power / 1e3, color=_AT_ONE, label="drag")
    right.axhline(engine / 1e3, color=_NOTE, linestyle="dashed", label="engine")
    right.set_ylabel("power (kW)")
    for axes in (left, right):
        _plain(axes)
        axes.set_xlabel("speed (km/h)")
        axes.set_xlim(float(kmh[0]), float(kmh[-1]))
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="upper left", frameon=False)
    return figure


def _shades(count: int) -> list[Any]:
    """Return colours from light to dark; the lightest still stands out on white."""
    return [matplotlib.colormaps["viridis_r"](share) for share in np.linspace(0.15, 1.0, count)]


def _plain(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#E6E6E6", linewidth=0.7)
    axes.set_axisbelow(True)
