"""Colours, sizes and the few habits that every drawing of the book shares.

The colours are those of Okabe and Ito, which stay apart for colour-blind readers; front and rear,
left and right keep theirs from figure to figure. Pictures are made without pyplot, so that no figure
lives on in a global list, and they show themselves in a notebook without a back end.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any, Final

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

BLACK: Final = "#000000"
BLUE: Final = "#0072B2"
SKY: Final = "#56B4E9"
GREEN: Final = "#009E73"
ORANGE: Final = "#E69F00"
VERMILION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
GREY: Final = "#767676"
LIGHT: Final = "#D9D9D9"

FRONT: Final = BLUE
REAR: Final = VERMILION
WHEELS: Final = {"fl": BLUE, "fr": SKY, "rl": VERMILION, "rr": ORANGE}
"""Colour of each wheel: the front axle in blues, the rear axle in reds, left the darker one."""

WIDTH: Final = 6.4
"""Width of a figure in inches; with the letters below they are still 10 pixels high at 500 px."""

DPI: Final = 160
"""Pixels per inch of a figure in a page: about 1000 across, sharp on a dense screen, below 200 kB."""

SPEED_COLOURS: Final = LinearSegmentedColormap.from_list(
    "speed", ["#2B1055", BLUE, GREEN, ORANGE, "#F5D033"], N=256
)
"""Slow dark, fast light: lightness rises along the map, so that it also reads in grey."""

MPS_TO_KMH: Final = 3.6

HOLLOW: Final[Mapping[str, Any]] = {
    "linestyle": "",
    "marker": "o",
    "markersize": 8.0,
    "markerfacecolor": "none",
}
FULL: Final[Mapping[str, Any]] = {"linestyle": "", "marker": "o", "markersize": 4.5}
"""Marks of the thesis's numbers and, so that they fit inside, of this run's."""

Corner = tuple[int, float, str]
"""A corner as ``(number, distance in m, "R" or "L")``."""

styled = rc_context(
    {
        "font.size": 11.0,
        "axes.labelsize": 11.0,
        "axes.titlesize": 11.0,
        "xtick.labelsize": 10.0,
        "ytick.labelsize": 10.0,
        "legend.fontsize": 10.0,
        "legend.frameon": False,
        "legend.handlelength": 1.6,
        "legend.columnspacing": 1.2,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": "#E6E6E6",
        "grid.linewidth": 0.7,
        "lines.linewidth": 1.5,
        "figure.facecolor": "white",
    }
)
"""Decorator: draw under the book's style and leave matplotlib's own settings as they were."""


class Picture(Figure):
    """A figure that shows itself as PNG in a notebook, at :data:`DPI`, on white.

    Notebooks learn to show matplotlib's figures only when pyplot is imported; this one needs neither
    pyplot nor a back end.
    """

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=DPI)
        return buffer.getvalue()


def picture(height: float, *, width: float = WIDTH) -> Picture:
    """An empty figure whose parts find room by themselves.

    Parameters
    ----------
    height, width : float
        Size in inches.
    """
    return Picture(figsize=(width, height), layout="constrained")


def distance_axis(
    axes: Axes, length: float, corners: Sequence[Corner] | None = None, *, clear: float = 0.033
) -> None:
    """Make the abscissa of `axes` one lap of `length` metres, corner numbers on top.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes whose abscissa is the centre-line distance s in m.
    length : float
        Length of the lap in m.
    corners : sequence of (number, distance in m, direction), optional
        Corners to mark by a thin line and their number.
    clear : float
        As in :func:`corner_numbers`.
    """
    axes.set_xlim(0.0, length)
    axes.set_xlabel("distance along the centre line, s (m)")
    corner_numbers(axes, length, corners, clear=clear)


def corner_rows(
    corners: Sequence[Corner] | None, length: float, *, clear: float = 0.033
) -> list[tuple[Corner, int]]:
    """Corners in the order of the lap, each with the row, from 0, where its number has room.

    Parameters
    ----------
    corners : sequence of (number, distance in m, direction), optional
    length : float
        Length of the lap in m.
    clear : float
        Room that a number needs, as a share of the lap.

    Raises
    ------
    ValueError
        If a corner lies off the lap.
    """
    ends: list[float] = []
    rows = []
    for corner in sorted(corners or (), key=lambda corner: corner[1]):
        number, s, _ = corner
        if not 0.0 <= s <= length:
            raise ValueError(f"corner {number} lies at {s} m, outside the lap of 0 .. {length} m")
        row = next((row for row, end in enumerate(ends) if s >= end), len(ends))
        ends[row : row + 1] = [s + clear * length]
        rows.append((corner, row))
    return rows


def corner_numbers(
    axes: Axes,
    length: float,
    corners: Sequence[Corner] | None,
    *,
    labels: bool = True,
    clear: float = 0.033,
) -> None:
    """Mark corners by thin upright lines and, with `labels`, their numbers above the axes.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes whose abscissa is the centre-line distance in m.
    length : float
        Length of the lap in m.
    corners : sequence of (number, distance in m, direction), optional
    labels : bool
        Whether the numbers are written, or the lines drawn only.
    clear : float
        Room that a number needs, as a share of the lap; a number without it goes to the next row.

    Raises
    ------
    ValueError
        If a corner lies off the lap.
    """
    for (number, s, _), row in corner_rows(corners, length, clear=clear):
        axes.axvline(s, color=LIGHT, linewidth=0.7, zorder=0.5)
        if labels:
            axes.annotate(
                str(number),
                (s, 1.0),
                xycoords=axes.get_xaxis_transform(),
                xytext=(0.0, 2.0 + 10.0 * row),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=9.5,
                color=GREY,
            )


def shared_distance_axis(
    upper: Axes, lower: Axes, length: float, corners: Sequence[Corner] | None = None
) -> None:
    """Give two panels one distance axis: corner numbers and the legend of both above, the label below.

    Parameters
    ----------
    upper, lower : matplotlib.axes.Axes
    length : float
        Length of the lap in m.
    corners : sequence of (number, distance in m, direction), optional
    """
    distance_axis(upper, length, corners)
    upper.set_xlabel("")
    distance_axis(lower, length)
    corner_numbers(lower, length, corners, labels=False)
    legend_above(upper, corners=corners, also=(lower,))


def axis_on_the_right(axes: Axes, label: str, colour: str) -> Axes:
    """A second ordinate on the right, in the colour of the curve that is read on it.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes with the first ordinate; a legend above them takes the second's curves with
        :func:`legend_above`'s `also`.
    label : str
        Name and unit of the second ordinate.
    colour : str
        Colour of its curve.
    """
    right = axes.twinx()
    right.set_ylabel(label, color=colour)
    right.tick_params(axis="y", colors=colour)
    right.spines["right"].set(visible=True, color=colour)
    right.grid(visible=False)
    return right


def legend_above(
    axes: Axes,
    *,
    columns: int = 4,
    corners: Sequence[Corner] | None = None,
    above_corners: float = 1.12,
    also: Sequence[Axes] = (),
) -> None:
    """Put the legend above the axes, clear of the corner numbers, where it covers no curve.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    columns : int
        Entries side by side.
    corners : sequence of corners, optional
        Corners whose numbers stand above the axes.
    above_corners : float
        Height of the legend's foot in heights of the axes when there are corner numbers.
    also : sequence of matplotlib.axes.Axes
        Other axes whose curves the legend names too, after those of `axes`.
    """
    named = [each.get_legend_handles_labels() for each in (axes, *also)]
    axes.legend(
        [handle for handles, _ in named for handle in handles],
        [label for _, labels in named for label in labels],
        loc="lower left",
        bbox_to_anchor=(0.0, above_corners if corners else 1.0),
        ncols=columns,
        borderaxespad=0.2,
    )
