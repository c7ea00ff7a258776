"""Every row of Table 4.2 from other starts: how far its lap time depends on where the solve begins.

An interior point method finds an optimum near its start. The rows of the page start from their parents
(`rows`); here each also starts from the lap of a car that is less alike, and cold, from a quasi-steady lap.
Each start ends on a mesh of its own. Where one is faster than the page's lap, the page's lap is therefore
solved again on the faster one's mesh, refined where that mesh does not resolve it: if it is as fast there,
the meshes differ and not the optima. The study takes an hour, so that the page shows its stored result.
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

import numpy as np

from thesislib import ocp, provenance, studies
from thesislib.lap.continuation import POLISHED, SolvedRow, finished, in_store, solved_row
from thesislib.lap.minimum_time import minimum_lap_time
from thesislib.lap.rows import LETTERS
from thesislib.lap.setups import Setup, Solved, Start
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

STARTS = (CHAIN, OTHER, COLD)

ON_BEST_MESH = "its parent's lap, on the mesh of the best"
"""Name of the page's lap solved again where another start's is faster."""

UNRESOLVED = 1.1
"""Error of a lap on another one's mesh, in errors of that lap, above which the mesh is refined."""


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
            others[_case(letter, OTHER)] = {
                "setup": row.row.setup,
                "start": solved[other].start,
                "tolerance": tolerance,
                "name": f"row {letter} from {other}",
            }
        cold[_case(letter, COLD)] = {
            "setup": row.row.setup,
            "tolerance": tolerance,
            "interval_m": interval_m,
            "name": f"row {letter}, cold",
        }
    results, failures = _results(others, solved_row, options)
    for more, into in zip(_results(cold, cold_row, options), (results, failures), strict=True):
        into |= more
    told_of = {letter: _told(letter, solved[letter], results, failures) for letter in letters}
    again = {}
    for letter in letters:
        best = _best(told_of[letter])
        if best != CHAIN:
            row = solved[letter]
            again[letter] = {
                "setup": row.row.setup,
                "start": row.start,
                "mesh": _kept(row, results[_case(letter, best)]["file"]),
                "name": f"row {letter}, on the mesh of the best",
            }
    results, failures = _results(again, on_mesh, options)
    for letter in again:
        told_of[letter][ON_BEST_MESH] = _entry(letter, results, failures)
    return told_of


def cold_row(setup: Setup, tolerance: float, interval_m: float, name: str) -> dict[str, Any]:
    """Solve the lap of a row from a quasi-steady lap; the function of a study.

    Returns
    -------
    dict
        As of `in_store`.

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
    return in_store(solution, tolerance)


def on_mesh(setup: Setup, start: Start, mesh: Start, name: str) -> dict[str, Any]:
    """Solve a lap again from itself, on another lap's mesh; the function of a study.

    Where the two laps touch a limit at different places, the mesh has its short intervals at the other lap's
    places, and an optimiser gains from the error at its own. Such a mesh is refined as a row's is.

    Parameters
    ----------
    setup : Setup
        Of both laps.
    start : Start
        The lap to begin with, on disk; its tolerance is that of a refinement.
    mesh : Start
        The lap whose mesh is taken, on disk.
    name : str
        Stands in messages.

    Returns
    -------
    dict
        As of `in_store`.

    Raises
    ------
    ocp.SolveError
        If the solver did not finish, or as `finished`.
    """
    other = mesh.lap().solution
    solution = ocp.solve(setup.problem(name), start.lap().solution, other.mesh, POLISHED)
    if solution.error > max(start.tolerance, UNRESOLVED * other.error):
        last = finished(solution, start.tolerance, name)
        solution = replace(last, history=(*solution.history, *last.history))
    return in_store(solution, start.tolerance)


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
        entries = {start: self.rows[letter][start] for start in STARTS if start in self.rows[letter]}
        return {start: float(entry.get("lap_time", float("nan"))) for start, entry in entries.items()}

    def best(self, letter: str) -> float:
        """Return a row's best lap time from any start, s."""
        return self.lap_times(letter)[_best(self.rows[letter])]

    def on_best_mesh(self, letter: str) -> float:
        """Return the lap time in s of the page's lap on the mesh of the best of a row's starts."""
        entries = self.rows[letter]
        best = _best(entries)
        return float(entries[CHAIN if best == CHAIN else ON_BEST_MESH].get("lap_time", float("nan")))


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


def _case(letter: str, start: str) -> str:
    return f"{letter} cold" if start == COLD else f"{letter} from {OTHER_PARENT[letter]}"


def _told(
    letter: str, row: SolvedRow, results: Mapping[str, Any], failures: Mapping[str, str]
) -> dict[str, Any]:
    """Return what came of a row's three starts, those left out that were not tried."""
    cases = {start: _case(letter, start) for start in (OTHER, COLD)}
    tried = {start: case for start, case in cases.items() if case in results or case in failures}
    return {CHAIN: _figures(row.solved.summary(), row.lap_time, row.error)} | {
        start: _entry(case, results, failures) for start, case in tried.items()
    }


def _entry(case: str, results: Mapping[str, Any], failures: Mapping[str, str]) -> dict[str, Any]:
    if case in failures:
        return {"failed": failures[case].strip().splitlines()[-1][:300]}
    found = results[case]
    return _figures(Solved.of(found).summary(), found["lap_time"], found["error"])


def _figures(summary: Mapping[str, Any], lap_time: Any, error: Any) -> dict[str, Any]:
    return {
        "lap_time": float(lap_time),
        "error": float(error),
        "iterations": int(summary["iterations"]),
        "seconds": round(float(summary["seconds"]), 1),
    }


def _best(entries: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the name of the start with the fastest lap."""
    return min((s for s in STARTS if "lap_time" in entries.get(s, {})), key=lambda s: entries[s]["lap_time"])


def _kept(row: SolvedRow, content: Any) -> Start:
    """Write a lap of a row beside the page's and return where it is."""
    path = Path(row.start.path)
    path = path.with_name(f"{path.stem}_best.npz")
    path.write_bytes(np.asarray(content).tobytes())
    return replace(row.start, path=str(path))
