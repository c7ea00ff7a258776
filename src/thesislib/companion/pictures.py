"""Pictures of figures: saved for the check that they are there and show something.

Pictures are never compared pixel by pixel: another release of the drawing library moves every pixel.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from thesislib import provenance
from thesislib.companion.quantities import RecordError

__all__ = ["is_blank", "save"]

_DOTS_PER_INCH = 100


def save(fig: Any, path: Path, place: str) -> None:
    """Save a matplotlib figure as PNG.

    Parameters
    ----------
    fig : matplotlib.figure.Figure
        The figure.
    path : Path
        Where to.
    place : str
        What an error calls the figure: ``"Figure 4.7"``.

    Raises
    ------
    RecordError
        If it is no matplotlib figure or shows nothing: no axes with content, or one colour only.
    """
    if not hasattr(fig, "savefig") or not hasattr(fig, "axes"):
        raise RecordError(f"{place} is a {type(fig).__name__}, not a matplotlib figure.")
    if not any(axes.has_data() or axes.texts for axes in fig.axes):
        raise RecordError(f"{place} is blank: none of its {len(fig.axes)} axes shows anything.")
    png = io.BytesIO()
    fig.savefig(png, format="png", dpi=_DOTS_PER_INCH)
    provenance.write_atomically(path, png.getvalue())
    if is_blank(path):
        raise RecordError(f"{place} is blank: its picture has one colour only.")


def is_blank(path: Path) -> bool:
    """Return whether a picture has one colour only."""
    from PIL import Image  # comes with matplotlib; a check without pictures need not load it

    with Image.open(path) as picture:
        bands = picture.convert("RGB").split()
    return all(low == high for low, high in (band.getextrema() for band in bands))
