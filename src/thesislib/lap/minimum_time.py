"""The minimum lap time problem of section 4.3, and the lap that solves it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thesislib import ocp
from thesislib.lap.start import quasi_steady_start
from thesislib.roads import CentreLine
from thesislib.vehicles.racing_car import CONTROLS, STATES, RacingCar

Array = NDArray[np.float64]

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
    """

    steer: float = 1e-3
    slip: float = 1e-4


# Without regularisation the slips zig-zag between collocation points and the solver does not
# converge; ten times less of it changes the lap time by 4 ms.
RATE_WEIGHTS = RateWeights()

# A cold solve starts with slips that hardly move: beyond its peak a tyre's force is flat, the
# slip nearly arbitrary and the programme far from convex. The first mesh is solved so, and its
# solution starts the problem proper (a continuation, as the thesis proposes for (2.170)).
STARTING_WEIGHTS = RateWeights(1e-2, 1e-2)
STARTING_ERROR = 0.9

# Draft meshes keep the barrier parameter near 1e-6, which lets the next mesh start in about ten
# iterations; the lap time they show is 4 ms too long, until the last mesh is solved to the end.
SETTINGS = ocp.Settings(optimality=1e-7, draft=1e-5, barrier=1e-6, aim=0.2)


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


@dataclass(frozen=True, eq=False)
class Lap:
    """A lap of minimum time.

    `lap["h_f"]` gives any state, control or quantity of the car at the collocation points,
    in SI units; see `RacingCar.quantities`.

    Attributes
    ----------
    name : str
        What was solved.
    track : CentreLine
        The road.
    car : RacingCar
        The car.
    solution : ocp.Solution
        The solution of the optimal control problem.
    """

    name: str
    track: CentreLine
    car: RacingCar
    solution: ocp.Solution

    @property
    def time(self) -> float:
        """Lap time (4.27), s, without the regulariser."""
        return self.solution.objective

    @property
    def period(self) -> float:
        """Length of the lap, m."""
        return self.track.length

    @cached_property
    def s(self) -> Array:
        """Collocation points, m, shape (N,)."""
        return self.solution.points

    @property
    def mesh_points(self) -> Array:
        """Mesh points, m, shape (K + 1,)."""
        return self.solution.mesh_points

    @cached_property
    def t(self) -> Array:
        """Elapsed time at the collocation points, s, shape (N,).

        The slowness is integrated by the Radau rule of every interval, so that the elapsed
        time ends at the lap time.
        """
        mesh = self.solution.mesh
        gained = np.zeros(mesh.points + 1)
        scale = mesh.half_widths * self.solution.span
        for order, intervals in mesh.by_order():
            index = mesh.first[intervals][:, None] + np.arange(order)
            matrix = ocp.quadrature.radau_integration(order)
            gained[index + 1] = (self["slowness"][index] @ matrix.T) * scale[index[:, :1]]
        start = np.concatenate(([0.0], np.cumsum(gained[mesh.first + mesh.orders])[:-1]))
        inside = gained[:-1].copy()
        inside[mesh.first] = 0.0
        return np.asarray(start[mesh.interval] + inside)

    @cached_property
    def _channels(self) -> dict[str, Array]:
        x = {name: self.solution[name] for name in STATES}
        u = {name: self.solution[name] for name in CONTROLS}
        quantities = self.car.quantities(x, u, self.track.curvature(self.s))
        return {**x, **u, **quantities}

    def __getitem__(self, name: str) -> Array:
        if name not in self._channels:
            raise KeyError(f"the lap has no channel {name!r}; known: {', '.join(self._channels)}")
        return np.broadcast_to(self._channels[name], self.s.shape)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names that `lap[...]` knows."""
        return tuple(self._channels)

    def activity(self, name: str) -> NDArray[np.bool_]:
        """Return where a constraint is active, judged by its multiplier.

        Parameters
        ----------
        name : {"power", "ride_height", "left_edge", "right_edge", "kappa_front", "kappa_rear"}
            The constraint: engine power, the plank limit of the front ride height, the edges
            of the road, the slip limits of either axle.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        if name in ("power", "ride_height"):
            return _acting(self.solution.path_multiplier(name))
        if name in ("left_edge", "right_edge"):
            price = self.solution.bound_multiplier("n")
            return _acting(price) & ((price > 0) if name == "right_edge" else (price < 0))
        if name in ("kappa_front", "kappa_rear"):
            side = name[len("kappa_")]
            prices = [self.solution.bound_multiplier(f"kappa_{side}{wheel}") for wheel in "lr"]
            return _acting(prices[0]) | _acting(prices[1])
        raise KeyError(
            f"no constraint is named {name!r}; known: power, ride_height, left_edge, right_edge, "
            "kappa_front, kappa_rear"
        )


