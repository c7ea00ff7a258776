"""The picture of the benchmark table: CPU time of every package on every problem."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from thesislib.classical.benchmarks.problems import STATEMENTS
from thesislib.classical.benchmarks.results import Results

# Okabe and Ito, so that colours stay apart for colour-blind readers; markers tell packages apart without them
STYLES = (
    ("#000000", "o"),
    ("#0072B2", "s"),
    ("#D55E00", "^"),
    ("#009E73", "D"),
    ("#CC79A7", "v"),
    ("#E69F00", "P"),
    ("#56B4E9", "X"),
)


def cpu_seconds(figure: Figure, results: Results) -> Figure:
    """Draw the CPU time of every package on every problem, on a logarithmic axis.

    A filled marker is an answer that reached tolerance and agrees with the published optimum, an empty one an
    answer that did not. Packages without an answer have no marker.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    results : Results
        What was measured.

    Raises
    ------
    ValueError
        If there are more packages than styles.
    """
    packages = list(results.packages)
    if len(packages) > len(STYLES):
        raise ValueError(f"{len(packages)} packages, but only {len(STYLES)} styles to draw them in")
    axes = figure.subplots()
    names = list(STATEMENTS)
    offsets = np.linspace(0.32, -0.32, len(packages)) if len(packages) > 1 else [0.0]
    for package, offset, (colour, marker) in zip(packages, offsets, STYLES, strict=False):
        for k, name in enumerate(names):
            row = results.row(package, name)
            if row is None or row.objective is None or not row.cpu_seconds:
                continue
            face = colour if row.is_right else "none"
            axes.plot(row.cpu_seconds, k + offset, marker, color=colour, markerfacecolor=face, markersize=6)
    axes.set_xscale("log")
    axes.set_xlabel("user CPU time, s")
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    for k in range(1, len(names)):
        axes.axhline(k - 0.5, color="0.85", linewidth=0.8)
    axes.grid(axis="x", color="0.9")
    axes.set_axisbelow(True)
    handles = [
        Line2D([], [], color=colour, marker=marker, linestyle="none", label=package)
        for package, (colour, marker) in zip(packages, STYLES, strict=False)
    ]
    handles.append(
        Line2D([], [], color="0.4", marker="o", markerfacecolor="none", linestyle="none", label="not right")
    )
    figure.legend(handles=handles, loc="outside right upper", frameon=False, fontsize="small")
    return figure
