"""Steady cornering of the full car: handling diagram, understeer gradient, limit of lateral acceleration.

At one speed V the car's equilibria form a curve that begins with straight running. Along it the car turns
at a constant yaw rate omega with the lateral acceleration omega V, the rear wheels push just enough to
keep the speed, and the front wheels roll freely: eleven unknowns (lateral speed, yaw rate, steer angle,
four slips, four loads) in ten equations, those of the lap with every rate of change zero. The curve is
followed by its arc length, so that the limit, where the lateral acceleration turns back, is found and not
run against.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, root

from thesislib.lap.yaw_stability import yaw_eigenvalues, yaw_jacobian
from thesislib.vehicles import CONTROLS, RacingCar
from thesislib.vehicles.racing_car import WHEELS

Array = NDArray[np.float64]

STANDARD_GRAVITY: Final = 9.80665  # m/s², the g of degrees per g

_UNKNOWNS = ("v", "omega", *CONTROLS)
_OMEGA = _UNKNOWNS.index("omega")
_STEP = 1e-30  # of the complex step; see `yaw_stability`
_ARC = 0.1  # first step along a branch, in scaled unknowns: a tenth of a g
_CLOSE = 1e-10  # residuals that count as zero, in units of weights and of the car's length
_LEAST_ARC = 1e-4


@dataclass(frozen=True, eq=False)
class Cornering:
    """One branch of equilibria at one speed, from straight running to the limit.

    Arrays have one entry per equilibrium, in the order of growing lateral acceleration.

    Attributes
    ----------
    car : RacingCar
        The car.
    values : mapping of str to float
        All numbers of the car, those that a set-up adjusts included.
    speed : float
        Of the mass centre, m/s.
    unknowns : ndarray (M, 11)
        v m/s, omega rad/s, and the control (4.26).
    tangents : ndarray (M, 11)
        How they change along the branch.
    ended_by : {"grip", "wheel lift"}
        Why the branch ends: the tyres give no more lateral acceleration, or a wheel carries nothing.
    """

    car: RacingCar
    values: Mapping[str, float]
    speed: float
    unknowns: Array
    tangents: Array
    ended_by: str

    def __getitem__(self, name: str) -> Array:
        """Return a state, control or quantity of the car (M,), SI; see `RacingCar.quantities`."""
        return np.asarray(self._channels[name])

    @cached_property
    def _channels(self) -> dict[str, Any]:
        x, u = _state(self.unknowns.T, self.speed)
        return {**x, **u, **self.car.quantities(x, u, 0.0, values=self.values)}

    @property
    def lateral_acceleration(self) -> Array:
        """omega V (M,), towards the middle of the turn, m/s²."""
        return np.asarray(self["omega"] * self.speed)

    @property
    def geometric_steer(self) -> Array:
        """Steer angle l/R (M,) of a car whose tyres do not slip, rad."""
        return np.asarray(self.values["wheelbase"] * self["omega"] / self.speed)

    @property
    def steer_for_slip(self) -> Array:
        """Steer angle less the geometric one (M,), rad: the ordinate of the handling diagram."""
        return np.asarray(self["delta"] - self.geometric_steer)

    @property
    def slip_difference(self) -> Array:
        """Mean slip angle of the front wheels less that of the rear ones (M,), rad."""
        fl, fr, rl, rr = (self[f"alpha_{wheel}"] for wheel in WHEELS)
        return np.asarray(0.5 * (rl + rr) - 0.5 * (fl + fr))

    @property
    def understeer_gradient(self) -> Array:
        """Derivative (M,) of `steer_for_slip` by the lateral acceleration, rad/(m/s²), along the branch."""
        steer = self.tangents[:, _UNKNOWNS.index("delta")] / self.tangents[:, _OMEGA]
        return np.asarray((steer - self.values["wheelbase"] / self.speed) / self.speed)

    @property
    def growth(self) -> Array:
        """Larger real part (M,) of the eigenvalues of v and omega, 1/s, with the hands still."""
        x, u = _state(self.unknowns.T, self.speed)
        return np.asarray(yaw_eigenvalues(yaw_jacobian(self.car, x, u, self.values))[:, 0].real)

    @property
    def limit(self) -> float:
        """Largest lateral acceleration of the branch, m/s²."""
        return float(self.lateral_acceleration[-1])

    @property
    def power_limit(self) -> float:
        """Lateral acceleration at which keeping the speed takes all the engine's power, m/s².

        Equal to `limit` where the tyres end the branch first; zero if the engine cannot keep the speed
        even straight on.
        """
        spare = self.values["P_max"] - self["power"]
        if spare[0] < 0.0:
            return 0.0
        short = np.flatnonzero(spare < 0.0)
        if not short.size:
            return self.limit
        a, b = short[0] - 1, short[0]
        share = spare[a] / (spare[a] - spare[b])
        a_y = self.lateral_acceleration
        return float(a_y[a] + share * (a_y[b] - a_y[a]))


def steady_cornering(car: RacingCar, speed: float, values: Mapping[str, float] | None = None) -> Cornering:
    """Follow the equilibria of a car at one speed from straight running to the limit, turning right.

    Parameters
    ----------
    car : RacingCar
        The car, with its suspension.
    speed : float
        Of the mass centre, m/s.
    values : mapping of str to float, optional
        Numbers of the car that a set-up changes, such as ``Lap.values`` where they are numbers; SI.

    Returns
    -------
    Cornering

    Raises
    ------
    ValueError
        If the speed is not positive, the suspension is rigid (nothing then says how the wheels share the
        load), or no equilibrium is found straight on.
    """
    if not speed > 0.0:
        raise ValueError(f"A car cannot corner at speed = {speed:g} m/s; the speed must be positive.")
    if car.readings.suspension == "rigid":
        raise ValueError(
            "The reading suspension='rigid' leaves open how the axles share the roll moment; steady "
            "cornering needs suspension='metamodel'."
        )
    equilibrium = _Equilibrium(car, {**car.values, **(values or {})}, speed)
    at = _straight_running(equilibrium)
    forwards = np.zeros(len(_UNKNOWNS))
    forwards[_OMEGA] = 1.0
    direction = equilibrium.tangent(at, forwards)
    places, tangents, arc = [at], [direction], _ARC
    while True:
        following = equilibrium.corrected(places[-1] + arc * tangents[-1], tangents[-1])
        if following is None:
            arc *= 0.5
            if arc < _LEAST_ARC:
                raise ValueError(f"No equilibrium was found next to a known one at {speed:g} m/s.")
            continue
        here = equilibrium.tangent(following, tangents[-1])
        lifted = equilibrium.heaviest_lift(following) > 0.0
        if lifted or here[_OMEGA] <= 0.0:
            break
        places.append(following)
        tangents.append(here)
        arc = min(_ARC, 2.0 * arc)

    def beyond(share: float) -> float:
        place = equilibrium.corrected(places[-1] + share * arc * tangents[-1], tangents[-1])
        assert place is not None, "between two known equilibria"
        if lifted:
            return equilibrium.heaviest_lift(place)
        return -float(equilibrium.tangent(place, tangents[-1])[_OMEGA])

    share = brentq(beyond, 0.0, 1.0, xtol=1e-9)
    last = equilibrium.corrected(places[-1] + share * arc * tangents[-1], tangents[-1])
    assert last is not None
    places.append(last)
    tangents.append(equilibrium.tangent(last, tangents[-1]))
    return Cornering(
        car,
        equilibrium.values,
        speed,
        np.array(places) * equilibrium.sizes,
        np.array(tangents) * equilibrium.sizes,
        "wheel lift" if lifted else "grip",
    )


def linear_understeer_gradient(cornering: Cornering) -> float:
    """Return the understeer gradient of the linear single-track car, rad/(m/s²).

    M/l (b/C_f - a/C_r) with the cornering stiffnesses of the two axles at the loads and slips of straight
    running, in which the differential, the roll and the air have no part.

    Parameters
    ----------
    cornering : Cornering
        A branch; its first equilibrium is straight running.
    """
    p = cornering.values
    stiffness = {}
    for wheel in WHEELS:
        load, kappa = -cornering[f"F_{wheel}z"][0], cornering[f"kappa_{wheel}"][0]
        tyre = cornering.car.tyre(load, kappa, 1j * _STEP, p)
        stiffness[wheel] = -tyre.F_y.imag / _STEP
    front, rear = stiffness["fl"] + stiffness["fr"], stiffness["rl"] + stiffness["rr"]
    a, b = p["a"], p["wheelbase"] - p["a"]
    return float(p["mass"] / p["wheelbase"] * (b / front - a / rear))


def degrees_per_g(gradient: Any) -> Any:
    """Return an understeer gradient in degrees per g, from rad/(m/s²)."""
    return np.degrees(gradient) * STANDARD_GRAVITY


class _Equilibrium:
    """Ten scaled equations in eleven scaled unknowns, and their exact Jacobian."""

    def __init__(self, car: RacingCar, p: Mapping[str, float], speed: float) -> None:
        self.car, self.values, self.speed = car, p, speed
        weight = p["mass"] * p["gravity"]
        own = {"v": 0.05 * speed, "omega": p["gravity"] / speed}
        own |= {f"F_{wheel}z": weight / 4.0 for wheel in WHEELS}
        self.sizes = np.array([own.get(name, 0.1) for name in _UNKNOWNS])
        moment = weight * p["wheelbase"]
        self._balances = {
            "vertical_balance": weight,
            "roll_balance": moment,
            "pitch_balance": moment,
            "differential_balance": moment,
            "roll_difference": 0.05,
        }

    def residuals(self, z: NDArray[Any]) -> NDArray[Any]:
        """Return the ten equations at scaled unknowns (11,) or (11, k)."""
        x, u = _state((z.T * self.sizes).T, self.speed)
        q, p = self.car.quantities(x, u, 0.0, values=self.values), self.values
        rows = [
            (q["a_x"] + x["omega"] * x["v"]) / p["gravity"],
            (q["a_y"] - x["omega"] * x["u"]) / p["gravity"],
            q["domega_ds"] / q["slowness"] * p["I_z"] / (p["mass"] * p["gravity"] * p["wheelbase"]),
            *(q[name] / size for name, size in self._balances.items()),
            u["kappa_fl"] / 0.1,
            u["kappa_fr"] / 0.1,
        ]
        return np.stack(np.broadcast_arrays(*rows))

    def jacobian(self, z: Array) -> Array:
        """Return the derivatives (10, 11) by a complex step."""
        moved = z[:, None] + 1j * _STEP * np.eye(len(z))
        return np.asarray(self.residuals(moved).imag / _STEP)

    def tangent(self, z: Array, along: Array) -> Array:
        """Return the unit vector along the branch that makes an acute angle with `along`."""
        direction = np.linalg.svd(self.jacobian(z))[2][-1]
        return np.asarray(direction if direction @ along > 0.0 else -direction)

    def corrected(self, guess: Array, normal: Array) -> Array | None:
        """Return the equilibrium in the plane through `guess` with that normal, or None if none is found."""

        def equations(z: Array) -> Array:
            return np.append(self.residuals(z), normal @ (z - guess))

        def derivatives(z: Array) -> Array:
            return np.vstack((self.jacobian(z), normal))

        found = root(equations, guess, jac=derivatives, tol=1e-13)
        return np.asarray(found.x) if np.abs(equations(found.x)).max() < _CLOSE else None

    def heaviest_lift(self, z: Array) -> float:
        """Return the largest vertical force in quarters of the weight: positive where a wheel would pull."""
        return max(float(z[_UNKNOWNS.index(f"F_{wheel}z")]) for wheel in WHEELS)


def _state(unknowns: NDArray[Any], speed: float) -> tuple[dict[str, Any], Mapping[str, Any]]:
    """Return state and control at the unknowns (11, …); the forward speed is what is left of V."""
    found = dict(zip(_UNKNOWNS, unknowns, strict=True))
    level = 0.0 * found["v"]
    x = {
        "n": level,
        "xi": level,
        "v": found["v"],
        "u": np.sqrt(speed**2 - found["v"] ** 2),
        "omega": found["omega"],
    }
    return x, {name: found[name] for name in CONTROLS}


def _straight_running(equilibrium: _Equilibrium) -> Array:
    """Return the scaled unknowns of the car that runs straight on at its speed."""
    p, speed = equilibrium.values, equilibrium.speed
    pressure = 0.5 * p["air_density"] * p["frontal_area"] * speed**2
    weight, b = p["mass"] * p["gravity"], p["wheelbase"] - p["a"]
    front = 0.5 * (weight * b / p["wheelbase"] + pressure * p["C_L_front_0"])
    rear = 0.5 * (weight * p["a"] / p["wheelbase"] + pressure * p["C_L_rear_0"])
    guess = {"F_flz": -front, "F_frz": -front, "F_rlz": -rear, "F_rrz": -rear}
    guess |= {"kappa_rl": 0.01, "kappa_rr": 0.01}
    z = np.array([guess.get(name, 0.0) for name in _UNKNOWNS]) / equilibrium.sizes
    turning = np.zeros(len(_UNKNOWNS))
    turning[_OMEGA] = 1.0
    found = equilibrium.corrected(z, turning)
    if found is None:
        raise ValueError(f"No equilibrium of the car was found straight on at {speed:g} m/s.")
    return found
