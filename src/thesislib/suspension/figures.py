"""Plots of the suspension's behaviour (figures 3.5 to 3.7 and 3.9 to 3.12, and the metamodels' errors).

Each function draws into a figure that it is given and returns it: size and resolution are the page's choice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from thesislib.suspension.dynamics import RideHistory
from thesislib.suspension.surrogate import AxleMetamodel, Sweep

Array = NDArray[np.float64]

# Okabe and Ito, which stay apart for colour-blind readers; front and rear keep theirs in the whole book
BLUE: Final = "#0072B2"
VERMILION: Final = "#D55E00"
GREEN: Final = "#009E73"
ORANGE: Final = "#E69F00"
PURPLE: Final = "#CC79A7"
GREY: Final = "#767676"
_LOAD = "vertical force on the {} tyre (kN)"


def tyre_radius(figure: Figure, load: Array, radius: Array) -> Figure:
    """Draw the loaded radius in m against the vertical tyre force in N (figure 3.5)."""
    axes = plain(figure.subplots())
    axes.plot(load / 1e3, 1e3 * radius, color=BLUE, label="loaded radius, (3.18)")
    slope = np.gradient(radius, load)[np.argmax(load)]
    line = radius.max() + slope * (load - load.max())
    axes.plot(load / 1e3, 1e3 * line, color=GREY, linestyle="dashed", label="tangent at no load")
    axes.legend(frameon=False)
    axes.set_xlabel("vertical tyre force $F_T$ (kN)")
    axes.set_ylabel("loaded radius $R_{fw}$ (mm)")
    _from_zero(axes, load)
    return figure


def wheel_angles(figure: Figure, load: Array, camber: Array, toe: Array) -> Figure:
    """Draw camber and toe of the left wheel in rad against its vertical force in N (figure 3.6)."""
    axes = plain(figure.subplots())
    axes.plot(load / 1e3, np.degrees(camber), color=BLUE, label="camber, (3.21)")
    axes.plot(load / 1e3, np.degrees(toe), color=VERMILION, linestyle="dashed", label="toe, (3.22)")
    axes.legend(frameon=False)
    axes.set_xlabel(_LOAD.format("left"))
    axes.set_ylabel("angle (°)")
    _from_zero(axes, load)
    return figure


def contact_displacement(figure: Figure, load: Array, displacement: Array) -> Figure:
    """Draw the displacement in m, shape (N, 3), of the left contact point from no load (figure 3.7)."""
    axes = plain(figure.subplots())
    styles = zip("xyz", (GREY, VERMILION, BLUE), ("dotted", "dashed", "solid"), strict=True)
    for column, (name, colour, style) in enumerate(styles):
        axes.plot(load / 1e3, 1e3 * displacement[:, column], color=colour, linestyle=style, label=f"Δ{name}")
    axes.legend(frameon=False)
    axes.set_xlabel(_LOAD.format("left"))
    axes.set_ylabel("displacement (mm)")
    _from_zero(axes, load)
    return figure


def stance_maps(figure: Figure, data: Sweep) -> Figure:
    """Draw ride height and roll angle over both loads of an axle as maps (figures 3.9 and 3.10)."""
    panels = figure.subplots(1, 2, sharey=True)
    contents = (
        ("ride height (mm)", 1e3 * data.height, "viridis"),
        ("roll angle (°)", np.degrees(data.roll), "RdBu_r"),
    )
    for axes, (name, values, colours) in zip(panels, contents, strict=True):
        around = {"vmin": -abs(values).max(), "vmax": abs(values).max()} if "roll" in name else {}
        levels = matplotlib.ticker.MaxNLocator(13).tick_values(values.min(), values.max())
        filled = axes.contourf(data.F_l / 1e3, data.F_r / 1e3, values, levels, cmap=colours, **around)
        lines = axes.contour(data.F_l / 1e3, data.F_r / 1e3, values, levels, colors="black", linewidths=0.5)
        axes.clabel(lines, levels[::2], fontsize="x-small", fmt="%g")
        figure.colorbar(filled, ax=axes, location="top", label=name, shrink=0.9, ticks=levels[::3])
        axes.set_xlabel("force on the left tyre (kN)")
        axes.set_aspect("equal")
        axes.invert_xaxis()
    panels[0].invert_yaxis()  # the panels share it
    panels[0].set_ylabel("force on the right tyre (kN)")
    return figure


def over_stiffness(
    figure: Figure,
    load: Array,
    curves: Mapping[float, Array],
    printed: Mapping[float, Array],
    labels: tuple[str, str],
) -> Figure:
    """Draw one quantity over load for several heave stiffnesses (figures 3.11 and 3.12).

    Parameters
    ----------
    load : numpy.ndarray, shape (N,)
        Vertical force, N.
    curves, printed : mapping of float to numpy.ndarray, shape (N,)
        Heave stiffness in N/m to the quantity: by the equations, drawn solid, and by Table 3.2, dashed.
    labels : pair of str
        Of the two axes.
    """
    axes = plain(figure.subplots())
    for colour, (K_h, values) in zip(_shades(len(curves)), curves.items(), strict=True):
        axes.plot(load / 1e3, values, color=colour, label=f"{K_h / 1e3:.0f} kN/m")
        axes.plot(load / 1e3, printed[K_h], color=colour, linestyle="dashed", linewidth=1.1)
    axes.plot([], [], color=GREY, linestyle="dashed", label="Table 3.2")
    axes.legend(frameon=False, title="heave spring")
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    _from_zero(axes, load)
    return figure


def table_errors(figure: Figure, data: Sweep, printed: AxleMetamodel) -> Figure:
    """Draw ride height by the equations minus by a printed table over both loads, and the table's mesh."""
    axes = figure.subplots()
    difference = 1e3 * (data.height - printed(data.F_l, data.F_r)[0])
    size = abs(difference).max()
    levels = np.linspace(-size, size, 15)
    filled = axes.contourf(data.F_l / 1e3, data.F_r / 1e3, difference, levels, cmap="RdBu_r")
    figure.colorbar(filled, ax=axes, label="mechanism minus table (mm)", format="%.2f")
    low = printed.box[0][0] / 1e3
    axes.plot([low, low, 0], [0, low, low], color="black", linestyle="dashed", label="mesh of the table")
    axes.legend(loc="lower left", framealpha=0.9, fontsize="small")
    axes.set_xlabel("force on the left tyre (kN)")
    axes.set_ylabel("force on the right tyre (kN)")
    axes.set_aspect("equal")
    axes.invert_xaxis()
    axes.invert_yaxis()
    return figure


