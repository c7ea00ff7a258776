"""What IPOPT needs to make use of a solution: iterations by barrier parameter, pushes and multipliers.

Row C of Table 4.2, on its last mesh with one point less in every interval, starts five solves: the last mesh
itself; rows M and D, where the optimiser may choose the balance and the ride heights; a car of one per cent
more mass; and the same lap, unchanged. Each is solved with several initial barrier parameters, from the
values alone and with all multipliers, and with pushes off the bounds that are as large as the barrier
parameter or fixed. A second table changes how far the solve went from which the finer mesh starts; a third
tries what else IPOPT offers. (`warm_start_target_mu` is not in it: this IPOPT ends the process with it.)
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import reporting
from programmes import Solved, warm, with_library

from thesislib import ocp
from thesislib.lap.adjustments import BALANCE, bounds_of
from thesislib.lap.minimum_time import Lap
from thesislib.lap.rows import HEIGHTS
from thesislib.lap.setups import Setup, Start
from thesislib.ocp.iterate import Iterate
from thesislib.ocp.related import taken_over
from thesislib.ocp.system import System

# IPOPT's tolerance of every solve that counts: a draft's, after which a mesh is refined or a row polished.
TOLERANCE = 1e-6

BARRIERS = (1e-8, 1e-6, 1e-4, 1e-2)
PUSHES = (1e-8,)  # and as large as the barrier parameter

# How far the solve went from which the finer mesh starts.
EARLIER = (1e-5, 1e-6, 1e-7, 1e-8)

# What IPOPT offers besides; the other options are the library's.
OTHERS: dict[str, Mapping[str, Any]] = {
    "as the library": {},
    "a step is accepted at once": {"accept_every_trial_step": "yes"},
    "barrier chosen in every iteration": {"mu_strategy": "adaptive"},
    "barrier lowered sooner": {"barrier_tol_factor": 100.0},
    "smallest multiplier of a bound 1e-9": {"warm_start_mult_bound_push": 1e-9},
    "no scaling by IPOPT": {"nlp_scaling_method": "none"},
}


@dataclass(frozen=True)
class Case:
    """A solve to start: its problem, and the values and multipliers that are known."""

    name: str
    system: System
    start: Iterate

    def iterations(self, limit: int, options: Mapping[str, Any], *, multipliers: bool = True) -> str:
        """Return how many iterations the solve takes, or why it ended without a solution."""
        start = self.start if multipliers else replace(self.start, multipliers=None)
        solved = with_library(self.system, start, TOLERANCE, {"max_iter": limit, **options})
        changes = ", ".join(f"{name} {value}" for name, value in options.items())
        kind = "multipliers" if multipliers else "values only"
        print(f"{self.name}, {kind}, {changes}: {told(solved, limit)}", file=sys.stderr)
        return told(solved, limit)


def main() -> None:
    parser = reporting.options(__doc__.partition("\n")[0])
    parser.add_argument("--track", default="barcelona", help="road by name, or its file (barcelona)")
    parser.add_argument("--tolerance", type=float, default=1e-5, help="state error of row C's lap (1e-5)")
    parser.add_argument("--interval-m", type=float, default=16.0, help="intervals of its first mesh (16 m)")
    parser.add_argument("--iterations", type=int, default=100, help="after which a solve has failed (100)")
    parser.add_argument("--lap", type=Path, help="row C solved before to that tolerance (solved anew)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = options.lap or Path(folder) / "row_c.npz"
        start = Start(Setup(options.track), options.tolerance, options.interval_m, str(path))
        if options.lap is None:
            start.solve("row C")
        lap = start.lap("row C")
    finer = lap.solution.mesh
    mesh = ocp.Mesh(finer.boundaries, np.maximum(finer.orders - 1, 3))
    system = System.solved(lap.solution)
    drafts = drafted(system, lap.solution.iterate.on(mesh))
    cases = cases_from(lap, start.setup, drafts[TOLERANCE].iterate, finer)
    limit = options.iterations
    parts = [
        f"Row C on {mesh.points} points, its last mesh on {finer.points}; all solves to IPOPT's "
        f"tolerance of {TOLERANCE:g}"
    ]
    parts += [f"{case.name}: iterations\n\n{by_barrier(case, limit)}" for case in cases]
    parts += [
        "finer mesh: iterations, by the tolerance of the solve before and its last barrier parameter",
        by_earlier(system, drafts, finer, limit),
        "what else IPOPT offers: iterations",
        by_option(cases[:3], limit),  # the others need hardly an iteration
    ]
    reporting.publish("warm-starts", "\n\n".join((*parts, reporting.surroundings())), options.keep)


def drafted(system: System, start: Iterate) -> dict[float, Solved]:
    """Return the lap on the start's mesh as far as each of the tolerances takes it, one from the other."""
    drafts: dict[float, Solved] = {}
    for tolerance in EARLIER:
        drafts[tolerance] = with_library(system, start, tolerance, {"mu_init": tolerance})
        start = drafts[tolerance].iterate
    return drafts


