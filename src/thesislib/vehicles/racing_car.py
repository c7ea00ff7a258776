"""The racing car of chapters 4 and 5: three degrees of freedom on a plane road, four loaded wheels.

One pure function, :meth:`RacingCar.quantities`, maps state, control and road curvature to the derivatives
per metre of centre line, the residuals of the algebraic equations and everything worth plotting. It serves
numbers, numpy arrays and casadi expressions; there is no second copy of the physics.

SAE axes: x forward, y right, z down; positions along y are therefore positive on the right-hand side, and
the vertical tyre forces F_z that the road exerts are negative.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from thesislib.vehicles.aerodynamics import AeroForces, Attitude, aero_coefficients, aero_forces
from thesislib.vehicles.elementary import elementary
from thesislib.vehicles.parameters import ParameterSet, unknown_name
from thesislib.vehicles.readings import Readings
from thesislib.vehicles.ride_heights import RideHeightModel
from thesislib.vehicles.tyres import TyreForces, tyre_forces

WHEELS = ("fl", "fr", "rl", "rr")
STATES = ("n", "xi", "v", "u", "omega")
"""Names of the state (4.25)."""
CONTROLS = ("delta", *(f"kappa_{wheel}" for wheel in WHEELS), *(f"F_{wheel}z" for wheel in WHEELS))
"""Names of the control (4.26)."""


@dataclass(frozen=True)
class _Wheel:
    """Motion, slip and force of one wheel."""

    alpha: Any
    Omega: Any
    tyre: TyreForces

    def named(self, wheel: str) -> Iterator[tuple[str, Any]]:
        """Yield the channels of this wheel under the names of `RacingCar.quantities`."""
        yield f"F_{wheel}x", self.tyre.F_x
        yield f"F_{wheel}y", self.tyre.F_y
        yield f"alpha_{wheel}", self.alpha
        yield f"Omega_{wheel}", self.Omega
        yield f"rho_{wheel}", self.tyre.rho
        yield f"mu_x_{wheel}", self.tyre.mu_x
        yield f"mu_y_{wheel}", self.tyre.mu_y


@dataclass(frozen=True)
class RacingCar:
    """The car: its parameters, the readings of the thesis's open places, and its ride-height model.

    Attributes
    ----------
    parameters : ParameterSet
        Tables C.1, B.1 and 4.1.
    ride : RideHeightModel or None
        Loads to ride heights and roll angles; may be None only for a rigid suspension.
    readings : Readings
        The choices the thesis leaves open.

    Raises
    ------
    ValueError
        If the mass centre does not lie between the axles, or the readings ask for a ride-height model and
        none is given.
    """

    parameters: ParameterSet
    ride: RideHeightModel | None = None
    readings: Readings = field(default_factory=Readings)

    def __post_init__(self) -> None:
        p = self.parameters.values
        if not p["a"] < p["wheelbase"]:
            raise ValueError(
                f"The mass centre, a = {p['a']:g} m behind the front axle, must lie between the axles: "
                f"the wheelbase is {p['wheelbase']:g} m."
            )
        if self.readings.suspension == "metamodel" and self.ride is None:
            raise ValueError(
                "The car has no ride-height model; give it one (ride=...), or take the reading "
                "suspension='rigid'."
            )

    @classmethod
    def from_file(
        cls,
        name_or_path: str | Path = "racing_car",
        *,
        ride: RideHeightModel | None = None,
        readings: Readings | None = None,
        tyre: str | Path = "racing_tyre",
        aerodynamics: str | Path = "racing_car_aerodynamics",
        **values: float,
    ) -> RacingCar:
        """Read a car from its parameter files; keyword arguments replace single values, in SI.

        Parameters
        ----------
        name_or_path : str or Path
            Vehicle set in ``data/vehicles`` or TOML file.
        ride : RideHeightModel, optional
            Loads to ride heights and roll angles.
        readings : Readings, optional
            Choices the thesis leaves open; the defaults reproduce its printed forms.
        tyre, aerodynamics : str or Path
            Sets in ``data/tyres`` and ``data/vehicles``.
        **values : float
            For example ``mass=700.0`` (kg), ``P_max=571e3`` (W), ``a=1.75`` (m).

        Raises
        ------
        FileNotFoundError, KeyError, TypeError, ValueError
            As of `ParameterSet` and `RacingCar`.
        """
        sets = (
            ParameterSet.from_file(name_or_path),
            ParameterSet.from_file(tyre, "tyres"),
            ParameterSet.from_file(aerodynamics),
        )
        parameters = ParameterSet.union(sets[0].name, sets).replace(**values)
        return cls(parameters, ride, readings or Readings())

    @property
    def values(self) -> dict[str, float]:
        """Every number of the car by name, SI, those of the ride-height model included."""
        own = self.parameters.values
        return own if self.ride is None else {**own, **self.ride.values}

    def replace(self, **values: float) -> RacingCar:
        """Return a car with other parameter values, in SI; refuses as `ParameterSet.replace` does."""
        return replace(self, parameters=self.parameters.replace(**values))

    @property
    def equations(self) -> tuple[str, ...]:
        """Names of the residuals in `quantities` that must vanish, under these readings."""
        names = ["vertical_balance", "roll_balance", "pitch_balance", "differential_balance"]
        if self.readings.suspension == "metamodel":
            names.append("roll_difference")
        if self.readings.brake == "equal_front_forces":
            names.append("brake_difference")
        return tuple(names)

    def tyre(self, N: Any, kappa: Any, alpha: Any, values: Mapping[str, Any] | None = None) -> TyreForces:
        """Return the forces of one of the car's tyres, under its readings; see `tyres.tyre_forces`."""
        own = self.parameters.values if values is None else values
        return tyre_forces(N, kappa, alpha, own, self.readings.shape_factor, self.readings.tyre_load_range)

    def quantities(
        self,
        x: Mapping[str, Any],
        u: Mapping[str, Any],
        curvature: Any,
        *,
        values: Mapping[str, Any] | None = None,
    ) -> dict[str, Any]:
        """Return everything the model knows at one or many points of the road.

        Parameters
        ----------
        x : mapping
            State (4.25): ``n`` m, ``xi`` rad, ``v`` m/s, ``u`` m/s, ``omega`` rad/s. Entries may be floats,
            numpy arrays of one shape, or casadi expressions; so may those of the other arguments.
        u : mapping
            Control (4.26): ``delta`` rad, ``kappa_fl`` …, ``F_flz`` … ≤ 0 in N.
        curvature : float, numpy.ndarray or casadi expression
            C of the centre line, 1/m, positive in a right-hand turn.
        values : mapping, optional
            Replacements for some or all of `values`, for example casadi symbols. Ranges are not
            checked here.

        Returns
        -------
        dict
            ``slowness`` S_f of (4.4), s/m; derivatives per metre ``dn_ds dxi_ds dv_ds du_ds domega_ds``,
            (4.5), (4.6), (4.10)-(4.12); residuals ``vertical_balance`` (4.16) N, ``roll_balance`` (4.17) N m,
            ``pitch_balance`` (4.18) N m, ``roll_difference`` (4.19) rad, ``brake_difference`` (4.20) N,
            ``differential_balance`` (4.21) N m; ``power`` W delivered by the engine; if that reading is taken
            ``brake_ratio`` N, -share times the engine's drive of the rear axle, at most zero; ``h_f h_r`` m,
            ``phi_f phi_r beta`` rad, ``C_L_front C_L_rear C_D``, ``F_az_front F_az_rear F_ax`` N,
            ``a_x a_y`` m/s² of the mass centre; and per wheel (fl, fr, rl, rr) ``F_flx F_fly`` N,
            ``alpha_fl`` rad, ``rho_fl``, ``Omega_fl`` rad/s, ``mu_x_fl mu_y_fl``.

        Raises
        ------
        KeyError
            If a state or control is missing or a replaced value unknown; the message names it.
        """
        p = self._merged(values)
        xp = elementary(curvature, *x.values(), *u.values(), *p.values())
        wheels = self._wheels(xp, x, u, p)
        heights = self._heights(u, p)
        beta = xp.arctan(x["v"] / x["u"])
        attitude = Attitude(**heights, beta=beta, delta=u["delta"])
        coefficients = aero_coefficients(attitude, p, angles=self.readings.aero_angles)
        aero = aero_forces(x["u"], coefficients, p)
        forces = _resultant(xp, u["delta"], wheels, aero.F_ax, p)
        return {
            **_motion(xp, x, curvature, forces, p),
            **self._balances(u, wheels, aero, forces, p),
            "power": self._power(x["u"], wheels, p),
            "roll_difference": heights["phi_f"] - heights["phi_r"],
            **heights,
            "beta": beta,
            **vars(coefficients),
            **vars(aero),
            **{name: value for wheel, one in wheels.items() for name, value in one.named(wheel)},
        }

    def _merged(self, values: Mapping[str, Any] | None) -> Mapping[str, Any]:
        own = self.values
        if values is None:
            return own
        for name in values:
            if name not in own:
                raise KeyError(unknown_name(name, own, self.parameters.name))
        return {**own, **values}

    def _wheels(
        self, xp: Any, x: Mapping[str, Any], u: Mapping[str, Any], p: Mapping[str, Any]
    ) -> dict[str, _Wheel]:
        """Return the four wheels: hub velocity in wheel axes, slip angle (4.15), rolling speed, forces."""
        sin_delta, cos_delta = xp.sin(u["delta"]), xp.cos(u["delta"])
        front_sideways = x["v"] + x["omega"] * p["a"]
        rear_sideways = x["v"] - x["omega"] * (p["wheelbase"] - p["a"])
        wheels = {}
        for name, side in (("fl", -1), ("fr", 1), ("rl", -1), ("rr", 1)):
            if name[0] == "f":
                forward = x["u"] - side * x["omega"] * p["w_f"]
                u_w = cos_delta * forward + sin_delta * front_sideways
                v_w = cos_delta * front_sideways - sin_delta * forward
            else:
                u_w, v_w = x["u"] - side * x["omega"] * p["w_r"], rear_sideways
            alpha = xp.arctan(v_w / u_w)
            kappa = u[f"kappa_{name}"]
            tyre = self.tyre(-u[f"F_{name}z"], kappa, alpha, p)
            # (4.13) with the spin counted positive when rolling forwards, the sign that (4.20), (4.21) need
            wheels[name] = _Wheel(alpha, (1 + kappa) * u_w / p["R"], tyre)
        return wheels

    def _heights(self, u: Mapping[str, Any], p: Mapping[str, Any]) -> dict[str, Any]:
        if self.readings.suspension == "rigid" or self.ride is None:
            level = 0 * u["F_flz"]  # zero in the shape of the loads, so that arrays stay arrays
            h_f, h_r = p["h_f_nominal"] + level, p["h_r_nominal"] + level
            return {"h_f": h_f, "h_r": h_r, "phi_f": level, "phi_r": level}
        posture = self.ride.heights(u["F_flz"], u["F_frz"], u["F_rlz"], u["F_rrz"], p)
        return {"h_f": posture.h_f, "h_r": posture.h_r, "phi_f": posture.phi_f, "phi_r": posture.phi_r}

    def _balances(
        self,
        u: Mapping[str, Any],
        wheels: Mapping[str, _Wheel],
        aero: AeroForces,
        forces: _Resultant,
        p: Mapping[str, Any],
    ) -> dict[str, Any]:
        """Return the residuals of (4.16)-(4.18), (4.20), (4.21) and, if so read, the brake ratio's excess."""
        fl, fr, rl, rr = (wheels[name].tyre for name in WHEELS)
        front_z, rear_z = u["F_flz"] + u["F_frz"], u["F_rlz"] + u["F_rrz"]
        pitching = forces.F_x if self.readings.drag_moment == "ground" else forces.F_x - aero.F_ax
        spin_difference = wheels["rl"].Omega - wheels["rr"].Omega
        residuals = {
            "vertical_balance": front_z
            + rear_z
            + p["mass"] * p["gravity"]
            + aero.F_az_front
            + aero.F_az_rear,
            "roll_balance": (
                p["w_r"] * (u["F_rlz"] - u["F_rrz"])
                + p["w_f"] * (u["F_flz"] - u["F_frz"])
                + p["h"] * forces.F_y
            ),
            "pitch_balance": (
                (p["wheelbase"] - p["a"]) * (rear_z + aero.F_az_rear)
                - p["a"] * (front_z + aero.F_az_front)
                + p["h"] * pitching
            ),
            "brake_difference": fl.F_x - fr.F_x,
            "differential_balance": p["R"] * (rl.F_x - rr.F_x) + p["k_d"] * spin_difference,
        }
        if (share := self.readings.fixed_brake_ratio) is not None:
            # Brakes with share / (1 - share) of the rear's force in front; the rest of the rear's is drive.
            residuals["brake_ratio"] = (1 - share) * (fl.F_x + fr.F_x) - share * (rl.F_x + rr.F_x)
        return residuals

    def _power(self, speed: Any, wheels: Mapping[str, _Wheel], p: Mapping[str, Any]) -> Any:
        """Return the engine's power in W: into the wheels, or, by the other reading, into the hubs."""
        rl, rr = wheels["rl"], wheels["rr"]
        if self.readings.power_law == "wheel":
            return p["R"] * (rl.Omega * rl.tyre.F_x + rr.Omega * rr.tyre.F_x)
        return speed * (rl.tyre.F_x + rr.tyre.F_x)


