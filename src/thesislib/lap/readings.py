"""The modelling choices that chapter 4 leaves open, as variants of a set-up, and what each changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from thesislib import ocp
from thesislib.lap.channels import speed
from thesislib.lap.minimum_time import SETTINGS, Lap, minimum_lap_time
from thesislib.lap.setups import Setup, Solved, Start, told
from thesislib.vehicles import CONTROLS, STATES

DAMPING_PER_RAD = 100.0
"""The printed k_d = 100 N/rpm read as 100 N m s/rad."""

DAMPING_PER_RPM = 100.0 * 60.0 / (2.0 * math.pi)
"""The printed k_d = 100 N/rpm read as 100 N m per revolution a minute: 955 N m s/rad."""

PEAK_BRAKING_SLIP = 0.083
"""Longitudinal slip at the force peak of a lightly loaded tyre: its rho of 0.751 times kappa_1 = 0.11."""

SMOOTHING_M = (-0.1, 0.1)
"""Offsets of the centre line that the choices table has, m rms; positive is smoother."""


@dataclass(frozen=True)
class Choice:
    """One open choice, taken otherwise than in the base lap.

    Attributes
    ----------
    name : str
        Short name, unique among the choices.
    sentence : str
        What the base lap has, and what this variant has instead.
    setup : Setup
        The variant.
    """

    name: str
    sentence: str
    setup: Setup


def choices(base: Setup, *, front_brake_share: float = 0.6) -> tuple[Choice, ...]:
    """Return the choices of the table of chapter 4, each taken alone.

    Parameters
    ----------
    base : Setup
        Set-up of the base lap.
    front_brake_share : float
        Front share of the braking force of the variant with a fixed brake ratio, between 0 and 1.
    """

    def reading(name: str, sentence: str, **change: Any) -> Choice:
        return Choice(name, sentence, replace(base, readings=replace(base.readings, **change)))

    def damping(value: float, meaning: str) -> Choice:
        sentence = f"The differential's printed 100 N/rpm is read as {meaning} instead of 10.47 N m s/rad."
        return Choice(f"k_d = {value:.0f}", sentence, replace(base, values={**base.values, "k_d": value}))

    def smoothing(rms_m: float) -> Choice:
        kind = "smoother" if rms_m > 0 else "rougher"
        return Choice(
            f"{kind} road, {abs(rms_m):g} m",
            f"The centre line is {abs(rms_m):g} m rms from the published table's, on the {kind} side.",
            replace(base, offset_rms_m=rms_m),
        )

    return (
        reading(
            "drag at the mass centre",
            "Drag pitches the car about the mass centre, as the text of section 4.2.6 has it, not as (4.18).",
            drag_moment="mass_centre",
        ),
        reading(
            "S with the peak at 1",
            "S = tan(π/(2Q)), so that Table B.1's slips are those of the peak, not the printed (B.12).",
            shape_factor="peak_at_one",
        ),
        damping(DAMPING_PER_RPM, "100 N m per revolution a minute, 955 N m s/rad,"),
        damping(DAMPING_PER_RAD, "100 N m s/rad"),
        reading(
            "front brakes free",
            "The two front brake forces are free of each other: (4.20) is dropped.",
            brake="free",
        ),
        reading(
            f"brake ratio {front_brake_share:g}",
            f"The front axle takes a fixed {100 * front_brake_share:g} % of the braking force; "
            "the equations leave the ratio free.",
            fixed_brake_ratio=front_brake_share,
        ),
        reading(
            "power at the hubs",
            "The engine's limit holds for u F_x of the rear wheels, so that slip costs no power.",
            power_law="hub",
        ),
        Choice(
            "rear constant −88.04",
            "The rear ride height's constant is −88.04 mm, from the text of chapter 3, not −89.04.",
            replace(base, rear_constant="text"),
        ),
        Choice(
            "front slip before the peak",
            f"Front wheels may not brake beyond a slip of {PEAK_BRAKING_SLIP:g}, the peak, instead of 0.3.",
            replace(base, front_slip_limit=PEAK_BRAKING_SLIP),
        ),
        *(smoothing(rms_m) for rms_m in SMOOTHING_M),
    )


@dataclass(frozen=True)
class Variant:
    """What a choice has come to.

    Attributes
    ----------
    choice : Choice
        What was chosen.
    lap_time : float
        s.
    top_speed, lowest_speed : float
        Of the mass centre, m/s.
    solved : Solved
        How the problem was solved.
    """

    choice: Choice
    lap_time: float
    top_speed: float
    lowest_speed: float
    solved: Solved

    @classmethod
    def from_result(cls, choice: Choice, result: Mapping[str, Any]) -> Variant:
        """Take what `solved_variant` has returned."""
        return cls(choice, result["lap_time"], result["top_speed"], result["lowest_speed"], Solved.of(result))


def solved_variant(setup: Setup, start: Start, tolerance: float, name: str) -> dict[str, Any]:
    """Solve the lap of a set-up from a lap on disk; the function of a study.

    Parameters
    ----------
    setup : Setup
        What to solve.
    start : Start
        The lap to start from, also the one whose units scale the problem.
    tolerance : float
        Largest relative state error.
    name : str
        Stands in messages.

    Returns
    -------
    dict
        ``lap_time`` s, ``top_speed`` and ``lowest_speed`` m/s, and what `told` says of the solve.

    Raises
    ------
    ocp.SolveError
        If the solver did not finish or the error estimate stays above tolerance.
    """
    lap = continued(setup, start, tolerance, name)
    mps = speed(lap)
    return {
        "lap_time": lap.time,
        "top_speed": float(mps.max()),
        "lowest_speed": float(mps.min()),
        **told(lap.solution),
    }


def continued(setup: Setup, start: Start, tolerance: float, name: str) -> Lap:
    """Solve the lap of a set-up, starting from a lap on disk.

    A problem with the same constraints starts with the multipliers too; a problem with one more or one
    less, from the states and controls alone.

    Parameters
    ----------
    setup, start, tolerance, name
        As of `solved_variant`.

    Returns
    -------
    Lap

    Raises
    ------
    ocp.SolveError
        As `solved_variant`.
    """
    base = start.lap()
    road, car = setup.road(), setup.car()
    units = start.setup.units()
    if car.equations == base.car.equations and setup.edges == start.setup.edges:
        return minimum_lap_time(
            road,
            car,
            tolerance=tolerance,
            guess=base,
            name=name,
            units=units,
            **setup.options,
        )
    problem = setup.problem(name, units=units)
    course = _course(base, road.length)
    solution = ocp.solve(problem, course, base.solution.mesh, SETTINGS, tolerance=tolerance)
    return Lap(name, road, car, solution)


def _course(lap: Lap, length: float) -> dict[str, Any]:
    """Return a lap's states and controls as functions of the distance on a road of another length."""

    def along(name: str) -> Any:
        return lambda s: lap.solution.interpolate(name, np.asarray(s) * (lap.period / length))

    return {name: along(name) for name in (*STATES, *CONTROLS)}
