"""One solve of one nonlinear programme with the library's own derivatives, and what it costs, piece by piece.

`ocp.solve` tells the seconds of a mesh. Benchmarks that compare formulations and warm starts need more: where
the time went by CasADi's own count, how small the barrier was at the end, and options that no setting has.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from thesislib.lap.minimum_time import SETTINGS
from thesislib.ocp.ipopt import Attempt, minimise, options_of
from thesislib.ocp.iterate import Iterate
from thesislib.ocp.system import Iterates, System

Array = np.ndarray

# What CasADi counts and times, by the names that stand in its statistics.
EVALUATIONS = {
    "objective": "nlp_f",
    "constraints": "nlp_g",
    "gradient": "nlp_grad_f",
    "Jacobian": "nlp_jac_g",
    "Hessian": "nlp_hess_l",
}


@dataclass(frozen=True)
class Solved:
    """One solve of one programme, and what it has cost.

    Attributes
    ----------
    iterate : Iterate
        Scaled values that were found, with multipliers where the library has solved.
    objective : float
        The objective with the regulariser, in units of the problem's scale.
    status : str
        What IPOPT said.
    iterations : int
        Iterations of IPOPT.
    cpu, wall : float
        Seconds from the statement to the solution: CPU time of this process, and on the clock.
    solver : float
        CPU seconds between IPOPT's start and its end.
    calls : mapping of str to (int, float)
        How often each of `EVALUATIONS` was called, and the CPU seconds it took.
    barrier : float
        The barrier parameter at the end.
    multipliers : ndarray, optional
        Of the plain programme's constraints, bounds included.
    """

    iterate: Iterate
    objective: float
    status: str
    iterations: int
    cpu: float
    wall: float
    solver: float
    calls: Mapping[str, tuple[int, float]]
    barrier: float
    multipliers: Array | None = None

    @property
    def preparation(self) -> float:
        """CPU seconds before IPOPT's start."""
        return self.cpu - self.solver

    @property
    def iteration(self) -> float:
        """CPU seconds of an iteration, evaluations included."""
        return self.solver / max(self.iterations, 1)

    @property
    def linear_algebra(self) -> float:
        """CPU seconds of an iteration without the evaluations: IPOPT itself and its linear solver."""
        return (self.solver - sum(seconds for _, seconds in self.calls.values())) / max(self.iterations, 1)


class Stopwatch:
    """CPU time of this process, system calls included as in CasADi's counts, and time on the clock."""

    def __init__(self) -> None:
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    def read(self) -> tuple[float, float]:
        """Return CPU and wall seconds since it was made."""
        return time.process_time() - self._cpu, time.perf_counter() - self._wall


def with_library(
    system: System,
    start: Iterate,
    tolerance: float,
    options: Mapping[str, Any] | None = None,
    *,
    seconds: float = 1e6,
    watch: Stopwatch | None = None,
    linear_solver: str = SETTINGS.linear_solver,
) -> Solved:
    """Solve on the start's mesh as `ocp.solve` does it, without another attempt where IPOPT gets stuck.

    Parameters
    ----------
    system : System
        The problem with its point functions.
    start : Iterate
        Scaled values; with multipliers the start is warm.
    tolerance : float
        IPOPT's.
    options : mapping, optional
        Options of IPOPT, without a prefix, that go before the settings'.
    seconds : float
        CPU seconds after which IPOPT gives up.
    watch : Stopwatch, optional
        Where the preparation begins; by default here, after that of the point functions.
    linear_solver : {"auto", "mumps", "ldl"}
        As in `ocp.Settings`.

    Returns
    -------
    Solved
    """
    watch = watch or Stopwatch()
    collocated = system.collocated([start.mesh])
    programme, iterates = collocated.programme, Iterates((start,), np.zeros(0))
    x, lam_x, lam_g = collocated.pack(iterates)
    attempt = Attempt(lam_x is not None, options=dict(options or {}))
    asked = options_of(programme, SETTINGS, attempt, tolerance, seconds) | {"record_time": True}
    arguments = {
        "p": collocated.parameters(iterates),
        "lbx": programme.lower,
        "ubx": programme.upper,
        "lbg": programme.rows_lower,
        "ubg": programme.rows_upper,
        "x0": np.clip(x, programme.lower, programme.upper),
    }
    if lam_x is not None:
        arguments |= {"lam_x0": lam_x, "lam_g0": lam_g}
    result, stats = minimise(programme, asked, arguments, linear_solver)
    cpu_wall = watch.read()
    found = collocated.unpack(*(np.array(result[name]).ravel() for name in ("x", "lam_x", "lam_g")))
    return solved(stats, found.phases[0], float(result["f"]), cpu_wall)


def warm(barrier: float, push: float) -> dict[str, Any]:
    """Return IPOPT's options of a start with multipliers, as the library sets them, for any numbers.

    Parameters
    ----------
    barrier : float
        Barrier parameter at the start.
    push : float
        Least distances from bounds, and least multipliers of them.
    """
    pushes = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    begun = {"warm_start_init_point": "yes", "mu_init": barrier}
    return begun | {f"warm_start_{name}": push for name in pushes}


def solved(
    stats: Mapping[str, Any],
    iterate: Iterate,
    objective: float,
    seconds: tuple[float, float],
    multipliers: Array | None = None,
) -> Solved:
    """Return a solve from the statistics that CasADi kept of it."""
    calls = {
        piece: (int(stats[f"n_call_{name}"]), float(stats[f"t_proc_{name}"]))
        for piece, name in EVALUATIONS.items()
    }
    barriers = stats["iterations"]["mu"] if "iterations" in stats else [np.nan]
    return Solved(
        iterate,
        objective,
        str(stats["return_status"]),
        int(stats["iter_count"]),
        *seconds,
        float(stats["t_proc_total"]),
        calls,
        float(barriers[-1]),
        multipliers,
    )
