"""Solve a problem: IPOPT on one mesh, ph refinement over meshes."""

from __future__ import annotations

import logging
import resource
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, overload

import casadi as ca
import numpy as np

from thesislib.ocp.evaluation import objective
from thesislib.ocp.failure import SolveError, failure, finished, told
from thesislib.ocp.ipopt import attempts, callback, minimise, options_of
from thesislib.ocp.iterate import Iterate
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.phased import PhasedSolution
from thesislib.ocp.phases import Phases
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Problem, ProblemError
from thesislib.ocp.progress import Watch
from thesislib.ocp.quadrature import Array
from thesislib.ocp.refinement import Refinement, error_estimate, refine
from thesislib.ocp.related import Related
from thesislib.ocp.settings import Settings
from thesislib.ocp.solution import MeshRecord, Solution
from thesislib.ocp.system import AnySolution, Collocated, Iterates, Statement, System, iterates_of, parts

logger = logging.getLogger(__name__)

# How far IPOPT's tolerance is tightened at most.
TIGHTEST = 1e-6


@overload
def solve(
    problem: Problem,
    guess: Mapping[str, Any] | Solution | Related | None = None,
    mesh: Mesh | None = None,
    settings: Settings | None = None,
    *,
    accept_best: bool = False,
    compile_code: bool | None = None,
    **changes: Any,
) -> Solution: ...


@overload
def solve(
    problem: Phases,
    guess: Mapping[str, Any] | PhasedSolution | None = None,
    mesh: Mesh | Mapping[str, Mesh] | None = None,
    settings: Settings | None = None,
    *,
    accept_best: bool = False,
    compile_code: bool | None = None,
    **changes: Any,
) -> PhasedSolution: ...


def solve(
    problem: Statement,
    guess: Mapping[str, Any] | AnySolution | Related | None = None,
    mesh: Mesh | Mapping[str, Mesh] | None = None,
    settings: Settings | None = None,
    *,
    accept_best: bool = False,
    compile_code: bool | None = None,
    **changes: Any,
) -> AnySolution:
    """Solve an optimal control problem to a relative state error.

    Parameters
    ----------
    problem : Problem or Phases
        What to solve.
    guess : mapping, Solution, PhasedSolution or Related, optional
        Numbers or functions of the independent variable by name, of phases by the name of the phase; or
        a solution of a problem of the same names, multipliers included; or one of a problem that has
        something less or more (`Related`).
    mesh : Mesh, or mapping of phases to meshes, optional
        First mesh; by default ten intervals of four points, or the guess's mesh.
    settings : Settings, optional
        Tolerances and limits; single ones may be given as keywords.
    accept_best : bool
        Return the last iterate, marked `converged=False`, instead of raising.
    compile_code : bool, optional
        Whether to compile the derivatives; by default where there is a compiler.

    Returns
    -------
    Solution, or PhasedSolution for Phases

    Raises
    ------
    ProblemError
        If the problem or the guess contradicts itself or has no finite value.
    SolveError
        If IPOPT does not finish, or the error estimate stays above tolerance; the message
        names the largest residual, its equation, mesh interval and place.
    """
    settings = (settings or Settings()).with_changes(**changes)
    similar = guess if isinstance(guess, Solution | PhasedSolution) else None
    system = System.of(problem, compile_code, similar)
    run = _Run(system, settings)
    iterates = system.started(guess, mesh)
    draft = settings.draft is not None and settings.draft > settings.optimality
    while True:
        solution = run.solve(iterates, draft)
        next_meshes = run.refinements(solution)
        stop = failure(solution, settings, [refinement.mesh for refinement in next_meshes])
        done, again = solution.converged and not draft, False
        if done:
            why = f"error {solution.error:.1e} within {settings.tolerance:.1e}"
        elif stop:
            why = stop[0]
        elif again := run.judges_too_mildly(solution):
            why = "again, to a tighter tolerance of IPOPT's"
        else:
            why = "polished" if solution.converged else "; ".join(map(str, next_meshes))
        solution = run.ended(solution, why, stopped=bool(done or stop))
        logger.info("%s: mesh %d, %s", problem.name, len(solution.history), told(solution.history[-1]))
        if stop and not accept_best:
            raise SolveError(stop[0], solution, stop[1])
        if stop or done:
            return solution
        # a polished mesh whose estimate rose above tolerance again is refined and polished, not drafted
        draft = draft and not solution.converged
        iterates = iterates_of(solution)
        if not (solution.converged or again):
            iterates = iterates.on([refinement.mesh for refinement in next_meshes])


