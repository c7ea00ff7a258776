"""Solve a problem: IPOPT on one mesh, ph refinement over meshes."""

from __future__ import annotations

import logging
import resource
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.iterate import Iterate, Scales, guessed, pack, rescaled, unpack
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Problem, ProblemError
from thesislib.ocp.quadrature import Array
from thesislib.ocp.refinement import error_estimate, refined
from thesislib.ocp.residuals import undefined, worst_error, worst_residual
from thesislib.ocp.solution import MeshRecord, Solution
from thesislib.ocp.transcription import Programme, Transcription

logger = logging.getLogger(__name__)


class SolveError(RuntimeError):
    """A solve that did not reach what was asked; `solution` is its best iterate, marked.

    Attributes
    ----------
    solution : Solution
        The last iterate, with `converged` False.
    """

    def __init__(self, message: str, solution: Solution) -> None:
        super().__init__(message)
        self.solution = solution


@dataclass(frozen=True)
class Settings:
    """How a problem is solved.

    Parameters
    ----------
    tolerance : float
        Largest relative state error (2.162).
    optimality : float
        IPOPT's tolerance on the scaled programme, of the solution that is returned.
    draft : float, optional
        IPOPT's tolerance on every mesh before that: meshes that will be refined need no
        more, and a barrier parameter that has not vanished makes the next start easier. The
        last mesh is then solved once more. By default the same as `optimality`.
    aim : float
        Refinement aims at this part of the tolerance: the decay that (2.163) counts on is too
        hopeful where controls have kinks, and a mesh more costs more than a few points.
    meshes : int
        Largest number of meshes.
    lowest, highest : int
        N_min and N_max of (2.163) and (2.164).
    most_points : int
        Refinement stops before a mesh of more collocation points than this.
    iterations : int
        Largest number of IPOPT iterations on one mesh.
    seconds : float
        User CPU seconds after which IPOPT gives up on one mesh.
    barrier : float
        Initial barrier parameter of a warm start.
    log_file : str, optional
        Where IPOPT writes its iterations.
    """

    tolerance: float = 1e-6
    optimality: float = 1e-8
    draft: float | None = None
    aim: float = 1.0
    meshes: int = 20
    lowest: int = 3
    highest: int = 10
    most_points: int = 30_000
    iterations: int = 1000
    seconds: float = 1e9
    barrier: float = 1e-6
    log_file: str | None = None


def solve(
    problem: Problem,
    guess: Mapping[str, Any] | Solution | None = None,
    mesh: Mesh | None = None,
    settings: Settings | None = None,
    *,
    accept_best: bool = False,
    compile_code: bool | None = None,
    **changes: Any,
) -> Solution:
    """Solve an optimal control problem to a relative state error.

    Parameters
    ----------
    problem : Problem
        What to solve.
    guess : mapping or Solution, optional
        Numbers or functions of the independent variable by name; or a solution of this or
        a similar problem, multipliers included.
    mesh : Mesh, optional
        First mesh; by default ten intervals of four points, or the guess's mesh.
    settings : Settings, optional
        Tolerances and limits; single ones may be given as keywords.
    accept_best : bool
        Return the last iterate, marked `converged=False`, instead of raising.
    compile_code : bool, optional
        Whether to compile the derivatives; by default where there is a compiler.

    Returns
    -------
    Solution

    Raises
    ------
    ProblemError
        If the problem or the guess contradicts itself or has no finite value.
    SolveError
        If IPOPT does not finish, or the error estimate stays above tolerance; the message
        names the largest residual, its equation, mesh interval and place.
    """
    settings = replace(settings or Settings(), **changes)
    if not 0 < settings.tolerance < 1:
        raise ProblemError(f"tolerance = {settings.tolerance:g} is outside 0 .. 1")
    if isinstance(guess, Solution):
        same = guess.problem is problem and compile_code in (None, guess.compiled)
        pointwise = guess.pointwise if same else Pointwise(problem, compile_code)
        iterate = _rescaled(guess, pointwise).on(mesh or guess.mesh)
    else:
        pointwise = Pointwise(problem, compile_code)
        iterate = guessed(pointwise, mesh or Mesh.uniform(10, 4), guess or {})
    endpoints = Endpoints(pointwise)
    history: list[MeshRecord] = []
    draft = settings.draft is not None and settings.draft > settings.optimality
    while True:
        solution = _solve_on_mesh(pointwise, endpoints, iterate, settings, history, draft)
        history = list(solution.history)
        _log(problem, solution)
        finer = refined(
            solution.mesh,
            solution.estimate.by_interval,
            settings.tolerance,
            settings.lowest,
            settings.highest,
            settings.aim,
        )
        why = _failure(solution, settings, finer, len(history))
        if why and not accept_best:
            raise SolveError(why, solution)
        if why or (solution.converged and not draft):
            return solution
        # a polished mesh whose estimate rose above tolerance again is refined and polished, not drafted
        draft = draft and not solution.converged
        iterate = solution.iterate.on(solution.mesh if solution.converged else finer)


