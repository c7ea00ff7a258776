"""Methods side by side on a problem whose solution is known: errors, size and time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .control_problem import Array, Trajectory


@dataclass(frozen=True)
class Exact:
    """A solution in closed form, of a problem with one state.

    Attributes
    ----------
    state, costate : callable
        Times in s, shape (N,), to values, shape (N,).
    objective : float
    """

    state: Callable[[Array], Array]
    costate: Callable[[Array], Array]
    objective: float


@dataclass(frozen=True)
class Measurement:
    """What one method cost, and what it reached.

    Attributes
    ----------
    method : str
    unknowns, iterations : int
    state_error, costate_error : float
        Largest over the points that the method has.
    objective_error : float
        Absolute.
    cpu_s : float
        CPU time from the problem to the trajectory in s, the least of the repetitions.
    """

    method: str
    unknowns: int
    iterations: int
    state_error: float
    costate_error: float
    objective_error: float
    cpu_s: float


def errors(trajectory: Trajectory, exact: Exact) -> tuple[float, float, float]:
    """Return the largest errors of state and costate, and the error of the objective, all absolute."""
    return (
        float(np.max(np.abs(trajectory.x[0] - exact.state(trajectory.t)))),
        float(np.max(np.abs(trajectory.costate[0] - exact.costate(trajectory.t_costate)))),
        abs(trajectory.objective - exact.objective),
    )


def measured(
    method: str, run: Callable[[], Trajectory], exact: Exact, *, repetitions: int = 3
) -> Measurement:
    """Run a method and measure it.

    Parameters
    ----------
    method : str
        Its name.
    run : callable
        From nothing to a trajectory; an error it raises is not caught.
    exact : Exact
    repetitions : int
        Runs of which the fastest counts: others on the machine only ever add time.

    Raises
    ------
    ValueError
        If `repetitions` is below one.
    """
    if repetitions < 1:
        raise ValueError(f"{method}: repetitions = {repetitions} must be at least 1")
    seconds = []
    for _ in range(repetitions):
        start = time.process_time()
        trajectory = run()
        seconds.append(time.process_time() - start)
    found = errors(trajectory, exact)
    return Measurement(method, trajectory.unknowns, trajectory.iterations, *found, min(seconds))


def order(steps: ArrayLike, error: ArrayLike) -> float:
    """Return the exponent p of ``error ~ steps^(-p)``, by least squares on logarithms.

    Parameters
    ----------
    steps, error : array_like, shape (N,)
        Numbers of steps, and positive errors above the level of rounding.

    Raises
    ------
    ValueError
        If there are fewer than two, or one is not positive.
    """
    steps, error = np.asarray(steps, float), np.asarray(error, float)
    if steps.shape != error.shape or steps.size < 2:
        raise ValueError(
            f"an order needs two or more errors with their steps, got {error.size} and {steps.size}"
        )
    if not (np.all(steps > 0) and np.all(error > 0)):
        raise ValueError(
            f"an order needs positive steps and errors, the least are {steps.min()} and {error.min()}"
        )
    return float(-np.polyfit(np.log(steps), np.log(error), 1)[0])


def by_method(measurements: Sequence[Measurement]) -> dict[str, list[Measurement]]:
    """Return the measurements of each method, in order of first appearance and then of unknowns."""
    groups: dict[str, list[Measurement]] = {}
    for each in measurements:
        groups.setdefault(each.method, []).append(each)
    return {method: sorted(group, key=lambda each: each.unknowns) for method, group in groups.items()}
