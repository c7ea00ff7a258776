"""Table 4.2 with this library, and with the same programme written down in `casadi.Opti`, side by side.

The ways take turns in one process: the library, with its own assembly, compiled derivatives and QDLDL for
IPOPT's linear systems where they are large; the library with MUMPS, which all others use; `casadi.Opti`
(`plain.py`), whose derivatives CasADi makes of the expressions as they are written; and the same after
`expand`, which makes one graph of scalars of the whole programme first. Equations, meshes, bounds, scales,
regulariser, starting values and IPOPT's other options are the same, and so is the optimum. Only the warm
starts differ: whoever writes a programme down carries values to a finer mesh or into another problem; the
library carries all multipliers, too. Code that lies compiled in the cache counts as prepared. The faster of
the two plain ways solves whole laps, mesh after mesh (`plain_lap.py`).
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import reporting
from plain import with_opti
from plain_lap import DRAFT, Step, Work, common, plain_cold, quasi_steady_iterate, refined, starting_problem
from programmes import EVALUATIONS, Solved, Stopwatch, with_library

from thesislib import ocp
from thesislib.lap.continuation import REFINING, TOLERANCE, continued_row, solve_rows
from thesislib.lap.minimum_time import SETTINGS, Lap
from thesislib.lap.rows import LETTERS, RECONCILED, rows
from thesislib.lap.setups import Setup, Start
from thesislib.ocp.iterate import Iterate
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.related import taken_over
from thesislib.ocp.system import System

LIBRARY = "library"
OURS = {LIBRARY: SETTINGS.linear_solver, "library, MUMPS": "mumps"}
PLAIN = {"Opti": False, "Opti, expand": True}  # whether the programme is expanded


def main() -> None:
    parser = reporting.options(__doc__.partition("\n")[0])
    parser.add_argument("--track", default="barcelona", help="road by name, or its file (barcelona)")
    parser.add_argument("--tolerance", type=float, default=1e-5, help="state error of row C (1e-5)")
    parser.add_argument("--interval-m", type=float, default=16.0, help="intervals of the first mesh (16 m)")
    parser.add_argument(
        "--rows", nargs="*", default=["H"], choices=LETTERS, metavar="ROW", help="compared (H)"
    )
    parser.add_argument("--limit", type=float, default=600.0, help="CPU seconds of one way and part (600)")
    parser.add_argument("--jobs", type=int, help="rows solved at a time (one per core)")
    parser.add_argument("--some", action="store_true", help="leave out the pass over all rows")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["THESIS_STORE"] = str(Path(folder) / "store")  # nothing solved before is taken up
        parts = []
        for part in measured(options, Path(folder)):
            print(f"{part}\n", file=sys.stderr)  # it takes long: what is known is told
            parts.append(part)
    reporting.publish("table-4-2", "\n\n".join((*parts, reporting.surroundings())), options.keep)


def measured(options: argparse.Namespace, folder: Path) -> Iterator[str]:
    """Yield the parts of the report."""
    base = Start(Setup(options.track), options.tolerance, options.interval_m, str(folder / "row_c.npz"))
    yield first_mesh(base, options.limit)
    lap, library = library_cold(base)
    text, way = finer_mesh(lap, options.limit)
    yield text
    plain = plain_cold(base, PLAIN[way], options.limit)
    yield whole_lap(lap, library, plain, way)
    for letter in options.rows:
        yield one_row(letter, base, lap, way, options.limit)
    if not options.some:
        yield all_rows(base, folder, plain, way, options.jobs)


def first_mesh(base: Start, limit: float) -> str:
    """Compare the ways on the first mesh, from the quasi-steady lap."""
    setup = base.setup
    problem = starting_problem(setup)
    start = quasi_steady_iterate(problem, setup, base.interval_m)
    with_library(System.of(problem), start, 1e-2, {"max_iter": 1})  # compiles what lies in no cache
    ways = by_all_ways(problem, start, limit)
    return f"First mesh of row C, {start.mesh.points} points, from the quasi-steady lap\n\n{compared(ways)}"


def finer_mesh(lap: Lap, limit: float) -> tuple[str, str]:
    """Compare the ways on row C's last mesh, and say which of the plain ones is faster."""
    solution = lap.solution
    system = System.solved(solution)
    mesh = ocp.Mesh(solution.mesh.boundaries, np.maximum(solution.mesh.orders - 1, 3))
    coarse = with_library(system, solution.iterate.on(mesh), DRAFT)
    start = coarse.iterate.on(solution.mesh)
    ways = by_all_ways(solution.problem, start, limit)
    title = f"Last mesh of row C, {solution.mesh.points} points, from its intervals with {mesh.points} points"
    return f"{title}\n\n{compared(ways)}", min(PLAIN, key=lambda name: ways[name].cpu)


