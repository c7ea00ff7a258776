"""What a chapter shows, as data: figures' series, tables' columns, values, and its solves.

A record is written beside the page so that every number on it can be checked later. Numbers are kept
in full double precision; nothing is rounded.
"""

from __future__ import annotations

import csv
import io
import os
import re
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from thesislib import provenance
from thesislib.companion import documents, pages, pictures
from thesislib.companion.quantities import (
    RecordError,
    Series,
    Solved,
    checked_unit,
    column_entry,
    real_number,
    solve_entry,
)

__all__ = ["Record", "RecordError", "Series"]

_NUMBER_OR_SLUG = re.compile(r"[0-9A-Z]+\.[0-9]+[a-z]?|[a-z][a-z0-9_-]*")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*")


class Record:
    """The record of one run of a chapter.

    In a run the record goes to the folder the runner names in ``THESIS_RUN_DIR``; in a plain Jupyter
    session to ``_build/interactive/<chapter>``, where a cell that is executed again replaces what it
    recorded before. Each call writes the whole record, so that what exists is on disk.

    Parameters
    ----------
    chapter : str
        Id of the chapter, ``"04"``.

    Raises
    ------
    RecordError
        If this is a run of another chapter.
    """

    def __init__(self, chapter: str) -> None:
        running = os.environ.get("THESIS_CHAPTER")
        if running is not None and running != chapter:
            raise RecordError(f"This is a run of chapter {running!r}, and it opens a record of {chapter!r}.")
        self.chapter = chapter
        folder = os.environ.get("THESIS_RUN_DIR")
        self._in_a_run = folder is not None
        self.root = provenance.project_root()
        self.folder = Path(folder) if folder else self.root / "_build" / "interactive" / chapter
        self.started = float(os.environ.get("THESIS_STARTED", time.time()))
        self.content: dict[str, Any] = {"figures": {}, "tables": {}, "values": {}, "solves": []}
        self._save()

    def figure(self, number: str, fig: Any = None, *, series: Mapping[str, Series]) -> None:
        """Record a figure: its curves and, if it was drawn with matplotlib, its picture.

        Parameters
        ----------
        number : str
            The thesis's number, ``"4.7"``, or a slug for a figure that is ours alone.
        fig : matplotlib.figure.Figure, optional
            The drawn figure; saved as PNG and refused if it is blank.
        series : mapping of str to Series
            The curves by name; empty for a drawing without data.

        Raises
        ------
        RecordError
            If the number or a name is malformed or already taken, a series cannot be recorded, the
            figure is blank, or there is neither a figure nor a series.
        """
        self._new("figures", number, _NUMBER_OR_SLUG, "figure")
        if fig is None and not series:
            raise RecordError(f"Figure {number} has neither a picture nor a series.")
        entries, picture = {}, None
        for name, curve in series.items():
            place = f"Figure {number}, series {name}"
            _check_name(name, _NAME, place)
            if name == "picture":
                raise RecordError(f"{place} has a name that is kept for the figure's picture.")
            if not isinstance(curve, Series):
                raise RecordError(f"{place} is a {type(curve).__name__}, not a Series.")
            entries[name] = curve.entry(place)
        if fig is not None:
            picture = f"figure_{number}.png"
            pictures.save(fig, self.folder / picture, f"Figure {number}")
        self.content["figures"][number] = {"series": entries} | ({"picture": picture} if picture else {})
        for name, entry in entries.items():
            header = [f"abscissa [{entry['abscissa_unit']}]", f"{name} [{entry['unit']}]"]
            rows = zip(entry["abscissa"], entry["ordinate"], strict=True)
            self._write_csv(f"figure_{number}_{name}.csv", header, rows)
        self._save()

    def table(self, number: str, columns: Mapping[str, tuple[Sequence[Any] | ArrayLike, str]]) -> None:
        """Record a table.

        Parameters
        ----------
        number : str
            The thesis's number, ``"4.1"``, or a slug for a table that is ours alone.
        columns : mapping of str to (values, unit)
            Columns of equal length; values are all numbers or all strings.

        Raises
        ------
        RecordError
            If the number or a name is malformed or already taken, or the columns are not as above.
        """
        self._new("tables", number, _NUMBER_OR_SLUG, "table")
        if not columns:
            raise RecordError(f"Table {number} has no columns.")
        entries = {}
        for name, (values, unit) in columns.items():
            place = f"Table {number}, column {name}"
            _check_name(name, _NAME, place)
            entries[name] = column_entry(values, unit, place)
        lengths = {name: len(entry["values"]) for name, entry in entries.items()}
        if len(set(lengths.values())) > 1:
            said = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise RecordError(f"Table {number} has columns of different lengths: {said}.")
        self.content["tables"][number] = {"columns": entries}
        header = [f"{name} [{entry['unit']}]" for name, entry in entries.items()]
        rows = zip(*(entry["values"] for entry in entries.values()), strict=True)
        self._write_csv(f"table_{number}.csv", header, rows)
        self._save()

    def value(self, name: str, value: float, unit: str) -> None:
        """Record one number.

        Raises
        ------
        RecordError
            If the name is malformed or already taken, or the value is not a finite number.
        """
        self._new("values", name, _NAME, "value")
        place = f"Value {name}"
        self.content["values"][name] = {
            "value": real_number(value, place),
            "unit": checked_unit(unit, place),
        }
        self._save()

    def solve(self, name: str, solution: Solved, *, stored: bool = False) -> None:
        """Record how a problem was solved.

        Parameters
        ----------
        name : str
            Name of the solve, different from the other solves'.
        solution : object with a method ``summary()``
            See ``solves`` in ``docs/record-schema.json``.
        stored : bool
            Whether the solution was read rather than computed, unless the summary says so itself.

        Raises
        ------
        RecordError
            If the name is taken or the summary has not the documented entries.
        """
        taken = [solve["name"] for solve in self.content["solves"]]
        if name in taken and self._in_a_run:
            raise RecordError(f"The solve {name!r} is recorded twice.")
        entry = {"name": name, **solve_entry({"stored": stored, **solution.summary()}, name)}
        self.content["solves"] = [each for each in self.content["solves"] if each["name"] != name] + [entry]
        self._save()

    def compare(self, names: Sequence[str]) -> pages.Table:
        """Return the table "thesis / this run / difference / within" of recorded values.

        Parameters
        ----------
        names : sequence of str
            Names of recorded values that ``data/thesis/<chapter>.json`` has as well.
        """
        return pages.comparison(self.root, self.chapter, self.content["values"], names)

    def stamp(self) -> pages.Table:
        """Return the run's stamp: versions, time and memory so far, and how each problem was solved."""
        return pages.stamp(self.content["solves"], self.started)

    def _new(self, kind: str, name: str, pattern: re.Pattern[str], noun: str) -> None:
        _check_name(name, pattern, f"A {noun}")
        if self._in_a_run and name in self.content[kind]:
            raise RecordError(f"The {noun} {name} is recorded twice.")

    def _save(self) -> None:
        status = "running" if self._in_a_run else "interactive"
        head = {"schema": documents.SCHEMA, "chapter": self.chapter, "run": {"status": status}}
        documents.write(self.folder / "record.json", head | self.content)

    def _write_csv(self, name: str, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
        text = io.StringIO(newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([repr(cell) if isinstance(cell, float) else cell for cell in row] for row in rows)
        provenance.write_atomically(self.folder / name, text.getvalue())


def _check_name(name: object, pattern: re.Pattern[str], place: str) -> None:
    if not isinstance(name, str) or not pattern.fullmatch(name):
        raise RecordError(f"{place} has the name {name!r}, which does not match {pattern.pattern}.")
