"""IPOPT through CasADi: its options, one call, and what is worth another."""

from __future__ import annotations

from typing import Any

import casadi as ca

from thesislib.ocp.programme import Programme
from thesislib.ocp.progress import Watch
from thesislib.ocp.quadrature import Array
from thesislib.ocp.settings import Settings

# What IPOPT says when a start from a solution has led it astray: worth one more start from the values alone.
LOST = (
    "Maximum_Iterations_Exceeded",
    "Infeasible_Problem_Detected",
    "Restoration_Failed",
    "Search_Direction_Becomes_Too_Small",
    "Error_In_Step_Computation",
)


def minimise(
    programme: Programme, options: dict[str, Any], start: dict[str, Array]
) -> tuple[dict[str, ca.DM], dict[str, Any]]:
    """Return what IPOPT finds and what it says of that."""
    solver = ca.nlpsol("solver", "ipopt", programme.nlp, options)
    return solver(**start), solver.stats()


def options_of(
    programme: Programme, settings: Settings, warm: bool, tolerance: float, seconds: float
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
    return options | {f"ipopt.{name}": value for name, value in settings.ipopt.items()}


def callback(watch: Watch | None) -> dict[str, Any]:
    """Return the option by which IPOPT tells somebody of every iteration, or none."""
    return {} if watch is None else {"iteration_callback": watch}
