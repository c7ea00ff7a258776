"""The optimal set-ups of Table 4.2 as a picture: each parameter, row by row, beside the thesis's."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .adjustments import BALANCE, find
from .style import BLACK, FRONT, FULL, GREY, HOLLOW, REAR, picture, styled

Axle = Literal["front", "rear", ""]

_AXLES: Final[Mapping[Axle, tuple[str, float]]] = {
    "front": (FRONT, -0.16),
    "rear": (REAR, 0.16),
    "": (BLACK, 0.0),
}
"""Colour of an axle, and how far its marks stand beside the place of their row."""

_PANELS: Final[Mapping[str, Mapping[Axle, str]]] = {
    "ride height": {"front": "dh_f", "rear": "dh_r"},
    "heave stiffness": {"front": "dK_h_front", "rear": "dK_h_rear"},
    "fixed balance": {"": BALANCE},
    "side-slip sensitivity": {"front": "dC_L_front_beta2", "rear": "dC_L_rear_beta2"},
    "steer sensitivity": {"front": "dC_L_front_delta2", "rear": "dC_L_rear_delta2"},
    "roll sensitivity": {"front": "dC_L_front_phi2", "rear": "dC_L_rear_phi2"},
}
"""What Table 4.2 adjusts, by panel and axle."""


@dataclass(frozen=True)
class Offset:
    """A set-up parameter of Table 4.2: its optimal values, row by row.

    Attributes
    ----------
    panel : str
        What is offset; front and rear of one thing share a panel by sharing this text.
    axle : {"front", "rear", ""}
        The axle, or nothing where there is none.
    unit : str
        Unit of bound and values, empty if there is none.
    bound : float
        Largest size of the offset that the problem allows.
    thesis, ours : mapping of str to float
        Row to optimal value.
    """

    panel: str
    axle: Axle
    unit: str
    bound: float
    thesis: Mapping[str, float]
    ours: Mapping[str, float]

    def __post_init__(self) -> None:
        """Refuse a bound that is none, and values that are none."""
        what = f"{self.panel} {self.axle}".strip()
        if not (math.isfinite(self.bound) and self.bound > 0.0):
            raise ValueError(f"the bound of {what} is {self.bound!r}; it must be a positive number")
        for row, value in [*self.thesis.items(), *self.ours.items()]:
            if not math.isfinite(value):
                raise ValueError(f"{what} of row {row} is {value!r}; it must be a number")


def offsets_of_table(
    thesis: Mapping[str, Mapping[str, float]], ours: Mapping[str, Mapping[str, float]]
) -> list[Offset]:
    """The parameters of Table 4.2 with its bounds, in the units that it prints.

    Parameters
    ----------
    thesis, ours : mapping of str to mapping
        Row to optimal adjustments by name, SI, such as `minimum_time.Lap.adjustments`; what the thesis does
        not adjust in a row is left out.

    Returns
    -------
    list of Offset

    Raises
    ------
    KeyError
        If ours has not what the thesis adjusts.
    """
    offsets = []
    for panel, members in _PANELS.items():
        for axle, name in members.items():
            one = find(name)
            there = [row for row, adjusted in thesis.items() if name in adjusted]
            if there:
                unit = one.shown_in or one.unit.removeprefix("-")  # "-" is the unit of a pure number
                values = [{row: one.factor * by[row][name] for row in there} for by in (thesis, ours)]
                offsets.append(Offset(panel, axle, unit, one.factor * one.bound, *values))
    return offsets


@styled
def optimal_offsets(offsets: Sequence[Offset]) -> Figure:
    """Optimal set-up parameters of Table 4.2, by row, as shares of their bounds.

    Parameters
    ----------
    offsets : sequence of Offset
        Parameters in the order of their panels.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each thing that is offset: circles are the thesis's, dots ours; front blue, rear red.

    Raises
    ------
    ValueError
        If there is no parameter.
    """
    if not offsets:
        raise ValueError("there is no set-up parameter to draw")
    panels: dict[str, list[Offset]] = {}
    for offset in offsets:
        panels.setdefault(offset.panel, []).append(offset)
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    figure = picture(0.6 + 1.75 * lines)
    grid = figure.subplots(lines, columns, squeeze=False, sharey=True).ravel()
    for axes, (name, members) in zip(grid, panels.items(), strict=False):
        _panel(axes, name, members)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    shares = [
        value / each.bound for each in offsets for value in (*each.thesis.values(), *each.ours.values())
    ]
    reach = 1.18 * max(1.0, *(abs(share) for share in shares))
    grid[0].set_ylim(-reach, reach)
    figure.supylabel("share of the bound (1)", fontsize=11.0)
    _legend_of_offsets(figure, grid[0], offsets)
    return figure


def _panel(axes: Axes, name: str, members: Sequence[Offset]) -> None:
    """Draw one panel of :func:`optimal_offsets`."""
    rows = sorted({row for offset in members for row in (*offset.thesis, *offset.ours)})
    for offset in members:
        colour, beside = _AXLES[offset.axle]
        for values, style in ((offset.thesis, HOLLOW), (offset.ours, FULL)):
            places = [rows.index(row) + beside for row in values]
            axes.plot(places, [value / offset.bound for value in values.values()], color=colour, **style)
    sizes = ", ".join(dict.fromkeys(f"±{offset.bound:g}" for offset in members))
    unit = members[0].unit
    axes.set_title(f"{name}\n{sizes}" + (f" {unit}" if unit else ""), fontsize=10.0)
    axes.set_xticks(range(len(rows)), rows)
    axes.set_xlim(-0.6, len(rows) - 0.4)
    axes.set_yticks((-1.0, 0.0, 1.0))
    axes.axhline(0.0, color=GREY, linewidth=0.9, zorder=0.8)


def _legend_of_offsets(figure: Figure, axes: Axes, offsets: Sequence[Offset]) -> None:
    """Name the axles' colours and the two marks, above all panels."""
    present = {offset.axle for offset in offsets}
    names: Sequence[tuple[Axle, str]] = (("front", "front"), ("rear", "rear"), ("", "both axles"))
    for axle, name in names:
        if axle in present:
            axes.plot([], [], color=_AXLES[axle][0], linestyle="", marker="s", markersize=6.0, label=name)
    axes.plot([], [], color=GREY, **HOLLOW, label="thesis")
    axes.plot([], [], color=GREY, **FULL, label="this run")
    figure.legend(loc="outside upper center", ncols=5)
