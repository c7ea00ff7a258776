"""The minimum lap time problem of section 4.3: scaling, bounds, constraints, regularisation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from thesislib import ocp
from thesislib.lap.adjustments import CONTINUOUS_BALANCE, MAP_RANGES, MapRanges, adjusted, parameters
from thesislib.lap.edges import Edges, beyond_edge, edge_data, refuse_narrow, widest
from thesislib.roads import CentreLine
from thesislib.vehicles.racing_car import CONTROLS, STATES, WHEELS, RacingCar

FRONT_HEIGHT_LIMIT_M = 0.015
"""Largest front ride height, SAE (towards the road), of every case of section 4.4."""

HALF_WIDTH_M = 4.0
"""The mass centre stays within this distance of the centre line (section 4.4)."""

# Steering and slips are about a tenth where they matter; in units of one they would be the
# smallest numbers of the programme. The same holds for a ride height in car lengths, whose
# distance to its limit would be lost in the barrier term, and for roll angles.
ANGLE_SCALE = 0.1
HEIGHT_SCALE_M = 0.01
ROLL_SCALE_RAD = 0.05


@dataclass(frozen=True)
class RateWeights:
    """Weights of the control-rate regularisation (2.171), dimensionless.

    Attributes
    ----------
    steer, slip : float
        Of the steering angle and of the four longitudinal slips, in units of 0.1, per car
        length.
    balance : float
        Of the continuous aerodynamic balance.
    """

    steer: float = 1e-3
    slip: float = 1e-4
    balance: float = 1e-4


# Without regularisation the slips zig-zag between collocation points and the solver does not
# converge; ten times less of it changes the lap time by 4 ms.
RATE_WEIGHTS = RateWeights()


@dataclass(frozen=True)
class Units:
    """Fundamental units of the scaling of section 4.3.1: the car's length, its mass, gravity.

    Attributes
    ----------
    length : float
        Wheelbase, m.
    mass : float
        Mass of the car, kg.
    gravity : float
        m/s².
    """

    length: float
    mass: float
    gravity: float

    @property
    def time(self) -> float:
        """√(l0/g), s (printed upside down in the thesis)."""
        return float(np.sqrt(self.length / self.gravity))

    @property
    def speed(self) -> float:
        """√(g l0), m/s."""
        return self.length / self.time

    @property
    def force(self) -> float:
        """M g, N."""
        return self.mass * self.gravity

    @property
    def moment(self) -> float:
        """M g l0, N m."""
        return self.force * self.length

    @property
    def power(self) -> float:
        """M g √(g l0), W."""
        return self.force * self.speed


def lap_problem(
    track: CentreLine,
    car: RacingCar,
    *,
    name: str = "minimum lap time",
    half_width_m: float = HALF_WIDTH_M,
    front_height_limit_m: float = FRONT_HEIGHT_LIMIT_M,
    front_slip_limit: float = 0.3,
    weights: RateWeights = RATE_WEIGHTS,
    units: Units | None = None,
    free: Mapping[str, tuple[float, float]] | None = None,
    ranges: MapRanges = MAP_RANGES,
    continuous_balance: float = 0.0,
    edges: Edges = "centre",
    wheel_margin_m: float = 0.0,
) -> ocp.Problem:
    """State the minimum lap time problem.

    Parameters
    ----------
    track : CentreLine
        The road; its curvature enters as data.
    car : RacingCar
        The car; all its numbers enter as constants, with respect to which the optimum can be
        differentiated.
    name : str
        Name of the problem.
    half_width_m : float
        Bound on |n|, if `edges` is "centre".
    front_height_limit_m : float
        Bound on the front ride height.
    front_slip_limit : float
        Bound on the size of the front wheels' longitudinal slip.
    weights : RateWeights
        Weights of the control-rate regulariser.
    units : Units, optional
        Scaling; by default that of the car. Laps that are compared share one.
    free : mapping of str to (float, float), optional
        Adjustments that the optimiser chooses, with their bounds; see `adjustments.parameters`. A problem
        that has any has all as parameters, those that are not free held at zero.
    ranges : MapRanges
        Of the water-bed constraint (4.30).
    continuous_balance : float
        Bound on |u_CoP|, the balance as a control; zero for a problem without it.
    edges : {"centre", "wheels"}
        What stays on the road: the mass centre within `half_width_m`, or the contact centres of all four
        wheels within the road's own half-widths, which then enter as data.
    wheel_margin_m : float
        Room between a contact centre and the edge, if `edges` is "wheels"; half a tyre's width keeps the
        whole tyre on the road. It is a constant of the problem: its derivative is the price of width.

    Returns
    -------
    ocp.Problem

    Raises
    ------
    KeyError, ValueError
        As `adjustments.parameters`; ValueError also if `continuous_balance` is negative, or if the road is
        somewhere too narrow for the wheels.
    """
    if continuous_balance < 0.0:
        raise ValueError(f"continuous_balance = {continuous_balance:g}, a bound on |u_CoP|, is negative.")
    units = units or units_of(car)
    wheels = edges == "wheels"
    if wheels:
        refuse_narrow(track, car.values, wheel_margin_m)
    residual_units = {
        "vertical_balance": ("N", units.force),
        "roll_balance": ("N m", units.moment),
        "pitch_balance": ("N m", units.moment),
        "roll_difference": ("rad", ROLL_SCALE_RAD),
        "brake_difference": ("N", units.force),
        "differential_balance": ("N m", units.moment),
    }
    path = [
        ocp.Path(equation, residual_units[equation][0], (0.0, 0.0), residual_units[equation][1])
        for equation in car.equations
    ]
    path.append(ocp.Path("power", "W", (-np.inf, 0.0), units.power))
    limited_brakes = car.readings.fixed_brake_ratio is not None
    if limited_brakes:
        path.append(ocp.Path("brake_ratio", "N", (-np.inf, 0.0), units.force))
    adjustable = parameters(free, car.values) if free else []
    offsets = [adjustment.name for adjustment in adjustable]
    offsets += [CONTINUOUS_BALANCE] if continuous_balance else []
    limited_height = car.readings.suspension == "metamodel"
    if limited_height:
        path.append(ocp.Path("ride_height", "m", (-np.inf, front_height_limit_m), HEIGHT_SCALE_M))
    if wheels:
        path += [ocp.Path(f"edge_{wheel}", "m", (-np.inf, 0.0), units.length) for wheel in WHEELS]

    def equations(at: ocp.Point) -> ocp.Equations:
        values = {constant: at[constant] for constant in car.values}
        values = adjusted(values, {name: at[name] for name in offsets}, ranges)
        q = car.quantities(
            {state: at[state] for state in STATES},
            {control: at[control] for control in CONTROLS},
            at.curvature,
            values=values,
        )
        expressions = {equation: q[equation] for equation in car.equations}
        expressions["power"] = q["power"] - values["P_max"]
        if limited_brakes:
            expressions["brake_ratio"] = q["brake_ratio"]
        if limited_height:
            expressions["ride_height"] = q["h_f"]
        if wheels:
            beyond = beyond_edge(at.n, at.xi, at.curvature, values, at)
            expressions |= {name: value + at.wheel_margin for name, value in beyond.items()}
        return ocp.Equations(
            derivatives={state: q[f"d{state}_ds"] for state in STATES},
            path=expressions,
            integrands={"slowness": q["slowness"]},
        )

    return ocp.Problem(
        name=name,
        independent=ocp.Independent("s", 0.0, track.length, unit="m", scale=units.length),
        states=_states(units, widest(track) if wheels else half_width_m),
        controls=[
            *_controls(units, car, front_slip_limit, weights),
            *_balance(continuous_balance, weights),
        ],
        parameters=adjustable,
        equations=equations,
        lagrange="slowness",
        path=path,
        periodic=STATES,
        constants={**car.values, "wheel_margin": wheel_margin_m} if wheels else car.values,
        data={"curvature": track.curvature, **(edge_data(track, car.values) if wheels else {})},
        objective_scale=units.time,
    )


def units_of(car: RacingCar) -> Units:
    """Return the fundamental units of section 4.3.1 for a car."""
    values = car.values
    return Units(values["wheelbase"], values["mass"], values["gravity"])


def _states(units: Units, half_width: float) -> list[ocp.State]:
    return [
        ocp.State("n", "m", (-half_width, half_width), units.length),
        ocp.State("xi", "rad", (-1.0, 1.0), 1.0),
        ocp.State("v", "m/s", (-30.0, 30.0), units.speed),
        ocp.State("u", "m/s", (5.0, 120.0), units.speed),
        ocp.State("omega", "rad/s", (-4.0, 4.0), 1 / units.time),
    ]


def _controls(units: Units, car: RacingCar, front_slip: float, weights: RateWeights) -> list[ocp.Control]:
    # F_flx = F_frx makes the right front slip follow the left one: bounding both at zero would
    # make three dependent active constraints and leave the multipliers undetermined.
    right_front = (-front_slip, 0.0 if car.readings.brake == "free" else front_slip)
    slips = {
        "kappa_fl": (-front_slip, 0.0),
        "kappa_fr": right_front,
        "kappa_rl": (-0.3, 0.3),
        "kappa_rr": (-0.3, 0.3),
    }
    steer = ocp.Control("delta", "rad", (-0.35, 0.35), ANGLE_SCALE, rate_weight=weights.steer)
    return [
        steer,
        *(
            ocp.Control(slip, "-", bounds, ANGLE_SCALE, rate_weight=weights.slip)
            for slip, bounds in slips.items()
        ),
        *(ocp.Control(load, "N", (-3 * units.force, 0.0), units.force) for load in CONTROLS[5:]),
    ]


def _balance(bound: float, weights: RateWeights) -> list[ocp.Control]:
    if not bound:
        return []
    return [ocp.Control(CONTINUOUS_BALANCE, "-", (-bound, bound), 1.0, rate_weight=weights.balance)]