def degree_errors(figure: Figure, degrees: Sequence[int], errors: Mapping[str, Sequence[float]]) -> Figure:
    """Draw largest errors in mm over the degree of the metamodel, one line for each kind of metamodel."""
    axes = plain(figure.subplots())
    styles = zip(
        (BLUE, VERMILION, BLUE, VERMILION), ("solid", "solid", "dashed", "dashed"), "osos", strict=True
    )
    for (name, values), (colour, style, marker) in zip(errors.items(), styles, strict=False):
        axes.semilogy(degrees, values, color=colour, linestyle=style, marker=marker, label=name)
    axes.legend(frameon=False)
    axes.set_xticks(list(degrees))
    axes.set_xlabel("degree of the polynomials")
    axes.set_ylabel("largest ride-height error (mm)")
    return figure


def conditioning(
    figure: Figure, degrees: Array, conditions: Mapping[str, Array], errors: Mapping[str, Array]
) -> Figure:
    """Draw condition numbers and relative errors of coefficients over the degree of a fit."""
    left, right = figure.subplots(1, 2)
    for axes, curves, label in (
        (left, conditions, "condition number"),
        (right, errors, "largest error of a coefficient"),
    ):
        for colour, marker, (name, values) in zip(
            (BLUE, VERMILION, GREEN), "os^", curves.items(), strict=False
        ):
            # exact zeros cannot be drawn on a logarithmic axis: rounding stands for them
            shown = np.maximum(values, 1e-18)
            plain(axes).semilogy(degrees, shown, color=colour, marker=marker, label=name)
        axes.legend(frameon=False)
        axes.set_xlabel("degree")
        axes.set_ylabel(label)
    return figure


def replayed_lap(figure: Figure, histories: Mapping[str, RideHistory]) -> Figure:
    """Draw ride heights of moving axles and at rest over time, and below them the differences."""
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for colour, (name, history) in zip((BLUE, VERMILION), histories.items(), strict=True):
        rest = 1e3 * history.equilibrium.height
        upper.plot(history.t, 1e3 * history.height, color=colour, linewidth=1.0, label=f"{name}, moving")
        upper.plot(
            history.t, rest, color="black", linestyle="dotted", linewidth=0.9, label=f"{name}, at rest"
        )
        lower.plot(history.t, 1e3 * history.height_difference, color=colour, linewidth=0.8, label=name)
    upper.legend(frameon=False, ncols=2, fontsize="small", loc="upper center", bbox_to_anchor=(0.5, 1.22))
    for axes, label in ((upper, "ride height (mm)"), (lower, "difference (mm)")):
        plain(axes)
        axes.set_ylabel(label)
    lower.set_xlabel("time (s)")
    lower.set_xlim(min(one.t[0] for one in histories.values()), max(one.t[-1] for one in histories.values()))
    return figure


def plain(axes: Axes) -> Axes:
    """Give axes the book's plain frame and grid, and return them."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#E6E6E6", linewidth=0.7)
    axes.set_axisbelow(True)
    return axes


def _from_zero(axes: Axes, load: Array) -> None:
    """Let loads grow to the right although they are negative."""
    axes.set_xlim(float(load.max()) / 1e3, float(load.min()) / 1e3)


def _shades(count: int) -> list[Any]:
    """Return colours from light to dark; the lightest still stands out on white."""
    return [matplotlib.colormaps["viridis_r"](share) for share in np.linspace(0.15, 1.0, count)]
