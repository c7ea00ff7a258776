"""Tables a chapter shows about its own run: thesis against this run, and the run's stamp."""

from __future__ import annotations

import html
import importlib.metadata
import math
import platform
import resource
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thesislib.companion import documents
from thesislib.companion.quantities import RecordError

__all__ = ["VERSIONED", "Table", "comparison", "peak_memory_mb", "stamp", "thesis_values", "versions"]

VERSIONED = ("thesislib", "casadi", "numpy", "scipy", "matplotlib")
"""Distributions whose versions a run is stamped with."""

_ENTRY = {"unit", "half_digit", "page", "place"}


@dataclass(frozen=True)
class Table:
    """A table of texts for a page.

    Attributes
    ----------
    header : tuple of str
        Column headings.
    rows : tuple of tuple of str
        Cells.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(text)}</th>" for text in self.header)
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(text)}</td>" for text in row) + "</tr>\n" for row in self.rows
        )
        return (
            '<div class="thesis-table">\n<table class="dataframe">\n'
            f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n</div>"
        )

    def _repr_markdown_(self) -> str:
        lines = [self.header, tuple("---" for _ in self.header), *self.rows]
        return "\n".join(
            "| " + " | ".join(text.replace("|", r"\|") for text in line) + " |" for line in lines
        )


def thesis_values(root: Path, chapter: str) -> dict[str, dict[str, Any]]:
    """Return the values printed in the thesis for a chapter, by name.

    Parameters
    ----------
    root : Path
        The project's root folder.
    chapter : str
        Id of the chapter.

    Raises
    ------
    RecordError
        If there is no ``data/thesis/<chapter>.json`` or an entry in it is malformed.
    """
    path = root / "data" / "thesis" / f"{chapter}.json"
    try:
        entries: dict[str, dict[str, Any]] = documents.read(path).get("values", {})
    except FileNotFoundError as error:
        raise RecordError(
            f"There are no thesis values of chapter {chapter}: {path.name} is missing."
        ) from error
    for name, entry in entries.items():
        if set(entry) - {"label"} not in ({"value"} | _ENTRY, {"low", "high"} | _ENTRY):
            raise RecordError(
                f"{path.name} has for {name} the entries {', '.join(sorted(entry))}; an entry has "
                "'value', or 'low' and 'high', and unit, half_digit, page and place, and may have a label."
            )
        if not entry["half_digit"] > 0:
            raise RecordError(f"{path.name} has for {name} half_digit = {entry['half_digit']}, not above 0.")
    return entries


def comparison(root: Path, chapter: str, recorded: Mapping[str, Any], names: Sequence[str]) -> Table:
    """Return the table "thesis / this run / difference / within" of recorded values.

    A value is within if it would be printed as the thesis prints it: its difference is at most half a
    unit of the last printed digit. Of a printed range, it is within if it lies in the range so widened.

    Parameters
    ----------
    root : Path
        The project's root folder.
    chapter : str
        Id of the chapter.
    recorded : mapping
        The record's ``values``.
    names : sequence of str
        Names that the record and ``data/thesis/<chapter>.json`` both have.

    Raises
    ------
    RecordError
        If a name is missing on either side, or the two units differ.
    """
    printed = thesis_values(root, chapter)
    rows = []
    for name in names:
        for where, known in (("this run", recorded), (f"data/thesis/{chapter}.json", printed)):
            if name not in known:
                raise RecordError(f"Value {name} is not in {where} (known: {', '.join(known) or 'none'}).")
        rows.append(_compared(name, printed[name], recorded[name]))
    return Table(("quantity", "thesis", "this run", "difference", "within", "in the thesis"), tuple(rows))


def _compared(name: str, printed: Mapping[str, Any], recorded: Mapping[str, Any]) -> tuple[str, ...]:
    unit, value, half = printed["unit"], recorded["value"], printed["half_digit"]
    if unit != recorded["unit"]:
        raise RecordError(f"Value {name} is in {recorded['unit']!r} here and in {unit!r} in the thesis.")
    low, high = (printed["low"], printed["high"]) if "low" in printed else (printed["value"],) * 2
    decimals = max(0, math.ceil(-math.log10(2 * half) - 1e-9))
    difference = value - min(max(value, low), high)
    # a value exactly half a digit away still rounds to the printed one; allow for binary fractions
    within = abs(difference) <= half * (1 + 1e-9)
    shown = f"{low:.{decimals}f}" if low == high else f"{low:.{decimals}f} to {high:.{decimals}f}"
    unit = f" {unit}" if unit else ""
    return (
        printed.get("label", name.replace("_", " ")),
        shown + unit,
        f"{value:.{decimals + 1}f}{unit}",
        f"{round(difference, decimals + 1) + 0.0:+.{decimals + 1}f}{unit}",  # no -0.00
        "yes" if within else "no",
        f"{printed['place']}, p. {printed['page']}",
    )


def versions() -> dict[str, str]:
    """Return the versions of the distributions that a result may depend on, as far as installed."""
    found = {}
    for name in VERSIONED:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def peak_memory_mb() -> float:
    """Return the peak resident memory of this process so far, MB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)  # bytes there, kilobytes elsewhere


def stamp(solves: Sequence[Mapping[str, Any]], started: float) -> Table:
    """Return a run's stamp.

    Parameters
    ----------
    solves : sequence of mapping
        The record's ``solves``.
    started : float
        Start of the run, s since the epoch.
    """
    rows = [
        ("Python", platform.python_version()),
        *versions().items(),
        ("time so far", f"{time.time() - started:.1f} s"),
        ("peak memory so far", f"{peak_memory_mb():.0f} MB"),
    ]
    for solve in solves:
        origin = "stored" if solve["stored"] else f"{solve['seconds']:.1f} s"
        rows.append(
            (
                solve["name"],
                f"{solve['status']}, error estimate {solve['error_estimate']:.1e} "
                f"(tolerance {solve['tolerance']:.0e}), {solve['points']} points in {solve['intervals']} "
                f"intervals, {solve['iterations']} iterations on {solve['meshes']} meshes, {origin}",
            )
        )
    return Table(("this run", ""), tuple(rows))
