"""Measured solves of the published problems, read from the file that the benchmarks keep."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thesislib.classical.benchmarks.problems import STATEMENTS
from thesislib.provenance import project_root

SCHEMA = 1
OURS = "thesislib"


class ResultsError(ValueError):
    """A file of results that is missing or of another schema."""


@dataclass(frozen=True)
class Row:
    """One package on one problem.

    Attributes
    ----------
    package, problem : str
        Names; the problem's is a key of `STATEMENTS`.
    status : {"solved", "failed", "timeout", "not installed"}
        Whether the package says that it has reached what was asked.
    reason : str
        Why not.
    objective, error, cpu_seconds : float or None
        Optimum in the published sense, the package's own error estimate, user CPU time.
    points, intervals, meshes : int or None
        Size of the last mesh, number of meshes.
    """

    package: str
    problem: str
    status: str
    reason: str
    objective: float | None
    points: int | None
    intervals: int | None
    meshes: int | None
    error: float | None
    cpu_seconds: float | None

    @property
    def relative_error(self) -> float | None:
        """Relative distance of the objective from the published optimum, or None."""
        if self.objective is None:
            return None
        return self.objective / STATEMENTS[self.problem].published - 1

    @property
    def is_right(self) -> bool:
        """Whether the package was content and its objective agrees with the published one."""
        error = self.relative_error
        return (
            self.status == "solved" and error is not None and abs(error) <= STATEMENTS[self.problem].agreement
        )


@dataclass(frozen=True)
class Results:
    """The rows of all packages, and what they were measured with.

    Attributes
    ----------
    packages : mapping of str to mapping
        For each package its kind, versions, date and machine.
    rows : tuple of Row
        In the order of the problems, packages as in `packages`.
    """

    packages: Mapping[str, Mapping[str, Any]]
    rows: tuple[Row, ...]

    def row(self, package: str, problem: str) -> Row | None:
        """Return a row, or None if the package was not asked."""
        found = (row for row in self.rows if (row.package, row.problem) == (package, problem))
        return next(found, None)

    def ratio(self, row: Row) -> float | None:
        """Return a row's CPU time over ours on the same problem, where both have one."""
        ours = self.row(OURS, row.problem)
        if row.cpu_seconds is None or ours is None or not ours.cpu_seconds:
            return None
        return row.cpu_seconds / ours.cpu_seconds

    def fastest_adaptive(self, problem: str) -> Row | None:
        """Return the fastest right row among the peers that are adaptive and written in Python."""
        rows = (
            row
            for row in self.rows
            if row.problem == problem
            and row.package != OURS
            and self.packages[row.package]["kind"] == "adaptive"
            and row.is_right
            and row.cpu_seconds is not None
        )
        return min(rows, key=lambda row: row.cpu_seconds or math.inf, default=None)

    def columns(self) -> dict[str, list[Any]]:
        """Return the table's columns by heading, one entry per row; empty where there is none."""
        table: dict[str, list[Any]] = {name: [] for name in HEADINGS}
        for cells in self._cells():
            for name, cell in zip(HEADINGS, cells, strict=True):
                table[name].append(cell)
        return table

    def _cells(self) -> Iterator[tuple[Any, ...]]:
        for row in self.rows:
            verdict = row.status if row.status != "solved" or row.is_right else "another optimum"
            yield (
                row.problem,
                row.package,
                _shown(row.objective, ".10g"),
                _shown(row.relative_error, "+.0e"),
                _shown(row.points, "d"),
                _shown(row.intervals, "d"),
                _shown(row.meshes, "d"),
                _shown(row.error, ".0e"),
                _shown(row.cpu_seconds, ".2f"),
                _shown(self.ratio(row), ".1f"),
                verdict,
            )


HEADINGS = (
    "problem",
    "package",
    "objective",
    "relative error",
    "points",
    "intervals",
    "meshes",
    "estimate",
    "CPU s",
    "ours = 1",
    "verdict",
)


def kept_file() -> Path:
    """Return the file in which the project keeps its measurements, among the data that pages read."""
    return project_root() / "data" / "benchmarks" / "published.json"


def read(path: Path) -> Results:
    """Read results as ``benchmarks/published.py --keep`` writes them.

    Parameters
    ----------
    path : pathlib.Path
        A JSON file; its schema is in ``benchmarks/README.md``.

    Raises
    ------
    ResultsError
        If there is no such file, it has another schema, or it names an unknown problem or package.
    """
    if not path.is_file():
        raise ResultsError(f"{path.name} is not there; make bench KEEP=--keep measures it")
    content = json.loads(path.read_text(encoding="utf-8"))
    if content.get("schema") != SCHEMA:
        raise ResultsError(f"{path.name} has schema {content.get('schema')!r}, not {SCHEMA}")
    names = list(Row.__dataclass_fields__)
    rows = [Row(**{name: entry[name] for name in names}) for entry in content["rows"]]
    packages = content["packages"]
    for row in rows:
        if row.problem not in STATEMENTS:
            raise ResultsError(
                f"{path.name} names the problem {row.problem!r}; known: {', '.join(STATEMENTS)}"
            )
        if row.package not in packages:
            raise ResultsError(f"{path.name} has a row of {row.package!r}, of which it says nothing else")
    order = {name: k for k, name in enumerate(STATEMENTS)}
    place = {name: k for k, name in enumerate(packages)}
    rows.sort(key=lambda row: (order[row.problem], place[row.package]))
    return Results(packages, tuple(rows))


def _shown(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)
