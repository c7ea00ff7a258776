"""Pictures of what a lap's numbers and limits are worth: bars, maps over corners, prices along the lap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .channels import whole_lap
from .effects import Effect
from .minimum_time import Lap
from .prices import Price
from .sectors import Sector, by_sector
from .shadow_prices import ShadowPrice, touches
from .style import (
    BLACK,
    BLUE,
    GREEN,
    LIGHT,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Corner,
    corner_numbers,
    distance_axis,
    picture,
    styled,
)

# Panels of the prices along the lap: the two edges share one.
_PANELS: Final = (("power",), ("ride_height",), ("left_edge", "right_edge"), ("roll",), ("brake",))
_COLOURS: Final = {
    "power": VERMILION,
    "ride_height": BLUE,
    "left_edge": GREEN,
    "right_edge": SKY,
    "roll": PURPLE,
    "brake": ORANGE,
}


@styled
def price_bars(prices: Sequence[Price], *, most: int = 26) -> Figure:
    """What an amount of each number is worth in lap time, the dearest first.

    Parameters
    ----------
    prices : sequence of Price
    most : int
        How many are drawn, at least one.

    Raises
    ------
    ValueError
        If `most` is below one.
    """
    if most < 1:
        raise ValueError(f"most = {most}, the number of prices to draw, must be at least one")
    dearest = sorted(prices, key=lambda price: abs(price.seconds), reverse=True)[:most]
    ms = [1e3 * price.seconds for price in dearest]
    figure = picture(1.0 + 0.29 * len(dearest))
    axes = figure.add_subplot()
    bars = axes.barh(range(len(ms)), ms, color=[BLUE if value < 0.0 else VERMILION for value in ms])
    labels = [f"{value:+.1f}".replace("-", "−") for value in ms]
    axes.bar_label(bars, labels=labels, padding=3, fontsize=10)
    names = [f"{price.amount.label}, {price.amount.per}" for price in dearest]
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(axis="y", length=0.0)
    axes.invert_yaxis()
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.axvline(0.0, color=BLACK, linewidth=0.9)
    axes.grid(visible=False, axis="y")
    low, high = min(*ms, 0.0), max(*ms, 0.0)
    room = 0.3 * (high - low)  # for the numbers at the bars' ends
    axes.set_xlim(low - room * (low < 0.0), high + room * (high > 0.0))
    axes.set_xlabel("lap time (ms)")
    axes.set_title("blue: faster, red: slower", loc="right", fontsize=10, pad=2.0)
    return figure


@styled
def effect_maps(lap: Lap, effects: Sequence[Effect], sectors: Sequence[Sector]) -> Figure:
    """Where numbers act and where the time appears, corner by corner, a panel for each number.

    Parameters
    ----------
    lap : Lap
    effects : sequence of Effect
        One panel each.
    sectors : sequence of Sector
        Of the lap's corners.
    """
    figure = picture(0.7 + 1.15 * len(effects))
    panels = np.atleast_1d(figure.subplots(len(effects), 1, sharex=True))
    places = np.arange(len(sectors))
    for axes, effect in zip(panels, effects, strict=True):
        for offset, density, colour, label in (
            (-0.2, effect.acts, SKY, "where it acts"),
            (0.2, effect.appears, VERMILION, "where the time appears"),
        ):
            ms = 1e3 * by_sector(lap, density, sectors)
            axes.bar(places + offset, ms, 0.4, color=colour, label=label)
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        axes.grid(visible=False, axis="x")
        axes.set_title(f"{effect.amount.label}, {effect.amount.per}", loc="left", pad=3.0, fontsize=10.5)
        axes.set_ylabel("ms")
        axes.locator_params(axis="y", nbins=4)
    panels[-1].set_xticks(places, [str(sector.number) for sector in sectors])
    panels[-1].set_xlabel("corner, from the fastest place before it to the fastest after it")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


@styled
def price_traces(
    lap: Lap, prices: Mapping[str, ShadowPrice], corners: Sequence[Corner] | None = None
) -> Figure:
    """Shadow prices along the lap: the time that a little more of each limit would save.

    Parameters
    ----------
    lap : Lap
    prices : mapping of str to ShadowPrice
        As `shadow_prices` returns them.
    corners : sequence of (number, distance in m, direction), optional
    """
    drawn = [[name for name in names if name in prices] for names in _PANELS]
    drawn = [names for names in drawn if names]
    figure = picture(0.8 + 1.3 * len(drawn))
    panels = np.atleast_1d(figure.subplots(len(drawn), 1, sharex=True))
    for axes, names in zip(panels, drawn, strict=True):
        for name in names:
            price = prices[name]
            saved = f"{price.total:.3g}".replace("-", "−")
            label = f"{price.label}: {saved} ms per {price.amount}"
            if name.endswith("edge"):
                s, values = touches(lap, price)
                axes.vlines(s, 0.0, values, color=_COLOURS[name], linewidth=2.0, label=label)
                axes.plot(s, values, ".", color=_COLOURS[name], markersize=5.0)
                continue
            s, values = whole_lap(lap, price.density)
            axes.fill_between(s, values, color=_COLOURS[name], alpha=0.35, linewidth=0.0)
            axes.plot(s, values, color=_COLOURS[name], linewidth=1.0, label=label)
        axes.axhline(0.0, color=LIGHT, linewidth=0.8)
        edges = names[0].endswith("edge")
        unit = f"ms/{price.amount}\nat a touch" if edges else price.unit.replace("/(", "/\n(")
        axes.set_ylabel(unit, fontsize=10)
        axes.locator_params(axis="y", nbins=4)
        axes.margins(y=0.12)
        handles = [Line2D([], [], color=_COLOURS[name], linewidth=3.0) for name in names]
        texts = axes.get_legend_handles_labels()[1]
        top = 1.3 if axes is panels[0] and corners else 0.98
        axes.legend(
            handles,
            texts,
            loc="lower left",
            bbox_to_anchor=(0.0, top),
            ncols=2,
            borderaxespad=0.1,
            handlelength=1.0,
        )
        axes.set_xlim(0.0, lap.track.length)
        corner_numbers(axes, lap.track.length, corners, labels=axes is panels[0])
    distance_axis(panels[-1], lap.track.length)
    return figure