def cases_from(lap: Lap, setup: Setup, draft: Iterate, finer: ocp.Mesh) -> list[Case]:
    """Return what the draft of row C starts, the other problems in its scales."""
    solution, same = replace(lap.solution, iterate=draft), System.solved(lap.solution)

    def changed(name: str, other: Setup) -> Case:
        problem = other.problem(name, units=setup.units())
        system = System.of(problem)
        known = dict.fromkeys((parameter.name for parameter in problem.parameters), 0.0)
        return Case(name, system, taken_over(ocp.Related(solution, known), system.pointwise[0]))

    return [
        Case("finer mesh", same, draft.on(finer)),
        changed("row M, balance", replace(setup, free=bounds_of((BALANCE,)))),
        changed("row D, ride heights", replace(setup, free=bounds_of(HEIGHTS))),
        changed("mass + 1 %", replace(setup, values={"mass": 1.01 * lap.car.values["mass"]})),
        Case("unchanged", same, draft),
    ]


def by_barrier(case: Case, limit: int) -> str:
    """Return iterations by barrier parameter, with and without multipliers, for all pushes."""
    columns = (
        "barrier parameter",
        "values only",
        "multipliers, pushes as barrier",
        *(f"pushes {push:.0e}" for push in PUSHES),
    )
    lines = []
    for barrier in BARRIERS:
        cells = [case.iterations(limit, {"mu_init": barrier}, multipliers=False)]
        cells += [case.iterations(limit, warm(barrier, push)) for push in (barrier, *PUSHES)]
        lines.append((f"{barrier:.0e}", *cells))
    return reporting.table(columns, lines)


def by_earlier(system: System, drafts: Mapping[float, Solved], finer: ocp.Mesh, limit: int) -> str:
    """Return iterations on the finer mesh by how far the solve before it went."""
    columns = ("tolerance", "barrier at its end", *(f"barrier {barrier:.0e}" for barrier in BARRIERS))
    lines = []
    for tolerance, draft in drafts.items():
        case = Case(f"finer mesh after {tolerance:.0e}", system, draft.iterate.on(finer))
        cells = [case.iterations(limit, warm(barrier, barrier)) for barrier in BARRIERS]
        lines.append((f"{tolerance:.0e}", f"{draft.barrier:.0e}", *cells))
    return reporting.table(columns, lines)


def by_option(cases: Sequence[Case], limit: int) -> str:
    """Return iterations by further options of IPOPT."""
    lines = [(name, *(case.iterations(limit, options) for case in cases)) for name, options in OTHERS.items()]
    return reporting.table(("", *(case.name for case in cases)), lines)


def told(solved: Solved, limit: int) -> str:
    """Return the iterations of a solve; with a mark where it has not ended in a solution."""
    if solved.status == "Maximum_Iterations_Exceeded":
        return f"> {limit}"
    mark = "" if solved.status == "Solve_Succeeded" else f" {solved.status}"
    return f"{solved.iterations}{mark}"


if __name__ == "__main__":
    main()