class _Run:
    """One call of `solve`: what it has spent, and where its meshes were refined."""

    def __init__(self, system: System, settings: Settings) -> None:
        self.system, self.settings = system, settings
        self.history: list[MeshRecord] = []
        self.of_phases: list[list[MeshRecord]] = [[] for _ in system.pointwise]
        self.touched: list[list[tuple[float, float]]] = [[] for _ in system.pointwise]
        self.tightened = 1.0

    def solve(self, iterates: Iterates, draft: bool) -> AnySolution:
        """Return what IPOPT finds on the iterates' meshes."""
        begun, settings = _cpu(), self.settings
        for pointwise, iterate in zip(self.system.pointwise, iterates.phases, strict=True):
            _refuse_undefined(pointwise, iterate)
        collocated = self.system.collocated(iterates.meshes, settings.form)
        programme = collocated.programme
        x, lam_x, lam_g = collocated.pack(iterates)
        left = settings.seconds - sum(record.seconds for record in self.history)
        watch = None
        if settings.progress:
            points = [mesh.points for mesh in iterates.meshes]
            about = (self.system.statement.name, len(self.history) + 1, _intervals(iterates), sum(points))
            watch = Watch(
                settings.progress, programme, about, self.system.pointwise[0].problem.objective_scale
            )
        fixed = {
            "p": collocated.parameters(iterates),
            "lbx": programme.lower,
            "ubx": programme.upper,
            "lbg": programme.rows_lower,
            "ubg": programme.rows_upper,
            "x0": np.clip(x, programme.lower, programme.upper),
        }
        warm = {} if lam_x is None or lam_g is None else {"lam_x0": lam_x, "lam_g0": lam_g}
        result, status, iterations = None, "", 0
        for attempt in attempts(bool(warm)):
            remaining = left - (_cpu() - begun)
            if result is not None and (remaining <= 0 or not attempt.answers(status)):
                continue
            options = options_of(programme, settings, attempt, self._tolerance(draft), remaining)
            found, stats = minimise(
                programme,
                options | callback(watch),
                fixed | (warm if attempt.warm else {}),
                settings.linear_solver,
            )
            iterations += int(stats["iter_count"])
            if watch is not None:
                watch.reraise()
            # where nothing helps, what the plain cold start says is what is told
            if result is None or finished(str(stats["return_status"])) or not attempt.options:
                result, status = found, str(stats["return_status"])
        assert result is not None
        return self._solution(collocated, result, status, iterations, _cpu() - begun)

    def _solution(
        self, collocated: Collocated, result: dict[str, ca.DM], status: str, iterations: int, seconds: float
    ) -> AnySolution:
        values = _column(result["x"])
        found = collocated.unpack(values, _column(result["lam_x"]), _column(result["lam_g"]))
        scale = self.system.pointwise[0].problem.objective_scale
        phases = []
        for k, (iterate, transcription) in enumerate(
            zip(found.phases, collocated.transcriptions, strict=True)
        ):
            ours = values[collocated.variables[k] : collocated.variables[k + 1]]
            penalty = 0.5 * float(ours @ (transcription.penalty @ ours))
            pointwise = transcription.pointwise
            share = objective(pointwise, transcription.endpoints, iterate)
            estimate = error_estimate(
                pointwise, iterate.mesh, iterate.states, iterate.controls, iterate.parameters
            )
            mesh = iterate.mesh
            record = MeshRecord(
                mesh.intervals, mesh.points, share, estimate.largest, iterations, seconds, status
            )
            good = finished(status) and estimate.largest <= self.settings.tolerance
            history = (*self.of_phases[k], record)
            phases.append(
                Solution(
                    pointwise,
                    iterate,
                    share,
                    penalty * scale,
                    estimate,
                    self.settings.tolerance,
                    history,
                    good,
                    pointwise.compiled,
                )
            )
        if isinstance(self.system.statement, Problem):
            return phases[0]
        regularisation = sum(phase.regularisation for phase in phases)
        whole = MeshRecord(
            sum(phase.mesh.intervals for phase in phases),
            sum(phase.mesh.points for phase in phases),
            float(result["f"]) * scale - regularisation,
            max(phase.error for phase in phases),
            iterations,
            seconds,
            status,
        )
        return PhasedSolution(
            self.system.statement,
            tuple(phases),
            found.links,
            whole.objective,
            (*self.history, whole),
            all(phase.converged for phase in phases),
        )

    def _tolerance(self, draft: bool) -> float:
        """IPOPT's tolerance on the present mesh."""
        settings = self.settings
        asked = settings.draft if draft and settings.draft is not None else settings.optimality
        return asked * self.tightened

    def judges_too_mildly(self, solution: AnySolution) -> bool:
        """Whether IPOPT has left a start as it was although its states are in error; tighten it then.

        Another mesh would not help: IPOPT's tolerance, not the mesh, is what the error is made of.
        """
        too_mildly = not solution.converged and solution.history[-1].iterations == 0
        if too_mildly and self.tightened > TIGHTEST:
            self.tightened *= 1e-2
            return True
        return False

    def refinements(self, solution: AnySolution) -> list[Refinement]:
        """Return the next mesh of every phase."""
        settings, found = self.settings, []
        for part, touched in zip(parts(solution), self.touched, strict=True):
            mesh, errors = part.mesh, part.estimate.by_interval
            keep = np.zeros(mesh.intervals, dtype=bool)
            for low, high in touched:
                keep |= (mesh.boundaries[:-1] < high) & (mesh.boundaries[1:] > low)
            found.append(
                refine(
                    mesh,
                    errors,
                    settings.tolerance,
                    settings.lowest,
                    settings.highest,
                    settings.aim,
                    settings.reduction,
                    keep,
                )
            )
            above = np.flatnonzero(errors > settings.tolerance)
            touched += [(mesh.boundaries[k], mesh.boundaries[k + 1]) for k in above]
        return found

    def ended(self, solution: AnySolution, why: str, stopped: bool) -> AnySolution:
        """Return a solution with the reason noted in its history, and keep that history."""
        reason = why if stopped else ""
        if isinstance(solution, PhasedSolution):
            solution = replace(
                solution,
                history=_noted(solution.history, why),
                stopped=reason,
                phases=tuple(
                    replace(part, history=_noted(part.history, why), stopped=reason)
                    for part in solution.phases
                ),
            )
        else:
            solution = replace(solution, history=_noted(solution.history, why), stopped=reason)
        self.history = list(solution.history)
        self.of_phases = [list(part.history) for part in parts(solution)]
        return solution


def _noted(history: Sequence[MeshRecord], why: str) -> tuple[MeshRecord, ...]:
    return (*history[:-1], replace(history[-1], change=why))


def _intervals(iterates: Iterates) -> int:
    return sum(mesh.intervals for mesh in iterates.meshes)


def _refuse_undefined(pointwise: Pointwise, iterate: Iterate) -> None:
    """Refuse a start at which an equation has no finite value, naming it and the place."""
    outputs = pointwise.evaluate(iterate.points, iterate.parameters, iterate.mesh.collocation)
    bad = np.argwhere(~np.isfinite(outputs))
    if bad.size:
        row, point = bad[0]
        problem = pointwise.problem
        start, span = pointwise.range(iterate.parameters)
        place = start + span * iterate.mesh.collocation[point]
        raise ProblemError(
            f"{problem.name}: {pointwise.output_names[row]} is {outputs[row, point]} at the start, "
            f"{problem.independent.name} = {place:g} {problem.independent.unit}"
        )


def _column(values: ca.DM) -> Array:
    return np.array(values).ravel()


def _cpu() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime
