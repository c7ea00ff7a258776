"""A lap on one mesh after another with `casadi.Opti`: the library's continuation, refinement and settings.

What differs from `minimum_lap_time` is the programme of each mesh (`plain.py`), and that a finer mesh starts
from values alone; the last mesh, solved twice, starts the second time with multipliers.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from plain import with_opti
from programmes import Solved, Stopwatch, warm

from thesislib import ocp
from thesislib.lap.minimum_time import LONGEST_INTERVAL_M, SETTINGS, STARTING_WEIGHTS
from thesislib.lap.problem import lap_problem
from thesislib.lap.setups import Setup, Start
from thesislib.lap.start import quasi_steady_start
from thesislib.ocp.iterate import Iterate, guessed
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.refinement import error_estimate

DRAFT = SETTINGS.draft or SETTINGS.optimality
"""IPOPT's tolerance on a mesh that may have to be refined, as the library drafts it."""


@dataclass(frozen=True)
class Step:
    """One mesh of a way: its points, what its solve has cost, and the state error it left."""

    points: int
    iterations: int
    cpu: float
    error: float
    objective: float


@dataclass(frozen=True)
class Work:
    """What a way has done for a lap: meshes, CPU and wall seconds, and whether it came to the end."""

    steps: Sequence[Step]
    cpu: float
    wall: float
    finished: bool

    @property
    def iterations(self) -> int:
        """Iterations on all meshes."""
        return sum(step.iterations for step in self.steps)

    @property
    def iterated(self) -> int:
        """Points times iterations, of all meshes: what the time grows with."""
        return sum(step.points * step.iterations for step in self.steps)


def plain_cold(base: Start, expand: bool, limit: float) -> Work:
    """Solve row C with CasADi's own derivatives, by the same continuation and the same refinement."""
    setup, length = base.setup, base.setup.road().length
    watch, steps = Stopwatch(), []
    first = starting_problem(setup)
    start = quasi_steady_iterate(first, setup, base.interval_m)
    for problem in (first, setup.problem("row C")):
        pointwise = Pointwise(problem)
        found = with_opti(problem, start, common(DRAFT, limit - total(steps)), expand=expand)
        finer, step = judged(pointwise, found, base.tolerance)
        steps.append(step)
        if found.status != "Solve_Succeeded":
            return Work(steps, *watch.read(), False)
        start = found.iterate.on(finer)
    start = found.iterate.on(finer.divided(LONGEST_INTERVAL_M / length))
    return refined(pointwise, start, base.tolerance, expand, limit, steps, watch)


def refined(
    pointwise: Pointwise,
    start: Iterate,
    tolerance: float,
    expand: bool,
    limit: float,
    steps: Sequence[Step] = (),
    watch: Stopwatch | None = None,
    meshes: int = SETTINGS.meshes,
) -> Work:
    """Refine a plain solve until its states' error is within tolerance, then solve the last mesh to the end.

    Parameters
    ----------
    pointwise : Pointwise
        Brings the problem, and judges the errors.
    start : Iterate
        Where the first solve begins, and its mesh.
    tolerance : float
        Largest relative state error.
    expand : bool
        As of `Plain.solve`.
    limit : float
        CPU seconds after which the work ends unfinished.
    steps, watch : optional
        What was done before, and since when.
    meshes : int
        Largest number of meshes.
    """
    problem, steps, watch = pointwise.problem, list(steps), watch or Stopwatch()
    for _ in range(meshes):
        found = with_opti(problem, start, common(DRAFT, limit - total(steps)), expand=expand)
        finer, step = judged(pointwise, found, tolerance)
        steps.append(step)
        if found.status != "Solve_Succeeded":
            return Work(steps, *watch.read(), False)
        if step.error <= tolerance:
            break
        start = found.iterate.on(finer)
    options = common(SETTINGS.optimality, limit - total(steps)) | warm(SETTINGS.barrier, SETTINGS.barrier)
    polished = with_opti(problem, found.iterate, options, expand=expand, multipliers=found.multipliers)
    steps.append(judged(pointwise, polished, tolerance)[1])
    reached = polished.status == "Solve_Succeeded" and steps[-1].error <= tolerance
    return Work(steps, *watch.read(), reached)


def judged(pointwise: Pointwise, found: Solved, tolerance: float) -> tuple[ocp.Mesh, Step]:
    """Return the next mesh and the step, by the library's error estimate and its refinement."""
    problem, iterate = pointwise.problem, found.iterate
    estimate = error_estimate(pointwise, iterate.mesh, iterate.states, iterate.controls, iterate.parameters)
    objective = found.objective * problem.objective_scale
    print(
        f"{problem.name}: {iterate.mesh.points} points, {found.iterations} iterations, {found.cpu:.1f} s, "
        f"{objective:.4f}, error {estimate.largest:.1e}, {found.status}",
        file=sys.stderr,
    )
    step = Step(iterate.mesh.points, found.iterations, found.cpu, estimate.largest, objective)
    return ocp.refined(iterate.mesh, estimate.by_interval, tolerance, aim=SETTINGS.aim), step


def starting_problem(setup: Setup) -> ocp.Problem:
    """Return the problem of the first mesh, whose controls are held by stronger weights."""
    return lap_problem(
        setup.road(), setup.car(), name="row C, start", weights=STARTING_WEIGHTS, **setup.options
    )


def quasi_steady_iterate(problem: ocp.Problem, setup: Setup, interval_m: float) -> Iterate:
    """Return the quasi-steady lap on the first mesh."""
    mesh = ocp.Mesh.uniform(max(1, round(setup.road().length / interval_m)), 4)
    return guessed(Pointwise(problem), mesh, quasi_steady_start(setup.road(), setup.car()))


def total(steps: Sequence[Step]) -> float:
    """Return the CPU seconds of steps."""
    return sum(step.cpu for step in steps)


def common(tolerance: float, seconds: float) -> dict[str, object]:
    """Return the options of IPOPT that all ways share, for a tolerance and a limit of CPU seconds."""
    return {
        "tol": tolerance,
        "max_iter": SETTINGS.iterations,
        "max_cpu_time": max(seconds, 1e-3),
        "accept_after_max_steps": 6,
    }
