"""What every number of the car and every limit is worth in lap time, from the multipliers of one solve.

Prices are derivatives of the minimised objective, lap time and regulariser (2.171), times an amount that a
race engineer would change. They say what the first such amount brings, with everything else, the line
included, answering as it should: at an optimum that answer costs nothing to first order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from thesislib.lap.adjoint import adjoint_derivative, grip_density, quantities_with
from thesislib.lap.limits import (
    BRAKE,
    FRONT_HEIGHT,
    HALF_WIDTH,
    ROLL,
    constraint_densities,
    limit_densities,
)
from thesislib.lap.minimum_time import Array, Lap
from thesislib.lap.sectors import Sector, by_sector
from thesislib.ocp.sensitivity import constant_density, sensitivity
from thesislib.suspension.metamodel import Metamodel
from thesislib.suspension.stiffness import StiffenedMetamodel, StiffnessMetamodel

# Central differences of Table 3.2's quadratic polynomials, through the aerodynamic map: at this part of the
# stiffness their error is that of rounding.
_STIFFNESS_STEP = 1e-4


@dataclass(frozen=True)
class Amount:
    """A change of one number that an engineer would think of.

    Attributes
    ----------
    name : str
        The number, as the car, the set-up or this module calls it.
    label : str
        What it is.
    size : float
        The change, SI; of grip, as a part of what there is.
    per : str
        The change in words: ``"+10 kg"``.
    """

    name: str
    label: str
    size: float
    per: str


_POINT = 0.01  # of a coefficient
_PER_DEG2 = (180.0 / np.pi) ** 2

_CAR: Final = (
    Amount("mass", "mass", 10.0, "+10 kg"),
    Amount("P_max", "engine power", 10e3, "+10 kW"),
    Amount("a", "mass centre rearward", 0.01, "+10 mm"),
    Amount("h", "mass centre height", 0.01, "+10 mm"),
    Amount("I_z", "yaw inertia", 10.0, "+10 kg m²"),
    Amount("wheelbase", "wheelbase, rear axle moved", 0.01, "+10 mm"),
    Amount("w_f", "front half-track", 0.01, "+10 mm"),
    Amount("w_r", "rear half-track", 0.01, "+10 mm"),
    Amount("k_d", "differential damping", 1.0, "+1 N m s/rad"),
    Amount("air_density", "air density", 0.01, "+0.01 kg/m³"),
    Amount("frontal_area", "frontal area", 0.015, "+0.015 m²"),
    Amount("h_f_unloaded", "front ride height, lower", 1e-3, "1 mm"),
    Amount("h_r_unloaded", "rear ride height, lower", 1e-3, "1 mm"),
)

_COEFFICIENTS: Final = {"C_L_front": "front downforce", "C_L_rear": "rear downforce", "C_D": "drag"}
_TERMS: Final = (
    ("0", ", nominal", _POINT, "+0.01"),
    ("h_f", " by h_f", 0.1, "+0.001/cm"),
    ("h_r", " by h_r", 0.1, "+0.001/cm"),
    ("h_r2", " by h_r²", 1.0, "+0.0001/cm²"),
    ("beta2", " by side slip²", 1e-3 * _PER_DEG2, "+0.001/deg²"),
    ("delta2", " by steer²", 1e-3 * _PER_DEG2, "+0.001/deg²"),
    ("phi2", " by roll²", 1e-3 * _PER_DEG2, "+0.001/deg²"),
)

_AERODYNAMICS: Final = tuple(
    Amount(f"{name}_{term}", f"{label}{of}", size, per)
    for name, label in _COEFFICIENTS.items()
    for term, of, size, per in _TERMS
)

_TYRES: Final = (
    *(
        Amount(f"mu_{axis}{load}", f"{way} friction at {kN} kN", _POINT, "+0.01")
        for axis, way in (("x", "longitudinal"), ("y", "lateral"))
        for load, kN in ((1, 2), (2, 6))
    ),
    *(Amount(f"kappa_{load}", f"peak's slip at {kN} kN", 0.01, "+0.01") for load, kN in ((1, 2), (2, 6))),
    *(
        Amount(f"alpha_{load}", f"peak's slip angle at {kN} kN", np.pi / 180.0, "+1°")
        for load, kN in ((1, 2), (2, 6))
    ),
    Amount("Q_x", "longitudinal shape factor", 0.1, "+0.1"),
    Amount("Q_y", "lateral shape factor", 0.1, "+0.1"),
)

_LIMITS: Final = (
    Amount(HALF_WIDTH, "road, each edge outward", 0.1, "+10 cm"),
    Amount(FRONT_HEIGHT, "plank limit, lower", 1e-3, "1 mm"),
)

_STIFFNESSES: Final = (
    Amount("K_h_front", "front heave stiffness", 100e3, "+100 kN/m"),
    Amount("K_h_rear", "rear heave stiffness", 100e3, "+100 kN/m"),
)

_CONSTRAINTS: Final = (
    Amount(ROLL, "front rolls more than rear", np.pi / 1800.0, "+0.1°"),
    Amount(BRAKE, "outer front wheel brakes more", 100.0, "+100 N"),
)

GRIP: Final = Amount("grip", "grip of all four tyres", 0.01, "+1 %")
"""More of all four friction peaks, everywhere."""

AMOUNTS: Final = (*_CAR, *_STIFFNESSES, *_AERODYNAMICS, *_TYRES, *_LIMITS, *_CONSTRAINTS, GRIP)
"""Everything that `prices` prices, in the order of its table."""


@dataclass(frozen=True)
class Price:
    """What an amount of something is worth.

    Attributes
    ----------
    amount : Amount
        What changes.
    seconds : float
        Change of the minimised objective, s; negative is faster.
    """

    amount: Amount
    seconds: float


def prices(lap: Lap) -> tuple[Price, ...]:
    """Return the prices of `AMOUNTS`, as far as the lap's car has them.

    Numbers that the lap's readings keep out of the equations cost nothing and are left out: without a
    suspension, ride heights, stiffnesses and the plank.

    Parameters
    ----------
    lap : Lap
        A lap with its multipliers.

    Raises
    ------
    ocp.ProblemError
        If the lap has no multipliers.
    """
    totals = sensitivity(lap.solution)
    totals |= {name: float(lap.solution.weights @ each) for name, each in _further_densities(lap).items()}
    return tuple(Price(each, totals[each.name] * each.size) for each in AMOUNTS if each.name in totals)


def price_density(lap: Lap, name: str) -> Array:
    """Return where along the lap a number acts: a density in s/m per unit of the number, shape (N,).

    Its integral times the amount is the price.

    Raises
    ------
    ocp.ProblemError
        If nothing has that name.
    """
    further = _further_densities(lap)
    return further[name] if name in further else constant_density(lap.solution, name)


def grip_prices(lap: Lap, parts: Sequence[Sector], *, more: float = GRIP.size) -> Array:
    """Return what more grip of all four tyres in each sector alone is worth, s, shape (sectors,).

    Parameters
    ----------
    lap : Lap
        A lap with its multipliers.
    parts : sequence of Sector
        Where.
    more : float
        How much more, as a part.
    """
    return more * by_sector(lap, grip_density(lap), parts)


def stiffened(lap: Lap) -> Lap:
    """Return a lap whose car also knows Table 3.2's stiffnesses; at nominal stiffness nothing differs.

    Ride heights and roll angles stay those of the lap's own model, plus what Table 3.2 says that a change of
    stiffness adds to them at the lap's loads.
    """
    ride = lap.car.ride
    if not isinstance(ride, Metamodel):
        return lap
    return replace(lap, car=replace(lap.car, ride=StiffenedMetamodel(ride, StiffnessMetamodel.from_file())))


def _further_densities(lap: Lap) -> dict[str, Array]:
    """Return the densities of what is no constant of the problem, by name."""
    found = {**limit_densities(lap), **constraint_densities(lap), GRIP.name: grip_density(lap)}
    if lap.car.readings.suspension == "metamodel" and isinstance(lap.car.ride, Metamodel):
        with_stiffness = stiffened(lap)
        found |= {each.name: _stiffness_density(with_stiffness, each.name) for each in _STIFFNESSES}
    return found


def _stiffness_density(lap: Lap, name: str) -> Array:
    nominal = lap.car.values[name]
    return adjoint_derivative(
        lap, lambda more: quantities_with(lap, values={name: nominal + more}), _STIFFNESS_STEP * nominal
    )