def by_all_ways(problem: ocp.Problem, start: Iterate, limit: float) -> dict[str, Solved]:
    """Solve a draft of a mesh on every way."""
    ways = {}
    for name, linear_solver in OURS.items():
        watch = Stopwatch()
        ways[name] = with_library(
            System.of(problem), start, DRAFT, seconds=limit, watch=watch, linear_solver=linear_solver
        )
    for name, expand in PLAIN.items():
        ways[name] = with_opti(problem, start, common(DRAFT, limit), expand=expand)
    return ways


def compared(ways: Mapping[str, Solved]) -> str:
    """Return what one solve has cost on each way, with ratios, and whether the optima agree."""
    first = ways[LIBRARY]
    lines = [line("preparation, CPU s", [way.preparation for way in ways.values()])]
    for piece in EVALUATIONS:
        each = [
            1e3 * seconds / max(calls, 1) for calls, seconds in (way.calls[piece] for way in ways.values())
        ]
        lines.append(line(f"{piece}, CPU ms", each))
    lines += [
        line("IPOPT itself, CPU ms/iteration", [1e3 * way.linear_algebra for way in ways.values()]),
        line("iteration, CPU ms", [1e3 * way.iteration for way in ways.values()]),
        line("iterations", [float(way.iterations) for way in ways.values()], digits=0),
        line("in all, CPU s", [way.cpu for way in ways.values()], digits=1),
        line("in all, wall s", [way.wall for way in ways.values()], digits=1),
    ]
    said = [
        f"{name} {'agrees to' if way.status == first.status else way.status + ', differs by'} "
        f"{abs(way.objective / first.objective - 1):.0e}"
        for name, way in list(ways.items())[1:]
    ]
    columns = ("", *ways, *(f"{name} : {LIBRARY}" for name in list(ways)[1:]))
    return f"{reporting.table(columns, lines)}\n\noptimum: {', '.join(said)} of its value"


def line(what: str, values: Sequence[float], digits: int = 2) -> tuple[str, ...]:
    """Return a line of a table of ways: what each took, and its ratio to the first."""
    reference, *others = values
    ratios = (f"{value / reference:.1f}" if reference else "" for value in others)
    return (what, *(f"{value:.{digits}f}" for value in values), *ratios)


def library_cold(base: Start) -> tuple[Lap, Work]:
    """Solve row C with the library, from nothing to the end."""
    watch = Stopwatch()
    base.solve("row C")
    cpu, wall = watch.read()
    lap = base.lap("row C")
    return lap, Work(steps_of(lap.solution), cpu, wall, lap.solution.converged)


def one_row(letter: str, base: Start, lap: Lap, way: str, limit: float) -> str:
    """Compare a row, solved from row C on the mesh that its tolerance asks for."""
    row = rows(base.setup)[letter]
    watch = Stopwatch()
    ours = continued_row(row.setup, base, TOLERANCE, f"row {letter}", row.steps)
    cpu, wall = watch.read()
    library = Work(steps_of(ours.solution), cpu, wall, True)
    problem = row.setup.problem(f"row {letter}", units=base.setup.units())
    mesh = ocp.coarsened(lap.solution.mesh, lap.solution.estimate.by_interval, TOLERANCE)
    known = {quantity.name: 0.0 for quantity in problem.parameters}
    related = ocp.Related(lap.solution, known, multipliers=False)
    pointwise = Pointwise(problem)
    start = taken_over(related, pointwise, mesh)
    plain = refined(pointwise, start, TOLERANCE, PLAIN[way], limit, meshes=1 + REFINING.meshes)
    return f"Row {letter}, {row.what}, from row C\n\n{side_by_side(library, plain, way)}"


