"""The modelling choices that chapter 4 leaves open, as variants of a set-up, and what each changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from thesislib import ocp
from thesislib.lap.channels import speed
from thesislib.lap.continuation import FAR
from thesislib.lap.minimum_time import SETTINGS, Lap, minimum_lap_time
from thesislib.lap.setups import Setup, Solved, Start, told
from thesislib.vehicles import CONTROLS, STATES

DAMPING_PER_RAD = 100.0
"""The printed k_d = 100 N/rpm read as 100 N m s/rad."""

DAMPING_PER_RPM = 100.0 * 60.0 / (2.0 * math.pi)
"""The printed k_d = 100 N/rpm read as 100 N m per revolution a minute: 955 N m s/rad."""

PEAK_BRAKING_SLIP = 0.083
"""Longitudinal slip at the force peak of a lightly loaded tyre: its rho of 0.751 times kappa_1 = 0.11."""

AT_WORK_N = 500.0
"""Force in N above which an axle's brakes or the engine are at work, where both may be."""

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
            f"The front brakes have {100 * front_brake_share:g} % of the brakes' force all lap long, the "
            "rear axle its share and the engine's drive. In (4.20) the ratio is free.",
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
    drive_on_brakes : float
        As `drive_on_brakes`, s.
    solved : Solved
        How the problem was solved.
    """

    choice: Choice
    lap_time: float
    top_speed: float
    lowest_speed: float
    drive_on_brakes: float
    solved: Solved

    @classmethod
    def from_result(cls, choice: Choice, result: Mapping[str, Any]) -> Variant:
        """Take what `solved_variant` has returned."""
        names = ("lap_time", "top_speed", "lowest_speed", "drive_on_brakes")
        return cls(choice, solved=Solved.of(result), **{name: result[name] for name in names})


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
        ``lap_time`` s, ``top_speed`` and ``lowest_speed`` m/s, ``drive_on_brakes`` s, and what `told` says of
        the solve.

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
        "drive_on_brakes": drive_on_brakes(lap),
        **told(lap.solution),
    }


def drive_on_brakes(lap: Lap) -> float:
    """Return for how long in s the engine drives against brakes of a fixed ratio; zero where they have none.

    Both count as at work above `AT_WORK_N`: the brakes by the force of the front wheels, the engine by what
    it adds to that of the rear ones.
    """
    share = lap.car.readings.fixed_brake_ratio
    if share is None:
        return 0.0
    braking = -(lap["F_flx"] + lap["F_frx"])
    drive = -lap["brake_ratio"] / share
    both = np.minimum(braking, drive) > AT_WORK_N
    return float(lap.solution.weights @ (lap["slowness"] * both))


def continued(setup: Setup, start: Start, tolerance: float, name: str) -> Lap:
    """Solve the lap of a set-up, starting from a lap on disk.

    A problem with the same constraints starts with the multipliers too, and so does one that has the limit of
    a brake ratio besides; a problem with other equations, from the states and controls alone.

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
    same = car.equations == base.car.equations and setup.edges == start.setup.edges
    limits = [one.readings.fixed_brake_ratio is not None for one in (setup, start.setup)]
    if same and limits[0] == limits[1]:
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
    guess: Any = _course(base, road.length)
    history: tuple[ocp.MeshRecord, ...] = ()
    if same:
        guess = ocp.solve(problem, ocp.Related(base.solution), base.solution.mesh, FAR)
        history = guess.history
    solution = ocp.solve(problem, guess, base.solution.mesh, SETTINGS, tolerance=tolerance)
    return Lap(name, road, car, replace(solution, history=(*history, *solution.history)))


def _course(lap: Lap, length: float) -> dict[str, Any]:
    """Return a lap's states and controls as functions of the distance on a road of another length."""

    def along(name: str) -> Any:
        return lambda s: lap.solution.interpolate(name, np.asarray(s) * (lap.period / length))

    return {name: along(name) for name in (*STATES, *CONTROLS)}
