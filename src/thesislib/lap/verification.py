"""What a lap has to stand: re-solves of its neighbours, a finer mesh, and the conditions of optimality.

Re-integration and the first-order conditions come from `thesislib.ocp`; here are the neighbours of a lap
that is kept on disk, as cases of a study, and what they say about the lap.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thesislib.lap.limits import LIMITS, limit_prices, limits
from thesislib.lap.minimum_time import SETTINGS, Lap, minimum_lap_time
from thesislib.lap.setups import Start, told
from thesislib.ocp.optimality import optimality
from thesislib.ocp.sensitivity import sensitivity
from thesislib.vehicles import STATES

HALVED = "every interval halved"
"""Name of the case whose mesh has every interval of the lap's halved."""

# A difference of two laps is a hundredth of a second: what the barrier leaves in each must be far less.
NEIGHBOURLY = replace(SETTINGS, optimality=1e-8, draft=None)


def neighbours(
    start: Start, names: Iterable[str] = ("P_max", "mass"), *, step: float = 0.01
) -> dict[str, dict[str, Any]]:
    """Return the cases of `resolved` that verify a lap, for `studies.run`.

    Parameters
    ----------
    start : Start
        The lap.
    names : iterable of str
        Numbers of the car, or limits of the set-up (`LIMITS`), to change, each up and down.
    step : float
        Relative change, between 0 and 1.

    Returns
    -------
    dict
        `HALVED`, and two cases for each name; see `difference_names`.

    Raises
    ------
    KeyError
        If neither the car nor the set-up has such a number.
    """
    values = {**start.setup.car().values, **{name: getattr(start.setup, name) for name in LIMITS}}
    cases: dict[str, dict[str, Any]] = {HALVED: {"start": start, "halved": True}}
    for name in names:
        for case, sign in zip(difference_names(name), (1.0, -1.0), strict=True):
            cases[case] = {"start": start, "changes": {name: values[name] * (1.0 + sign * step)}}
    return cases


def difference_names(name: str) -> tuple[str, str]:
    """Return the names of the two cases in which a number of the car is larger and smaller."""
    return f"more {name}", f"less {name}"


def resolved(
    start: Start, changes: Mapping[str, float] | None = None, halved: bool = False
) -> dict[str, Any]:
    """Solve a lap again from itself, on its own mesh or on the halved one; the function of a study.

    On its own mesh the tolerance is a hundred times the lap's, so that nothing is refined: the difference of
    two laps is then the change of one and the same finite problem, not that of two meshes.

    Parameters
    ----------
    start : Start
        The lap.
    changes : mapping of str to float, optional
        Numbers of the car and limits of the set-up, in SI, that take the place of the lap's.
    halved : bool
        Whether every mesh interval is halved.

    Returns
    -------
    dict
        ``lap_time`` and ``objective`` (lap time and regulariser) in s; ``change_n`` …: the largest change
        of each state at the lap's collocation points; ``elapsed``: time in s at its own collocation points;
        and what `told` says of the solve.

    Raises
    ------
    ocp.SolveError
        If the solver did not finish.
    """
    base = start.lap()
    changes = changes or {}
    moved_limits: dict[str, Any] = {name: value for name, value in changes.items() if name in LIMITS}
    numbers = {name: value for name, value in changes.items() if name not in LIMITS}
    setup = replace(start.setup, values={**start.setup.values, **numbers}, **moved_limits)
    mesh = base.solution.mesh
    lap = minimum_lap_time(
        setup.road(),
        setup.car(),
        tolerance=start.tolerance if halved else min(100.0 * start.tolerance, 0.1),
        guess=base,
        name=HALVED if halved else "neighbour",
        settings=NEIGHBOURLY,
        mesh=mesh.halved() if halved else mesh,
        units=start.setup.units(),
        **setup.options,
    )
    moved = {f"change_{state}": _largest_change(lap, base, state) for state in STATES}
    return {
        "lap_time": lap.time,
        "objective": lap.solution.objective + lap.solution.regularisation,
        **moved,
        "elapsed": lap.t,
        **told(lap.solution),
    }


def _largest_change(lap: Lap, base: Lap, state: str) -> float:
    return float(np.abs(lap.solution.interpolate(state, base.s) - base[state]).max())


@dataclass(frozen=True)
class Derivative:
    """Derivative of the minimised objective with respect to one number of the lap, got twice.

    Attributes
    ----------
    name : str
        The number.
    from_multipliers : float
        By the multipliers of the lap alone, s per unit of the number.
    from_differences : float
        By the central difference of two laps solved again.
    """

    name: str
    from_multipliers: float
    from_differences: float

    @property
    def disagreement(self) -> float:
        """Difference of the two, relative to the second."""
        return abs(self.from_multipliers / self.from_differences - 1.0)


def derivatives(
    lap: Lap,
    results: Mapping[str, Mapping[str, Any]],
    names: Iterable[str] = ("P_max", "mass"),
    *,
    step: float = 0.01,
) -> dict[str, Derivative]:
    """Return the derivatives of a lap by its multipliers and by its solved neighbours.

    Both are those of lap time plus regulariser, which is what the solver minimises.

    Parameters
    ----------
    lap : Lap
        The lap.
    results : mapping
        Results of the cases of `neighbours`.
    names, step
        As given to `neighbours`.
    """
    exact = {**sensitivity(lap.solution), **limit_prices(lap)}
    values = {**lap.car.values, **limits(lap)}
    found = {}
    for name in names:
        more, less = (float(results[case]["objective"]) for case in difference_names(name))
        width = 2.0 * step * values[name]
        found[name] = Derivative(name, exact[name], (more - less) / width)
    return found


def elapsed_difference(
    results: Mapping[str, Mapping[str, Any]], name: str, width: float
) -> NDArray[np.float64]:
    """Return the derivative of elapsed time by a number at the lap's points, from its neighbours, shape (N,).

    Parameters
    ----------
    results : mapping
        Results of the cases of `neighbours`.
    name : str
        The number.
    width : float
        Difference of the number between the two cases, SI.
    """
    more, less = (np.asarray(results[case]["elapsed"]) for case in difference_names(name))
    return np.asarray((more - less) / width)


@dataclass(frozen=True)
class Condition:
    """How far one of the first-order conditions of optimality holds along a lap.

    Attributes
    ----------
    equation : str
        ``"costate n"``, ``"control delta"``, ``"hamiltonian"``.
    at_points, between : float
        Share of the collocation points, and of the middles between them, at which the residual is below
        the threshold times the equation's largest term along the lap.
    by_point : float
        Share of the collocation points at which it is below the threshold times the largest term at
        the same point, which may be small.
    """

    equation: str
    at_points: float
    between: float
    by_point: float


def conditions(lap: Lap, *, threshold: float = 1e-3) -> tuple[Condition, ...]:
    """Return how far the first-order conditions of optimality hold along a lap.

    Parameters
    ----------
    lap : Lap
        The lap.
    threshold : float
        Residual, relative to the equation's largest term, that counts as satisfied.
    """
    at_points = optimality(lap.solution, "collocation", "range").share(threshold)
    between = optimality(lap.solution, "between", "range").share(threshold)
    by_point = optimality(lap.solution, "collocation", "point").share(threshold)
    return tuple(Condition(name, at_points[name], between[name], by_point[name]) for name in at_points)
