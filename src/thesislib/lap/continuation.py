"""Rows of Table 4.2 solved one from another, each kept on disk as soon as it is finished."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from thesislib import ocp, studies
from thesislib.lap.minimum_time import SETTINGS, Lap
from thesislib.lap.rows import BASE, HEIGHTS, STIFFNESSES, Row, links
from thesislib.lap.setups import Setup, Solved, Start, told
from thesislib.ocp.goal import resisting
from thesislib.ocp.storage import save

TOLERANCE = 1e-4
"""Largest relative state error of a row, before its lap time is compared."""

_ADJUSTED = "adjusted "

# Solves on the way are drafts on one mesh, whose errors the last solve refines. A row near its parent starts
# with all multipliers and a barrier that has nearly vanished. Where the car stands on the road changes which
# constraints hold along the whole lap: then the parent's multipliers mislead, and a larger barrier lets
# constraints change sides.
NEAR = replace(SETTINGS, tolerance=0.9, optimality=1e-6, draft=None)
FAR = replace(NEAR, ipopt={"mu_init": 1e-2})
# What both have of the equations keeps its multipliers; those of the rest have to be found.
OTHER_EQUATIONS = replace(NEAR, ipopt={"mu_init": 1e-4})
REFINING = replace(NEAR, meshes=6)
POLISHED = replace(NEAR, optimality=SETTINGS.optimality)

MOST_RESISTING = 12
"""Mesh intervals of a row that may stay above its tolerance after `REFINING` …"""

LARGEST_EFFECT_S = 5e-3
"""… if what their errors can be worth in lap time, s, is bounded by this in all."""


@dataclass(frozen=True)
class SolvedRow:
    """A row and its lap.

    Attributes
    ----------
    row : Row
        What was solved.
    start : Start
        Where its lap is kept.
    lap_time : float
        s.
    error : float
        Largest relative state error (2.162).
    resisting : str
        Mesh intervals whose error stayed above the row's tolerance, with a bound in s on their effect on the
        lap time; empty if there are none.
    adjustments : mapping of str to float
        What the optimiser has chosen, SI.
    solved : Solved
        How it was solved.
    stored : bool
        Whether it was found rather than computed.
    """

    row: Row
    start: Start
    lap_time: float
    error: float
    resisting: str
    adjustments: Mapping[str, float]
    solved: Solved
    stored: bool

    def lap(self) -> Lap:
        """Read the lap; raises as `Start.lap` does."""
        return self.start.lap(f"row {self.row.name}")


def solve_rows(
    rows: Mapping[str, Row], base: Start, folder: Path, *, tolerance: float = TOLERANCE, **options: Any
) -> dict[str, SolvedRow]:
    """Solve rows side by side, each as soon as its parent is solved.

    Parameters
    ----------
    rows : mapping of str to Row
        By name.
    base : Start
        The lap of row (C), kept on disk.
    folder : Path
        Where the laps of the rows are kept.
    tolerance : float
        Largest relative state error of a row.
    **options
        Passed to `studies.run`: the number of jobs, or a cluster's address.

    Returns
    -------
    dict of str to SolvedRow
        In the order of `rows`.

    Raises
    ------
    KeyError
        If a row's parent is not among them.
    studies.StudyError
        If rows failed, after all others that do not start from them are finished and kept.
    """
    folder.mkdir(parents=True, exist_ok=True)
    length = links(rows)
    ordered = sorted(rows.values(), key=lambda row: length[row.name], reverse=True)  # the longest chain first
    laps = {
        row.name: Start(row.setup, tolerance, base.interval_m, str(folder / _file(row))) for row in ordered
    }
    starts = {BASE: base, **laps}
    by_case = {f"row {row.name}": row for row in ordered}
    found: dict[str, SolvedRow] = {}

    def begun_from(parent: str) -> dict[str, dict[str, Any]]:
        return {
            case: {
                "setup": row.setup,
                "start": starts[parent],
                "tolerance": tolerance,
                "name": case,
                "steps": row.steps,
            }
            for case, row in by_case.items()
            if row.parent == parent
        }

    def keep(case: str, result: studies.Result) -> dict[str, dict[str, Any]]:
        name = by_case[case].name
        Path(laps[name].path).write_bytes(np.asarray(result["file"]).tobytes())
        found[name] = _taken(by_case[case], laps[name], result)
        return begun_from(name)

    studies.run(begun_from(BASE), solved_row, follow=keep, **options)
    return {name: found[name] for name in rows}


def _file(row: Row) -> str:
    return f"row_{re.sub('[^A-Za-z0-9]+', '_', row.name).strip('_')}.npz"


def _taken(row: Row, start: Start, result: studies.Result) -> SolvedRow:
    chosen = {
        key.removeprefix(_ADJUSTED): float(value)
        for key, value in result.items()
        if key.startswith(_ADJUSTED)
    }
    lap_time, error = float(result["lap_time"]), float(result["error"])
    kept = str(result["resisting"])
    return SolvedRow(row, start, lap_time, error, kept, chosen, Solved.of(result), result.stored)


def solved_row(
    setup: Setup,
    start: Start,
    tolerance: float,
    name: str,
    steps: Sequence[Mapping[str, float]] = (),
) -> dict[str, Any]:
    """Solve the lap of a row from its parent's lap; the function of a study.

    Parameters
    ----------
    setup : Setup
        What to solve.
    start : Start
        The parent's lap, on disk.
    tolerance : float
        Largest relative state error.
    name : str
        Stands in messages.
    steps : sequence of mappings
        As of `Row`.

    Returns
    -------
    dict
        As of `in_store`, and ``adjusted …`` for everything that was adjusted, SI.

    Raises
    ------
    ocp.SolveError
        If the solver did not finish, or the error estimate stays above tolerance in more than a few mesh
        intervals, or what they can be worth is not small.
    """
    lap = continued_row(setup, start, tolerance, name, steps)
    chosen = {_ADJUSTED + one: value for one, value in lap.adjustments.items() if one in setup.free}
    return in_store(lap.solution, tolerance) | chosen


def in_store(solution: ocp.Solution, tolerance: float) -> dict[str, Any]:
    """Return a row's solution as a study keeps it.

    Returns
    -------
    dict
        ``file``, the solution as the bytes of its file; ``lap_time`` s; ``error``; ``resisting``; and what
        `told` says of the solve.
    """
    with tempfile.TemporaryDirectory() as folder:
        content = save(solution, Path(folder) / "row.npz").read_bytes()
    return {
        "file": np.frombuffer(content, dtype=np.uint8),
        "lap_time": solution.objective,
        "error": solution.error,
        "resisting": "; ".join(map(str, resisting(solution, tolerance))),
        **told(solution),
    }


def continued_row(
    setup: Setup,
    start: Start,
    tolerance: float,
    name: str,
    steps: Sequence[Mapping[str, float]] = (),
) -> Lap:
    """Solve the lap of a row from its parent's lap; arguments and errors as of `solved_row`.

    The first solves, on the parent's mesh, go the way from one optimum to the other; the last one refines.
    """
    parent = start.lap()
    units = start.setup.units()
    solution, mesh = parent.solution, None
    if solution.tolerance < tolerance:
        mesh = ocp.coarsened(solution.mesh, solution.estimate.by_interval, tolerance)
    history: list[ocp.MeshRecord] = []
    known = {*parent.adjustments, *parent.solution.problem.names["controls"]}
    for held in (*steps, None):
        way = setup if held is None else replace(setup, free={**setup.free, **_up_to(held)})
        problem = way.problem(name if held is None else f"{name}, on the way", units=units)
        added = [q.name for q in (*problem.parameters, *problem.controls) if q.name not in known]
        values = dict.fromkeys(added, 0.0) | dict(held or {})
        settings, multipliers = (NEAR, True) if held is not None else _last_step(start.setup, setup)
        related = ocp.Related(solution, values, multipliers)
        solution = ocp.solve(problem, related, mesh, settings)
        history += solution.history
        mesh, known = None, known | set(added)
    last = finished(solution, tolerance, name)
    history += last.history
    return Lap(name, setup.road(), setup.car(), replace(last, history=tuple(history)), setup.ranges)


def finished(solution: ocp.Solution, tolerance: float, name: str) -> ocp.Solution:
    """Refine the mesh of a row's solution and solve the last mesh to the end.

    Parameters
    ----------
    solution : ocp.Solution
        Of the row's problem, on a mesh of any error.
    tolerance : float
        Largest relative state error.
    name : str
        Stands in messages.

    Returns
    -------
    ocp.Solution
        With the meshes of this refinement as its history.

    Raises
    ------
    ocp.SolveError
        As `solved_row`.
    """
    problem = solution.problem
    refined = ocp.solve(problem, solution, None, REFINING, tolerance=tolerance, accept_best=True)
    polished = ocp.solve(problem, refined, None, POLISHED)
    kept = resisting(polished, tolerance)
    if len(kept) > MOST_RESISTING or sum(each.bound for each in kept) > LARGEST_EFFECT_S:
        worst = max(kept, key=lambda each: each.error)
        raise ocp.SolveError(
            f"{name}: {len(kept)} mesh intervals stay above the tolerance of {tolerance:g} after "
            f"{len(refined.history)} meshes, the worst at s = {worst} s of lap time",
            polished,
        )
    history = (*refined.history, *polished.history)
    return replace(polished, tolerance=tolerance, history=history)


def is_far(parent: Setup, setup: Setup) -> bool:
    """Whether a set-up stands otherwise on the road than its parent, or has a wider map or another road."""
    posture = {*HEIGHTS, *STIFFNESSES} & (set(setup.free) ^ set(parent.free))
    kept = ("ranges", "edges")
    return bool(posture) or any(getattr(parent, name) != getattr(setup, name) for name in kept)


def _last_step(parent: Setup, setup: Setup) -> tuple[ocp.Settings, bool]:
    """Return how the step to the row itself is solved, and whether it starts with the multipliers."""
    far = is_far(parent, setup)
    if parent.readings != setup.readings:
        return OTHER_EQUATIONS, not far
    return (FAR if far else NEAR), not far


def _up_to(held: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Return bounds from zero to values: an optimum beyond them stays at them."""
    return {name: (min(value, 0.0), max(value, 0.0)) for name, value in held.items()}