def whole_lap(lap: Lap, library: Work, plain: Work, way: str) -> str:
    """Compare row C from nothing to the end."""
    return (
        f"Row C, cold, to a state error of {lap.solution.tolerance:g}\n\n{side_by_side(library, plain, way)}"
    )


def side_by_side(library: Work, plain: Work, way: str) -> str:
    """Return the meshes of two ways, and their totals with ratios."""
    columns = (
        "mesh",
        *(f"{name} {what}" for name in (LIBRARY, way) for what in ("points", "iterations", "CPU s", "error")),
    )
    lines = []
    for number in range(max(len(library.steps), len(plain.steps))):
        cells = [str(number + 1)]
        for work in (library, plain):
            step = work.steps[number] if number < len(work.steps) else None
            cells += (
                [str(step.points), str(step.iterations), f"{step.cpu:.1f}", f"{step.error:.1e}"]
                if step
                else [""] * 4
            )
        lines.append(cells)
    last = [work.steps[-1].objective for work in (library, plain)]
    ended = f"objective with regulariser {last[0]:.5f} s, with {way} {last[1]:.5f} s"
    if not plain.finished:
        ended = f"{way} did not come to its end: {per_iteration(plain, library)}"
    return "\n\n".join((reporting.table(columns, lines), f"{totals(library, plain, way)}\n{ended}"))


def totals(library: Work, plain: Work, way: str) -> str:
    """Return what two ways took in all, and the ratio."""
    each = "; ".join(
        f"{name} {work.iterations} iterations, CPU {work.cpu:.1f} s, wall {work.wall:.1f} s"
        for name, work in ((LIBRARY, library), (way, plain))
    )
    return f"in all: {each}; ratio of CPU {plain.cpu / library.cpu:.1f}"


def per_iteration(plain: Work, library: Work) -> str:
    """Say what the library's meshes and iterations would take at a plain way's time for each."""
    estimated = plain.cpu / plain.iterated * library.iterated
    return (
        f"at its {1e6 * plain.cpu / plain.iterated:.0f} CPU µs per iteration and point, preparations "
        f"included, the library's iterations on the library's meshes would take it {estimated:.0f} CPU s "
        f"({estimated / library.cpu:.1f} times the library's)"
    )


def all_rows(base: Start, folder: Path, plain: Work, way: str, jobs: int | None) -> str:
    """Solve all rows of the table with the library, one pass, as chapter 4 does it."""
    table = {name: row for name, row in rows(base.setup).items() if name in (*LETTERS, RECONCILED)}
    watch, before = Stopwatch(), workers_cpu()
    solved = solve_rows(table, base, folder / "rows", jobs=jobs)
    cpu, wall = watch.read()
    cpu += workers_cpu() - before
    lines, iterated, inside = [], 0, 0.0
    for name, row in solved.items():
        entries = row.solved.entries
        gained = row.lap_time - solved[row.row.reference].lap_time
        iterated += int(entries["iterations"]) * int(entries["points"])
        inside += float(entries["seconds"])
        counts = (str(entries[key]) for key in ("points", "meshes", "iterations"))
        lines.append((name, f"{row.lap_time:.4f}", f"{gained:+.4f}", *counts, f"{entries['seconds']:.1f}"))
    columns = ("row", "lap time s", "to its C s", "points", "meshes", "iterations", "CPU s")
    rate = plain.cpu / plain.iterated
    return (
        f"All rows with the library, one pass, each to a state error of {TOLERANCE:g}\n\n"
        f"{reporting.table(columns, lines)}\n\n"
        f"in all: CPU {cpu:.1f} s, of which {inside:.1f} s in the solves, wall {wall:.1f} s\n"
        f"at the {1e6 * rate:.0f} CPU µs per iteration and point of {way} on row C the same iterations would "
        f"take {rate * iterated:.0f} CPU s ({rate * iterated / inside:.1f} times as long)"
    )


def workers_cpu() -> float:
    """Return the CPU seconds of all worker processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def steps_of(solution: ocp.Solution) -> list[Step]:
    """Return the meshes of a library's solution."""
    regulariser = solution.regularisation
    return [
        Step(mesh.points, mesh.iterations, mesh.seconds, mesh.error, mesh.objective + regulariser)
        for mesh in solution.history
    ]


if __name__ == "__main__":
    main()