def _failure(solution: Solution, settings: Settings, finer: Mesh, meshes: int) -> str | None:
    """Say why a solve cannot go on, or None."""
    name = solution.problem.name
    if not _finished(solution.status):
        return (
            f"{name}: IPOPT stopped with {solution.status} on mesh {meshes} "
            f"({solution.mesh.intervals} intervals, {solution.mesh.points} points); "
            f"{undefined(solution) or f'largest residual: {worst_residual(solution)}'}"
        )
    if solution.converged:
        return None
    limit = None
    if meshes >= settings.meshes:
        limit = f"after {meshes} mesh{'es' if meshes > 1 else ''}"
    elif finer.points > settings.most_points:
        limit = f"and the next mesh would have {finer.points} points, more than {settings.most_points}"
    if limit is None:
        return None
    return (
        f"{name}: the error estimate {solution.error:.1e} is above the tolerance "
        f"{settings.tolerance:.1e} {limit}; largest error: {worst_error(solution)}"
    )


def _finished(status: str) -> bool:
    return status == "Solve_Succeeded"


def _rescaled(guess: Solution, pointwise: Pointwise) -> Iterate:
    """Return a solution's iterate in the scales of another problem of the same names."""
    if guess.pointwise is pointwise:
        return guess.iterate
    ours, theirs = pointwise.problem, guess.problem
    for kind, names in ours.names.items():
        if theirs.names[kind] != names:
            raise ProblemError(f"{theirs.name!r} cannot start {ours.name!r}: their {kind} differ")
    return rescaled(guess.iterate, Scales.of(guess.pointwise), Scales.of(pointwise))


def _solve_on_mesh(
    pointwise: Pointwise,
    endpoints: Endpoints,
    iterate: Iterate,
    settings: Settings,
    history: list[MeshRecord],
    draft: bool,
) -> Solution:
    begun = _cpu()
    transcription = Transcription(pointwise, endpoints, iterate.mesh)
    programme = transcription.programme()
    x, lam_x, lam_g = pack(iterate, transcription)
    parameters = transcription.parameter_vector(iterate.parameters)
    _refuse_undefined(pointwise, iterate)
    warm = lam_x is not None
    solver = ca.nlpsol("solver", "ipopt", programme.nlp, _options(programme, settings, warm, draft))
    start = {"x0": np.clip(x, programme.lower, programme.upper)}
    if lam_x is not None and lam_g is not None:
        start |= {"lam_x0": lam_x, "lam_g0": lam_g}
    result = solver(
        p=parameters,
        lbx=programme.lower,
        ubx=programme.upper,
        lbg=programme.rows_lower,
        ubg=programme.rows_upper,
        **start,
    )
    stats = solver.stats()
    found = unpack(_column(result["x"]), _column(result["lam_x"]), _column(result["lam_g"]), transcription)
    values = _column(result["x"])
    penalty = 0.5 * float(values @ (transcription.penalty @ values))
    scale = pointwise.problem.objective_scale
    estimate = error_estimate(pointwise, found.mesh, found.states, found.controls, found.parameters)
    objective = (float(result["f"]) - penalty) * scale
    record = MeshRecord(
        found.mesh.intervals,
        found.mesh.points,
        objective,
        estimate.largest,
        int(stats["iter_count"]),
        _cpu() - begun,
        str(stats["return_status"]),
    )
    return Solution(
        pointwise,
        found,
        objective,
        penalty * scale,
        estimate,
        settings.tolerance,
        (*history, record),
        _finished(record.status) and estimate.largest <= settings.tolerance,
        pointwise.compiled,
    )


def _options(programme: Programme, settings: Settings, warm: bool, draft: bool) -> dict[str, Any]:
    """Return the options of `casadi.nlpsol`."""
    options: dict[str, Any] = {
        **programme.derivatives,
        "no_nlp_grad": True,
        "calc_lam_p": False,
        "print_time": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": settings.draft if draft else settings.optimality,
        "ipopt.max_iter": settings.iterations,
        "ipopt.max_cpu_time": settings.seconds,
    }
    if settings.log_file:
        options |= {
            "ipopt.output_file": settings.log_file,
            "ipopt.file_print_level": 5,
            "ipopt.file_append": "yes",
        }
    if warm:
        options |= {
            "ipopt.warm_start_init_point": "yes",
            "ipopt.mu_init": settings.barrier,
            "ipopt.warm_start_bound_push": settings.barrier,
            "ipopt.warm_start_bound_frac": settings.barrier,
            "ipopt.warm_start_slack_bound_push": settings.barrier,
            "ipopt.warm_start_slack_bound_frac": settings.barrier,
            "ipopt.warm_start_mult_bound_push": settings.barrier,
        }
    return options


def _refuse_undefined(pointwise: Pointwise, iterate: Iterate) -> None:
    """Refuse a start at which an equation has no finite value, naming it and the place."""
    z = np.vstack((iterate.states[:, :-1], iterate.controls))
    outputs = pointwise.evaluate(z, iterate.parameters, iterate.mesh.collocation)
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


def _log(problem: Problem, solution: Solution) -> None:
    record = solution.history[-1]
    logger.info(
        "%s: mesh %d, %d intervals, %d points, objective %.6f, error %.1e, %d iterations, %.1f s%s",
        problem.name,
        len(solution.history),
        record.intervals,
        record.points,
        record.objective,
        record.error,
        record.iterations,
        record.seconds,
        "" if _finished(record.status) else f", {record.status}",
    )


def _column(values: ca.DM) -> Array:
    return np.array(values).ravel()


def _cpu() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime
