"""Plot of section 2.2.3: the error of a derivative against the step it was taken with."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from thesislib.classical.palette import BLACK, BLUE, GREEN, GREY, VERMILION
from thesislib.classical.programme import Array

__all__ = ["error_against_step"]

_LEAST = 2e-17  # where an error of exactly zero is drawn: below the spacing of doubles


def error_against_step(
    figure: Figure, steps: Array, errors: Mapping[str, Array], without_step: float
) -> Figure:
    """Draw relative errors of a derivative against the step, both logarithmic.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Empty figure to draw into.
    steps : numpy.ndarray, shape (N,)
        Steps.
    errors : mapping of str to numpy.ndarray, shape (N,)
        Relative errors by method, at most three.
    without_step : float
        Relative error of automatic differentiation, which has no step.
    """
    axes = figure.subplots()
    for (name, error), colour in zip(errors.items(), (VERMILION, BLUE, GREEN), strict=False):
        axes.loglog(steps, np.maximum(error, _LEAST), ".-", color=colour, linewidth=0.9, label=name)
    axes.axhline(max(without_step, _LEAST), color=BLACK, linestyle="dashed", label="automatic")
    axes.axhline(np.finfo(float).eps, color=GREY, linewidth=0.8)
    axes.annotate("spacing of doubles", (steps.max(), 1.6 * np.finfo(float).eps), color=GREY, fontsize=9)
    axes.set(xlabel="step ε", ylabel="relative error of the derivative")
    axes.invert_xaxis()
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure
