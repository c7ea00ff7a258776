"""What lies outside the data: loads beyond those that suspension and tyre were fitted to, and what they cost.

Metamodel and tyre are polynomials of the wheel loads, known over a range and continued beyond it. A lap goes
beyond. What that is worth is told by the other extreme, a relation that stays at the end of its range what
it is there: to first order from the multipliers of the one lap, and by solving the lap again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from thesislib.lap.adjoint import adjoint_change, quantities_with
from thesislib.lap.channels import WHEEL_NAMES, time_shares
from thesislib.lap.minimum_time import Lap, minimum_lap_time
from thesislib.lap.setups import Start, told
from thesislib.suspension.held import HeldHeights
from thesislib.suspension.metamodel import Metamodel
from thesislib.suspension.stiffness import StiffnessMetamodel
from thesislib.vehicles import RacingCar

Array = NDArray[np.float64]

Relation = Literal["tyres", "ride_heights"]
RELATIONS: Final[dict[Relation, str]] = {
    "tyres": "friction peaks of the tyres and their slips",
    "ride_heights": "ride heights of the metamodel",
}
"""Relations that can be held at the end of their range."""


@dataclass(frozen=True)
class TimeOutside:
    """How long a lap's loads lie outside the data, in s.

    Attributes
    ----------
    metamodel_front, metamodel_rear : float
        A tyre of the axle carries more than the heaviest of the mesh that was fitted.
    tyre_light, tyre_heavy : dict of str to float
        Each wheel, ``fl`` …, below the lighter and above the heavier load of Table B.1.
    any_tyre : float
        At least one wheel is outside.
    """

    metamodel_front: float
    metamodel_rear: float
    tyre_light: dict[str, float]
    tyre_heavy: dict[str, float]
    any_tyre: float


def time_outside(lap: Lap) -> TimeOutside:
    """Return how long a lap's loads lie outside the metamodel's mesh and the tyre's data.

    Raises
    ------
    ValueError
        If the car's ride-height model is no metamodel.
    """
    ride, values, time = _metamodel(lap.car), lap.values, time_shares(lap)
    loads = {wheel: -lap[f"F_{wheel}z"] for wheel in WHEEL_NAMES}
    light = {wheel: load < values["F_z1"] for wheel, load in loads.items()}
    heavy = {wheel: load > values["F_z2"] for wheel, load in loads.items()}
    outside = np.logical_or.reduce([*light.values(), *heavy.values()])
    front = np.maximum(loads["fl"], loads["fr"]) > -ride.heaviest_front
    rear = np.maximum(loads["rl"], loads["rr"]) > -ride.heaviest_rear
    return TimeOutside(
        float(time @ front),
        float(time @ rear),
        {wheel: float(time @ each) for wheel, each in light.items()},
        {wheel: float(time @ each) for wheel, each in heavy.items()},
        float(time @ outside),
    )


def held(car: RacingCar, relation: Relation) -> RacingCar:
    """Return a car one of whose relations stays at the end of its range what it is there.

    Parameters
    ----------
    car : RacingCar
        A car that continues it.
    relation : {"tyres", "ride_heights"}
        Which; see `RELATIONS`. Roll angles are continued in either case, see `HeldHeights`.

    Raises
    ------
    ValueError
        If there is no such relation, or the car has no metamodel whose heights could be held.
    """
    if relation == "tyres":
        return replace(car, readings=replace(car.readings, tyre_load_range="held"))
    if relation == "ride_heights":
        return replace(car, ride=HeldHeights(_metamodel(car)))
    raise ValueError(f"relation = {relation!r} cannot be held at its range; known: {', '.join(RELATIONS)}.")


def held_change(lap: Lap, relation: Relation, *, limits: bool = True) -> Array:
    """Return where along a lap, to first order, holding a relation at its range changes the lap time.

    Parameters
    ----------
    lap : Lap
        An optimum with its multipliers.
    relation : {"tyres", "ride_heights"}
        As of `held`.
    limits : bool
        Whether the plank limit sees the held height too; without it only forces change.

    Returns
    -------
    ndarray (N,)
        s/m; its integral, ``lap.solution.weights @ density``, is the change in s.
    """
    changed = quantities_with(lap, held(lap.car, relation))
    if not limits:
        changed = {name: value for name, value in changed.items() if name != "h_f"}
    return adjoint_change(lap, changed)


def held_lap(start: Start, relation: Relation, tolerance: float) -> dict[str, Any]:
    """Solve a lap again with a relation held at its range; the function of a study.

    Parameters
    ----------
    start : Start
        The lap that continues it.
    relation : {"tyres", "ride_heights"}
        As of `held`.
    tolerance : float
        Largest relative state error.

    Returns
    -------
    dict
        ``lap_time`` and ``objective`` (lap time and regulariser) in s, and what `told` says of the solve.

    Raises
    ------
    ValueError
        As `held`.
    ocp.SolveError
        If the solver did not finish or the error estimate stays above tolerance.
    """
    base = start.lap()
    lap = minimum_lap_time(
        base.track,
        held(base.car, relation),
        tolerance=tolerance,
        guess=base,
        name=f"{relation} held",
        units=start.setup.units(),
        **start.setup.options,
    )
    return {
        "lap_time": lap.time,
        "objective": lap.solution.objective + lap.solution.regularisation,
        **told(lap.solution),
    }


def held_laps(start: Start, tolerance: float) -> Mapping[str, dict[str, Any]]:
    """Return the cases of `held_lap`, one for each relation, for `studies.run`."""
    return {
        f"{relation} held": {"start": start, "relation": relation, "tolerance": tolerance}
        for relation in RELATIONS
    }


def _metamodel(car: RacingCar) -> Metamodel | StiffnessMetamodel:
    if not isinstance(car.ride, Metamodel | StiffnessMetamodel):
        raise ValueError(
            f"The car's ride-height model is {type(car.ride).__name__}; the loads it was fitted to are "
            "known of Metamodel and StiffnessMetamodel only."
        )
    return car.ride
