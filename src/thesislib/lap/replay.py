"""The axles of chapter 3 moved by the loads of a lap, against the metamodel that the lap was solved with.

A lap takes its ride heights from a table of polynomials: the posture of an axle at rest under the loads of
the moment, and that posture only as well as the polynomials have it. Here the axle's mechanism is at rest
under the same loads, and in motion, so that the two errors come apart: motion less rest of one mechanism is
what the quasi-static assumption leaves out, rest less table what the polynomials do. Dampers and roll inertia
are not in the thesis; they are named guesses of the axles' files and of `replayed`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thesislib import ocp
from thesislib.lap.minimum_time import Lap
from thesislib.ocp.sensitivity import constant_density
from thesislib.suspension import Axle, Posture
from thesislib.suspension.dynamics import DynamicAxle, RideHistory, sprung_share
from thesislib.vehicles import RacingCar
from thesislib.vehicles.aerodynamics import AeroCoefficients, Attitude, aero_coefficients, aero_forces

Array = NDArray[np.float64]

AXLES = ("front", "rear")

RADIUS_OF_GYRATION_M = 0.35
"""Of the body about the roll axis: a guess, as in chapter 3."""

SETTLING_S = 12.0
"""The slowest mode falls by a factor e in a second: after twelve the beginning is a nanometre's matter."""


@dataclass(frozen=True, eq=False)
class Replay:
    """Both axles along a lap, at its N collocation points.

    Attributes
    ----------
    lap : Lap
        The lap whose tyre loads move the axles.
    table : Posture
        Ride heights in m and roll angles in rad by the lap's own metamodel.
    at_rest : Posture
        Those of the mechanism at rest under the loads of each point.
    moving : Posture
        Those of the mechanism in motion, on a lap that follows an equal one.
    tyre_forces : dict of ndarray, shape (N,)
        Vertical tyre forces in N (SAE) of the moving axles, by wheel (fl, fr, rl, rr).
    gap : float
        Largest difference in m between a moving ride height where the lap begins and where it ends.
    """

    lap: Lap
    table: Posture
    at_rest: Posture
    moving: Posture
    tyre_forces: dict[str, Array]
    gap: float

    @property
    def quasi_static(self) -> Difference:
        """Motion less rest of the same mechanism: the error of the quasi-static assumption."""
        return difference(self.lap, self.at_rest, self.moving)

    @property
    def table_error(self) -> Difference:
        """Rest less table: the error of the polynomials."""
        return difference(self.lap, self.table, self.at_rest)

    @property
    def both(self) -> Difference:
        """Motion less table."""
        return difference(self.lap, self.table, self.moving)

    def following(self) -> Posture:
        """Return the posture that the table gives for the tyre forces of the moving axles."""
        ride = self.lap.car.ride
        assert ride is not None  # `replayed` refuses a car without one
        F = self.tyre_forces
        found = ride.heights(F["fl"], F["fr"], F["rl"], F["rr"], self.lap.values)
        return Posture(found.h_f, found.h_r, found.phi_f, found.phi_r)


@dataclass(frozen=True, eq=False)
class Difference:
    """One posture of the car less another along a lap, and what it is worth at the lap's other inputs.

    Attributes
    ----------
    change : Posture
        Ride heights in m and roll angles in rad, shape (N,) each.
    downforce : dict of ndarray, shape (N,)
        Change of each axle's downforce in N, positive for more, by the map of Table 4.1.
    time_by_height : dict of float
        Lap time in s to first order in the ride height of each axle, the plank's limit included.
    time_by_plank : float
        The limit's part of it: what the front height costs or gains where the limit holds.
    time_by_roll : float
        Lap time in s to first order in what the change of both roll angles does to the coefficients.
    """

    change: Posture
    downforce: dict[str, Array]
    time_by_height: dict[str, float]
    time_by_plank: float
    time_by_roll: float

    @property
    def time(self) -> float:
        """All of it, s."""
        return sum(self.time_by_height.values()) + self.time_by_roll

    @property
    def height(self) -> dict[str, Array]:
        """Change of each axle's ride height in m, positive for lower."""
        return {"front": self.change.h_f, "rear": self.change.h_r}


def replayed(
    lap: Lap, axles: Mapping[str, Axle] | None = None, *, radius_of_gyration: float = RADIUS_OF_GYRATION_M
) -> Replay:
    """Move both axles by the tyre loads of a lap.

    The axles begin at rest, `SETTLING_S` before the start line, under the loads of the lap's end, so that
    a periodic lap has periodic heights. Loads are linear between collocation points.

    Parameters
    ----------
    lap : Lap
        A solved lap of a car with a metamodel.
    axles : mapping of Axle, optional
        ``"front"`` and ``"rear"``; by default those of ``data/suspension``, which Table 3.1 belongs to.
    radius_of_gyration : float
        Of the body about the roll axis, m.

    Raises
    ------
    ValueError
        If the car has no ride-height model or an adjusted set-up, or an axle is missing.
    ConvergenceError
        As `DynamicAxle.replay`.
    """
    if lap.car.readings.suspension != "metamodel":
        raise ValueError(
            f"{lap.name}: the car's suspension is rigid, so that there is no metamodel to compare."
        )
    if adjusted := [name for name, value in lap.adjustments.items() if value]:
        raise ValueError(
            f"{lap.name}: its set-up is adjusted ({', '.join(adjusted)}), but the axles are not; replay a "
            "lap without adjustments."
        )
    given = axles or {name: Axle.from_file(f"{name}_axle") for name in AXLES}
    if missing := [name for name in AXLES if name not in given]:
        raise ValueError(f"axles has no {' and no '.join(missing)}; a car needs front and rear.")
    settling = lap.t > lap.time - SETTLING_S
    t = np.concatenate((lap.t[settling] - lap.time, lap.t, [lap.time]))
    histories: dict[str, RideHistory] = {}
    for name in AXLES:
        axle = moving_axle(given[name], lap.car, name, radius_of_gyration)
        loads = [lap[f"F_{name[0]}{side}z"] for side in "lr"]
        histories[name] = axle.replay(
            t, *(np.concatenate((load[settling], load, load[:1])) for load in loads)
        )
    kept = slice(-len(lap.t) - 1, -1)
    front, rear = (histories[name] for name in AXLES)
    return Replay(
        lap,
        table=Posture(lap["h_f"], lap["h_r"], lap["phi_f"], lap["phi_r"]),
        at_rest=Posture(
            front.equilibrium.height[kept],
            rear.equilibrium.height[kept],
            front.equilibrium.roll[kept],
            rear.equilibrium.roll[kept],
        ),
        moving=Posture(front.height[kept], rear.height[kept], front.roll[kept], rear.roll[kept]),
        tyre_forces={
            f"{name[0]}{side}": histories[name].tyre_forces[kept, column]
            for name in AXLES
            for column, side in enumerate("lr")
        },
        gap=max(abs(float(one.height[-1] - one.height[kept.start])) for one in histories.values()),
    )


