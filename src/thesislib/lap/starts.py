"""Every row of Table 4.2 from other starts: how far its lap time depends on where the solve begins.

An interior point method finds an optimum near its start. The rows of the page start from their parents
(`rows`); here each also starts from the lap of a car that is less alike, and cold, from a quasi-steady lap.
The study takes a quarter of an hour, so that the page shows its stored result.
"""

from __future__ import annotations

import datetime
import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from thesislib import provenance, studies
from thesislib.lap.continuation import SolvedRow, finished, solved_row
from thesislib.lap.minimum_time import minimum_lap_time
from thesislib.lap.rows import LETTERS
from thesislib.lap.setups import Setup, Solved, told
from thesislib.vehicles.parameters import unknown_name

OTHER_PARENT = {
    "A": "C", "B": "D", "C": "M", "D": "N", "E": "F", "F": "E", "G": "K", "H": "J", "I": "J",
    "J": "O", "K": "J", "L": "F", "M": "O", "N": "D", "O": "J", "P": "L", "Q": "M",
}  # fmt: skip
"""The row from whose lap each row starts a second time."""

ROUGH = 1e-3
"""State error to which a cold start is solved before its mesh is refined as a row's is."""

FILE = Path("data") / "studies" / "table_4_2_starts.json"
"""Where the study's result is kept, below the project's folder."""

CHAIN, OTHER, COLD = "its parent's lap", "another row's lap", "cold"
"""Names of the three starts."""


def study(solved: Mapping[str, SolvedRow], interval_m: float, **options: Any) -> dict[str, Any]:
    """Solve every row from two other starts.

    Parameters
    ----------
    solved : mapping of str to SolvedRow
        The rows as the page solves them, kept on disk; another start is left out where its row is not
        among them.
    interval_m : float
        Intervals of a cold solve's first mesh, m.
    **options
        Passed to `studies.run`.

    Returns
    -------
    dict
        For `write`: by row and start ``lap_time`` s, ``error``, ``iterations``, ``seconds`` of CPU time; or,
        where no lap was found, ``failed``, the reason.
    """
    others, cold = {}, {}
    letters = [letter for letter in LETTERS if letter in solved]
    for letter in letters:
        row = solved[letter]
        tolerance = row.start.tolerance
        if (other := OTHER_PARENT[letter]) in solved:
            others[f"{letter} from {other}"] = {
                "setup": row.row.setup,
                "start": solved[other].start,
                "tolerance": tolerance,
                "name": f"row {letter} from {other}",
            }
        cold[f"{letter} cold"] = {
            "setup": row.row.setup,
            "tolerance": tolerance,
            "interval_m": interval_m,
            "name": f"row {letter}, cold",
        }
    results, failures = _results(others, solved_row, options)
    for more, into in zip(_results(cold, cold_row, options), (results, failures), strict=True):
        into |= more
    told_of: dict[str, dict[str, Any]] = {}
    for letter in letters:
        row = solved[letter]
        entries: dict[str, Any] = {CHAIN: _entry(row.solved.summary(), row.lap_time, row.error)}
        for start, case in ((OTHER, f"{letter} from {OTHER_PARENT[letter]}"), (COLD, f"{letter} cold")):
            if case in failures:
                entries[start] = {"failed": failures[case].strip().splitlines()[-1][:300]}
            elif case in results:
                found = results[case]
                entries[start] = _entry(Solved.of(found).summary(), found["lap_time"], found["error"])
        told_of[letter] = entries
    return told_of


def cold_row(setup: Setup, tolerance: float, interval_m: float, name: str) -> dict[str, Any]:
    """Solve the lap of a row from a quasi-steady lap; the function of a study.

    Returns
    -------
    dict
        ``lap_time`` s, ``error``, and what `told` says of the solve.

    Raises
    ------
    ocp.SolveError
        As `minimum_lap_time` and `finished`.
    """
    rough = max(tolerance, ROUGH)
    lap = minimum_lap_time(
        setup.road(), setup.car(), tolerance=rough, interval_m=interval_m, name=name, **setup.options
    )
    last = finished(lap.solution, tolerance, name)
    solution = replace(last, history=(*lap.solution.history, *last.history))
    return {"lap_time": solution.objective, "error": solution.error, **told(solution)}


def write(rows: Mapping[str, Any], root: Path) -> Path:
    """Keep a study's result, with the day and what it was computed with, at `FILE` below `root`."""
    path = root / FILE
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {
        "study": "Table 4.2 from other starts",
        "command": "make study-table-4-2",
        "day": datetime.date.today().isoformat(),
        "source": provenance.source_hash(),
        "python": platform.python_version(),
        "casadi": version("casadi"),
        "other_parents": OTHER_PARENT,
        "rows": rows,
    }
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


@dataclass(frozen=True)
class StoredStudy:
    """The study's result as it is kept.

    Attributes
    ----------
    day : str
        When it was computed.
    casadi : str
        With which release.
    rows : mapping
        As `study` returned it.
    """

    day: str
    casadi: str
    rows: Mapping[str, Mapping[str, Mapping[str, Any]]]

    @classmethod
    def read(cls, root: Path | None = None) -> StoredStudy:
        """Read the result.

        Raises
        ------
        FileNotFoundError
            If the study has not been run; the message says how.
        """
        path = (root or provenance.project_root()) / FILE
        if not path.is_file():
            raise FileNotFoundError(f"{FILE} does not exist; `make study-table-4-2` makes it.")
        content = json.loads(path.read_text(encoding="utf-8"))
        return cls(content["day"], content["casadi"], content["rows"])

    def lap_times(self, letter: str) -> dict[str, float]:
        """Return the lap time in s from each start of a row, NaN where no lap was found.

        Raises
        ------
        KeyError
            If the study has no such row.
        """
        if letter not in self.rows:
            raise KeyError(unknown_name(letter, self.rows, "the study of Table 4.2"))
        return {
            start: float(entry.get("lap_time", float("nan"))) for start, entry in self.rows[letter].items()
        }

    def best(self, letter: str) -> float:
        """Return a row's best lap time from any start, s."""
        return min(time for time in self.lap_times(letter).values() if time == time)


def _results(
    cases: Mapping[str, Mapping[str, Any]], function: Any, options: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return results and failures: a start that leads nowhere is a result of this study."""
    try:
        return dict(studies.run(cases, function, **options)), {}
    except studies.StudyError as error:
        failures = dict(error.failures)
    left = {name: inputs for name, inputs in cases.items() if name not in failures}
    return dict(studies.run(left, function, **options)), failures


def _entry(summary: Mapping[str, Any], lap_time: Any, error: Any) -> dict[str, Any]:
    return {
        "lap_time": float(lap_time),
        "error": float(error),
        "iterations": int(summary["iterations"]),
        "seconds": round(float(summary["seconds"]), 1),
    }