@dataclass(frozen=True)
class _Resultant:
    """Forces (4.8), (4.9) in N and the yaw moment of (4.7) in N m on the whole car."""

    F_x: Any
    F_y: Any
    M_z: Any


def _resultant(
    xp: Any, delta: Any, wheels: Mapping[str, _Wheel], F_ax: Any, p: Mapping[str, Any]
) -> _Resultant:
    fl, fr, rl, rr = (wheels[name].tyre for name in WHEELS)
    sin_delta, cos_delta = xp.sin(delta), xp.cos(delta)
    front_x = cos_delta * (fr.F_x + fl.F_x) - sin_delta * (fr.F_y + fl.F_y)
    front_y = cos_delta * (fr.F_y + fl.F_y) + sin_delta * (fr.F_x + fl.F_x)
    rear_y = rr.F_y + rl.F_y
    left_minus_right_x = cos_delta * (fl.F_x - fr.F_x) - sin_delta * (fl.F_y - fr.F_y)
    return _Resultant(
        F_x=front_x + rr.F_x + rl.F_x + F_ax,
        F_y=front_y + rear_y,
        M_z=(
            p["a"] * front_y
            - (p["wheelbase"] - p["a"]) * rear_y
            + p["w_f"] * left_minus_right_x
            + p["w_r"] * (rl.F_x - rr.F_x)
        ),
    )


def _motion(
    xp: Any, x: Mapping[str, Any], curvature: Any, forces: _Resultant, p: Mapping[str, Any]
) -> dict[str, Any]:
    """Return slowness (4.4), derivatives per metre (4.5)-(4.12), and accelerations of the mass centre."""
    sin_xi, cos_xi = xp.sin(x["xi"]), xp.cos(x["xi"])
    a_x, a_y = forces.F_x / p["mass"], forces.F_y / p["mass"]
    slowness = (1 - x["n"] * curvature) / (x["u"] * cos_xi - x["v"] * sin_xi)
    return {
        "slowness": slowness,
        "dn_ds": slowness * (x["u"] * sin_xi + x["v"] * cos_xi),
        "dxi_ds": slowness * x["omega"] - curvature,
        "dv_ds": slowness * (a_y - x["omega"] * x["u"]),
        "du_ds": slowness * (a_x + x["omega"] * x["v"]),
        "domega_ds": slowness * forces.M_z / p["I_z"],
        "a_x": a_x,
        "a_y": a_y,
    }