def moving_axle(axle: Axle, car: RacingCar, name: str, radius_of_gyration: float) -> DynamicAxle:
    """Return an axle with the share of the car's body that rests on it.

    Parameters
    ----------
    axle : Axle
    car : RacingCar
    name : {"front", "rear"}
        Which of the car's axles it is.
    radius_of_gyration : float
        Of the body about the roll axis, m.
    """
    values = car.values
    behind = values["a"] / values["wheelbase"]
    share = 1.0 - behind if name == "front" else behind
    mass = sprung_share(axle, -0.5 * values["mass"] * values["gravity"] * share)
    return DynamicAxle(axle, mass, mass * radius_of_gyration**2)


def difference(lap: Lap, before: Posture, after: Posture) -> Difference:
    """Return what changes from one posture along a lap to another, speed, slip and steer being the lap's.

    Parameters
    ----------
    lap : Lap
    before, after : Posture
        Ride heights in m and roll angles in rad at the lap's collocation points.
    """
    change = Posture(
        after.h_f - before.h_f, after.h_r - before.h_r, after.phi_f - before.phi_f, after.phi_r - before.phi_r
    )
    forces = aero_forces(lap["u"], _growth(lap, before, after), lap.values)
    by_roll = _growth(lap, before, replace(before, phi_f=after.phi_f, phi_r=after.phi_r))
    solution, w = lap.solution, lap.solution.weights
    height = {"h_f_unloaded": change.h_f, "h_r_unloaded": change.h_r}
    time = {name: float(w @ (constant_density(solution, name) * dh)) for name, dh in height.items()}
    return Difference(
        change,
        downforce={"front": forces.F_az_front, "rear": forces.F_az_rear},
        time_by_height=dict(zip(AXLES, time.values(), strict=True)),
        time_by_plank=float(w @ (solution.path_multiplier("ride_height") * change.h_f)),
        time_by_roll=sum(
            float(w @ (constant_density(solution, f"{name}_0") * dC)) for name, dC in vars(by_roll).items()
        ),
    )


def _growth(lap: Lap, before: Posture, after: Posture) -> AeroCoefficients:
    """Return what the coefficients gain from one posture to another."""
    old, new = (
        aero_coefficients(
            Attitude(**vars(posture), beta=lap["beta"], delta=lap["delta"]),
            lap.values,
            angles=lap.car.readings.aero_angles,
        )
        for posture in (before, after)
    )
    return AeroCoefficients(*(getattr(new, name) - getattr(old, name) for name in vars(old)))


def time_mean(lap: Lap, values: ArrayLike) -> float:
    """Return the mean over the lap's time of a channel at its collocation points.

    Points lie closer where the mesh is fine, so that a plain mean would weigh the corners twice.
    """
    duration = lap.solution.weights * lap["slowness"]
    return float(duration @ np.asarray(values, dtype=float) / duration.sum())


def time_rms(lap: Lap, values: ArrayLike) -> float:
    """Return the root mean square over the lap's time of a channel at its collocation points."""
    return float(np.sqrt(time_mean(lap, np.asarray(values, dtype=float) ** 2)))


def with_heights(problem: ocp.Problem, lap: Lap, change: Posture, *, share: float = 1.0) -> ocp.Problem:
    """Return the lap's problem for a car whose ride heights are moved along the lap.

    The changes enter as data, in the downforce as well as in the limit of the front height: the lap of this
    problem is what the first-order numbers of `Difference` foretell.

    Parameters
    ----------
    problem : ocp.Problem
        The problem of the lap.
    lap : Lap
        The lap at whose collocation points the changes are known; they are linear in between.
    change : Posture
        Ride heights to add, m; the roll angles are not used.
    share : float
        Part of the change to add.
    """

    def data(values: Array) -> ocp.problem.Callable[[Array], Array]:
        return lambda s: share * np.interp(s, lap.s, values, period=lap.period)

    def equations(at: ocp.Point) -> ocp.Equations:
        moved = {name: at[name] + at[f"change_{name}"] for name in ("h_f_unloaded", "h_r_unloaded")}
        return problem.equations(ocp.Point({**at, **moved}))

    changes = {"change_h_f_unloaded": data(change.h_f), "change_h_r_unloaded": data(change.h_r)}
    return replace(problem, equations=equations, data={**problem.data, **changes})
