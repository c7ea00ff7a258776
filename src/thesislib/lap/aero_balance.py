"""Laps with the downforce moved between the axles: what the balance is worth in time and in stability.

The offset a_off takes nominal downforce from the front axle and gives it to the rear one, drag as it was:
the fixed balance of rows M to P of Table 4.2, here not optimised but swept.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from thesislib import ocp
from thesislib.lap.minimum_time import SETTINGS, Lap
from thesislib.lap.setups import Setup, Start, told
from thesislib.lap.yaw_stability import yaw_stability

OFFSETS: Final = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)
"""Offsets of the sweep; the base lap has none."""


def balanced(setup: Setup, offset: float) -> Setup:
    """Return a set-up whose nominal downforce coefficients are moved to the rear by `offset`.

    Parameters
    ----------
    setup : Setup
        The set-up; it keeps its other numbers.
    offset : float
        a_off, taken from ``C_L_front_0`` and added to ``C_L_rear_0``; a pure number.

    Raises
    ------
    ValueError
        If a coefficient leaves its range.
    """
    own = setup.car().values
    moved = {"C_L_front_0": own["C_L_front_0"] - offset, "C_L_rear_0": own["C_L_rear_0"] + offset}
    setup.car().replace(**moved)  # refuses what is outside the ranges, before anything is solved
    return replace(setup, values={**setup.values, **moved})


# Drafts show a lap time that is a third of a millisecond too long, which no picture of a sweep can tell;
# solving each lap of a chain to the end takes two thirds more iterations.
DRAFTS: Final = replace(SETTINGS, optimality=SETTINGS.draft or SETTINGS.optimality, draft=None)


@dataclass(frozen=True)
class Drivability:
    """A lap as a point between fast and drivable.

    Attributes
    ----------
    name : str
        Which lap.
    lap_time : float
        s.
    unstable_share : float
        Share of the lap time, 0 .. 1, for which a small slide grows when nobody steers.
    largest_growth : float
        Largest growth rate, 1/s.
    """

    name: str
    lap_time: float
    unstable_share: float
    largest_growth: float

    @classmethod
    def of(cls, lap: Lap) -> Drivability:
        """Return the point of a lap."""
        stability = yaw_stability(lap)
        return cls(lap.name, lap.time, stability.unstable_share, stability.largest_growth)


def sweep(
    base: Setup, starts: Mapping[float, Start], tolerance: float, offsets: Iterable[float] = OFFSETS
) -> dict[str, dict[str, Any]]:
    """Return the cases of `balanced_laps`, for `studies.run`: a chain of laps from each start, upwards.

    A lap is solved from its neighbour in the chain. From a lap that is four steps away the same solve takes
    ten times the iterations, so that a case for every offset would cost more than the chains in all.

    Parameters
    ----------
    base : Setup
        Set-up whose balance is moved.
    starts : mapping of float to Start
        Solved laps by the offset that they have: 0 for the base lap. Each offset is reached from the
        nearest one below.
    tolerance : float
        Largest relative state error (2.162).
    offsets : iterable of float
        Values of a_off to solve for.

    Raises
    ------
    ValueError
        As `balanced`, or if an offset lies below every start.
    """
    chains: dict[float, list[float]] = {offset: [] for offset in sorted(starts)}
    for offset in sorted(offsets):
        below = [known for known in chains if known < offset]
        if not below:
            raise ValueError(
                f"a_off = {offset:g} lies at or below every lap to start from: "
                f"{', '.join(f'{known:g}' for known in chains)}."
            )
        balanced(base, offset)
        chains[below[-1]].append(offset)
    return {
        f"a_off = {chain[0]:g} .. {chain[-1]:g}": {
            "base": base,
            "start": starts[known],
            "tolerance": tolerance,
            "offsets": tuple(chain),
        }
        for known, chain in chains.items()
        if chain
    }


def balanced_laps(base: Setup, start: Start, tolerance: float, offsets: Sequence[float]) -> dict[str, Any]:
    """Solve the laps of a chain of balances, each from the one before; the function of a study.

    Parameters
    ----------
    base : Setup
        Set-up whose balance is moved.
    start : Start
        The lap to start from, also the one whose units scale the problems.
    tolerance : float
        Largest relative state error.
    offsets : sequence of float
        Values of a_off, each near the one before.

    Returns
    -------
    dict
        ``offset``, ``lap_time`` s, ``unstable_share``, ``largest_growth`` 1/s: arrays with an entry for each
        lap; and what `told` says of the last solve.

    Raises
    ------
    ocp.SolveError
        If the solver did not finish or the error estimate stays above tolerance.
    """
    solution, points = start.lap().solution, []
    for offset in offsets:
        name, setup = f"a_off = {offset:g}", balanced(base, offset)
        problem = setup.problem(name, units=start.setup.units())
        related = ocp.Related(solution)
        solution = ocp.solve(problem, related, solution.mesh, DRAFTS, tolerance=tolerance)
        points.append(Drivability.of(Lap(name, setup.road(), setup.car(), solution, setup.ranges)))
    return {
        "offset": np.array(offsets),
        "lap_time": np.array([each.lap_time for each in points]),
        "unstable_share": np.array([each.unstable_share for each in points]),
        "largest_growth": np.array([each.largest_growth for each in points]),
        **told(solution),
    }


def swept(results: Mapping[str, Mapping[str, Any]]) -> tuple[Drivability, ...]:
    """Return the laps that the chains of `balanced_laps` have come to, by growing offset."""
    found = []
    for result in results.values():
        columns = (result[name] for name in ("offset", "lap_time", "unstable_share", "largest_growth"))
        found += [tuple(float(each) for each in row) for row in zip(*columns, strict=True)]
    return tuple(Drivability(f"a_off = {offset:g}", *rest) for offset, *rest in sorted(found))


def fastest_for_stability(points: Iterable[Drivability]) -> tuple[Drivability, ...]:
    """Return the Pareto front: the laps that no other beats in lap time and in unstable share at once.

    Sorted by lap time; a lap is beaten by one that is at least as good in both and better in one.
    """
    front: list[Drivability] = []
    for point in sorted(points, key=lambda each: (each.lap_time, each.unstable_share)):
        if not front or point.unstable_share < front[-1].unstable_share:
            front.append(point)
    return tuple(front)
