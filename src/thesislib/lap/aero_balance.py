"""Laps with the downforce moved between the axles: what the balance is worth in time and in stability.

The offset a_off takes nominal downforce from the front axle and gives it to the rear one, drag as it was:
the fixed balance of rows M to P of Table 4.2, here not optimised but swept.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from thesislib.lap.minimum_time import Lap
from thesislib.lap.readings import continued
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

    @classmethod
    def from_result(cls, result: Mapping[str, Any]) -> Drivability:
        """Take what `balanced_lap` has returned."""
        return cls(result["name"], result["lap_time"], result["unstable_share"], result["largest_growth"])


def balances(
    base: Setup, start: Start, tolerance: float, offsets: Iterable[float] = OFFSETS
) -> dict[str, dict[str, Any]]:
    """Return the cases of `balanced_lap`, for `studies.run`.

    Parameters
    ----------
    base : Setup
        Set-up whose balance is moved.
    start : Start
        The lap from which each case is solved.
    tolerance : float
        Largest relative state error (2.162).
    offsets : iterable of float
        Values of a_off.

    Raises
    ------
    ValueError
        As `balanced`.
    """
    return {
        f"a_off = {offset:g}": {
            "setup": balanced(base, offset),
            "start": start,
            "tolerance": tolerance,
            "name": f"a_off = {offset:g}",
        }
        for offset in offsets
    }


def balanced_lap(setup: Setup, start: Start, tolerance: float, name: str) -> dict[str, Any]:
    """Solve the lap of a set-up and say how drivable it is; the function of a study.

    Parameters
    ----------
    setup, start, tolerance, name
        As of `readings.solved_variant`.

    Returns
    -------
    dict
        ``name``, ``lap_time`` s, ``unstable_share``, ``largest_growth`` 1/s, and what `told` says.

    Raises
    ------
    ocp.SolveError
        If the solver did not finish or the error estimate stays above tolerance.
    """
    lap = continued(setup, start, tolerance, name)
    return {**vars(Drivability.of(lap)), **told(lap.solution)}


def fastest_for_stability(points: Iterable[Drivability]) -> tuple[Drivability, ...]:
    """Return the Pareto front: the laps that no other beats in lap time and in unstable share at once.

    Sorted by lap time; a lap is beaten by one that is at least as good in both and better in one.
    """
    front: list[Drivability] = []
    for point in sorted(points, key=lambda each: (each.lap_time, each.unstable_share)):
        if not front or point.unstable_share < front[-1].unstable_share:
            front.append(point)
    return tuple(front)