def minimum_lap_time(
    track: CentreLine,
    car: RacingCar,
    *,
    tolerance: float = 1e-5,
    guess: Lap | None = None,
    interval_m: float = 16.0,
    name: str = "minimum lap time",
    settings: ocp.Settings | None = None,
    mesh: ocp.Mesh | None = None,
    **options: Any,
) -> Lap:
    """Solve the periodic minimum lap time problem (4.25)–(4.29).

    Parameters
    ----------
    track : CentreLine
        The road.
    car : RacingCar
        The car with its ride-height model and its readings.
    tolerance : float
        Largest relative state error (2.162) in the scaled variables of section 4.3.1.
    guess : Lap, optional
        A lap to start from, its multipliers included; otherwise a quasi-steady lap on the
        centre line.
    interval_m : float
        Length of the first mesh's intervals without a guess, m; each has four points.
    name : str
        Stands in messages and records.
    settings : ocp.Settings, optional
        Solver settings but for the tolerance; by default `SETTINGS`.
    mesh : ocp.Mesh, optional
        First mesh, instead of the guess's or of the uniform one.
    **options
        Passed to `lap_problem`.

    Returns
    -------
    Lap

    Raises
    ------
    ocp.SolveError
        If the solver did not finish or the error estimate stays above tolerance.
    """
    settings = settings or SETTINGS
    problem = lap_problem(track, car, name=name, **options)
    if guess is not None:
        solution = ocp.solve(problem, guess.solution, mesh, settings, tolerance=tolerance)
        return Lap(name, track, car, solution)
    first = lap_problem(track, car, name=f"{name}, start", **{**options, "weights": STARTING_WEIGHTS})
    mesh = mesh or ocp.Mesh.uniform(max(1, round(track.length / interval_m)), 4)
    start = ocp.solve(first, quasi_steady_start(track, car), mesh, settings, tolerance=STARTING_ERROR)
    finer = ocp.refined(start.mesh, start.estimate.by_interval, tolerance, aim=settings.aim)
    solution = ocp.solve(problem, start, finer, settings, tolerance=tolerance)
    return Lap(name, track, car, replace(solution, history=(*start.history, *solution.history)))


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
        Bound on |n|.
    front_height_limit_m : float
        Bound on the front ride height.
    front_slip_limit : float
        Bound on the size of the front wheels' longitudinal slip.
    weights : RateWeights
        Weights of the control-rate regulariser.
    units : Units, optional
        Scaling; by default that of the car. Laps that are compared share one.

    Returns
    -------
    ocp.Problem
    """
    units = units or units_of(car)
    residual_units = {
        "vertical_balance": ("N", units.force),
        "roll_balance": ("N m", units.moment),
        "pitch_balance": ("N m", units.moment),
        "roll_difference": ("rad", ROLL_SCALE_RAD),
        "brake_difference": ("N", units.force),
        "brake_ratio": ("N", units.force),
        "differential_balance": ("N m", units.moment),
    }
    path = [
        ocp.Path(equation, residual_units[equation][0], (0.0, 0.0), residual_units[equation][1])
        for equation in car.equations
    ]
    path.append(ocp.Path("power", "W", (-np.inf, 0.0), units.power))
    limited_height = car.readings.suspension == "metamodel"
    if limited_height:
        path.append(ocp.Path("ride_height", "m", (-np.inf, front_height_limit_m), HEIGHT_SCALE_M))

    def equations(at: ocp.Point) -> ocp.Equations:
        values = {constant: at[constant] for constant in car.values}
        q = car.quantities(
            {state: at[state] for state in STATES},
            {control: at[control] for control in CONTROLS},
            at.curvature,
            values=values,
        )
        expressions = {equation: q[equation] for equation in car.equations}
        expressions["power"] = q["power"] - values["P_max"]
        if limited_height:
            expressions["ride_height"] = q["h_f"]
        return ocp.Equations(
            derivatives={state: q[f"d{state}_ds"] for state in STATES},
            path=expressions,
            integrands={"slowness": q["slowness"]},
        )

    return ocp.Problem(
        name=name,
        independent=ocp.Independent("s", 0.0, track.length, unit="m", scale=units.length),
        states=_states(units, half_width_m),
        controls=_controls(units, car, front_slip_limit, weights),
        equations=equations,
        lagrange="slowness",
        path=path,
        periodic=STATES,
        constants=car.values,
        data={"curvature": track.curvature},
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


def _acting(price: Array) -> NDArray[np.bool_]:
    """Return where a multiplier density is not just the barrier's remainder."""
    return np.asarray(np.abs(price) > 1e-3 * max(float(np.abs(price).max()), 1e-300))
