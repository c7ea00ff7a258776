"""IPOPT through CasADi: its options, one call, and what is worth another."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field
from typing import Any

import casadi as ca

from thesislib.ocp.linear_solver import LinearSolver, linear_solver
from thesislib.ocp.problem import ProblemError
from thesislib.ocp.programme import Programme
from thesislib.ocp.progress import Watch
from thesislib.ocp.quadrature import Array
from thesislib.ocp.settings import Settings

logger = logging.getLogger(__name__)

# Number of variables from which QDLDL is worth its start: MUMPS, which pivots, is quick below.
LARGE = 5000

# What IPOPT says when it got stuck, whatever the budget: another way may lead through.
STUCK = (
    "Infeasible_Problem_Detected",
    "Restoration_Failed",
    "Search_Direction_Becomes_Too_Small",
    "Error_In_Step_Computation",
)


@dataclass(frozen=True)
class Attempt:
    """One way to call IPOPT on a mesh.

    Attributes
    ----------
    warm : bool
        Whether it starts from multipliers.
    after : tuple of str
        The verdicts of IPOPT that this attempt answers.
    options : dict
        What it does otherwise than the plain call.
    """

    warm: bool
    after: tuple[str, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)

    def answers(self, status: str) -> bool:
        """Whether the attempt is worth its time after IPOPT ended with a status."""
        return status in self.after


def attempts(warm: bool) -> list[Attempt]:
    """Return the ways to call IPOPT, one after another as long as it gets stuck.

    A start from a solution is followed by one from its values alone. A start that ends in a point from
    which no step leads towards the constraints, as problems with a free end easily do, is followed by
    one with another rule for the barrier, and by one that looks for a feasible point first.
    """
    from_values = Attempt(False, (*STUCK, "Maximum_Iterations_Exceeded"))
    detours = [
        Attempt(False, STUCK, {"mu_strategy": "adaptive"}),
        Attempt(False, STUCK, {"start_with_resto": "yes"}),
    ]
    return [Attempt(True), from_values, *detours] if warm else [Attempt(False), *detours]


def minimise(
    programme: Programme,
    options: dict[str, Any],
    start: dict[str, Array],
    with_solver: str = "mumps",
) -> tuple[dict[str, ca.DM], dict[str, Any]]:
    """Return what IPOPT finds and what it says of that.

    Parameters
    ----------
    programme : Programme
        What is minimised.
    options, start : dict
        As `casadi.nlpsol` and its function take them.
    with_solver : {"auto", "mumps", "ldl"}
        The linear solver, see `Settings`. Where IPOPT gets stuck with QDLDL, MUMPS does it all again.

    Raises
    ------
    ProblemError
        If QDLDL is asked for and not to be had.
    """
    solver, before = _qdldl(programme, options, with_solver), 0
    if solver is not None:
        begun = time.process_time()
        with solver:
            found, stats = _called(programme, options | solver.options, start)
        status, before = str(stats["return_status"]), int(stats["iter_count"])
        if not solver.failed and status not in STUCK:
            return found, stats
        logger.info("IPOPT with QDLDL: %s after %d iterations; again with MUMPS", status, before)
        left = options["ipopt.max_cpu_time"] - (time.process_time() - begun)
        options = options | {"ipopt.max_cpu_time": max(left, 1e-3)}
    found, stats = _called(programme, options, start)
    return found, stats | {"iter_count": int(stats["iter_count"]) + before}


def _called(
    programme: Programme, options: dict[str, Any], start: dict[str, Array]
) -> tuple[dict[str, ca.DM], dict[str, Any]]:
    solver = ca.nlpsol("solver", "ipopt", programme.nlp, options)
    return solver(**start), solver.stats()


def _qdldl(programme: Programme, options: dict[str, Any], wanted: str) -> LinearSolver | None:
    """Return QDLDL where it is wanted and to be had, None for MUMPS."""
    if wanted == "auto" and (len(programme.lower) < LARGE or "ipopt.linear_solver" in options):
        return None
    solver = None if wanted == "mumps" else linear_solver(len(programme.rows_lower))
    if wanted == "ldl" and solver is None:
        raise ProblemError(
            "linear_solver = 'ldl' needs a C compiler that THESIS_COMPILE does not forbid, QDLDL as C "
            "functions, and an IPOPT that loads linear solvers; 'mumps' needs none of them"
        )
    return solver


def options_of(
    programme: Programme, settings: Settings, attempt: Attempt, tolerance: float, seconds: float
) -> dict[str, Any]:
    """Return the options of `casadi.nlpsol`."""
    options: dict[str, Any] = {
        **programme.derivatives,
        "no_nlp_grad": True,
        "calc_lam_p": False,
        "print_time": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": tolerance,
        "ipopt.max_iter": settings.iterations,
        "ipopt.max_cpu_time": max(seconds, 1e-3),
        # a line search that has halved its step this often meets a constraint's curvature, and halving
        # on would make hundreds of tiny steps of it
        "ipopt.accept_after_max_steps": 6,
    }
    if settings.log_file:
        options |= {
            "ipopt.output_file": settings.log_file,
            "ipopt.file_print_level": 5,
            "ipopt.file_append": "yes",
        }
    if attempt.warm:
        options |= {
            "ipopt.warm_start_init_point": "yes",
            "ipopt.mu_init": settings.barrier,
            "ipopt.warm_start_bound_push": settings.barrier,
            "ipopt.warm_start_bound_frac": settings.barrier,
            "ipopt.warm_start_slack_bound_push": settings.barrier,
            "ipopt.warm_start_slack_bound_frac": settings.barrier,
            "ipopt.warm_start_mult_bound_push": settings.barrier,
        }
    own = attempt.options | dict(settings.ipopt)
    return options | {f"ipopt.{name}": value for name, value in own.items()}


def callback(watch: Watch | None) -> dict[str, Any]:
    """Return the option by which IPOPT tells somebody of every iteration, or none."""
    return {} if watch is None else {"iteration_callback": watch}
