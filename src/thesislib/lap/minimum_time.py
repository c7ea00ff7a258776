"""The lap of minimum time: how it is solved, and what it tells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thesislib import ocp
from thesislib.lap.adjustments import MAP_RANGES, MapRanges, adjusted
from thesislib.lap.edges import used_width
from thesislib.lap.problem import RateWeights, lap_problem
from thesislib.lap.start import quasi_steady_start
from thesislib.roads import CentreLine
from thesislib.vehicles.racing_car import CONTROLS, STATES, RacingCar

Array = NDArray[np.float64]

# A cold solve starts with slips that hardly move: beyond its peak a tyre's force is flat, the
# slip nearly arbitrary and the programme far from convex. The first mesh is solved so, and its
# solution starts the problem proper (a continuation, as the thesis proposes for (2.170)).
STARTING_WEIGHTS = RateWeights(1e-2, 1e-2)
STARTING_ERROR = 0.9

# The car is unstable along much of the lap when nobody steers (its side slip grows tenfold within
# 20 m of turn 3). In long intervals an error far below tolerance would grow to centimetres before
# a re-integration of ten of them ends.
LONGEST_INTERVAL_M = 8.5

ACTIVE_WITHIN = 2e-3
"""A constraint counts as active within this part of its bound."""

# Draft meshes keep the barrier parameter near 1e-7, which lets the next mesh start in about ten
# iterations; the lap time they show is half a millisecond too long, until the last mesh is solved to
# the end.
SETTINGS = ocp.Settings(optimality=1e-7, draft=1e-6, barrier=1e-6, aim=0.2, reduction=0.0)


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
    ranges : MapRanges
        Of the water-bed constraint (4.30), where the set-up was adjusted.
    """

    name: str
    track: CentreLine
    car: RacingCar
    solution: ocp.Solution
    ranges: MapRanges = MAP_RANGES

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
        """Elapsed time at the collocation points, s, shape (N,); it ends at the lap time."""
        return self.accumulated(self["slowness"])

    def accumulated(self, density: Array) -> Array:
        """Return the integral of a density from the start line to every collocation point, shape (N,).

        It is integrated by the Radau rule of every interval, whose last value is the sum of the lap's
        quadrature.
        """
        mesh = self.solution.mesh
        gained = np.zeros(mesh.points + 1)
        scale = mesh.half_widths * self.solution.span
        for order, intervals in mesh.by_order():
            index = mesh.first[intervals][:, None] + np.arange(order)
            matrix = ocp.quadrature.radau_integration(order)
            gained[index + 1] = (density[index] @ matrix.T) * scale[index[:, :1]]
        start = np.concatenate(([0.0], np.cumsum(gained[mesh.first + mesh.orders])[:-1]))
        inside = gained[:-1].copy()
        inside[mesh.first] = 0.0
        return np.asarray(start[mesh.interval] + inside)

    @property
    def adjustments(self) -> dict[str, float]:
        """What the optimiser has chosen of the set-up, by the adjustment's name, SI; what is held is zero."""
        problem = self.solution.problem
        return {each.name: self.solution.parameter(each.name) for each in problem.parameters}

    @cached_property
    def values(self) -> dict[str, Any]:
        """Numbers of the car as adjusted: floats, or arrays (N,) where they change along the lap."""
        return self.adjusted(self.car.values)

    def adjusted(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return numbers of a car with this lap's adjustments; see `values`."""
        added = [q.name for q in self.solution.problem.controls if q.name not in CONTROLS]
        along = {name: self.solution[name] for name in added}
        return adjusted(values, {**self.adjustments, **along}, self.ranges)

    @cached_property
    def _channels(self) -> dict[str, Array]:
        x = {name: self.solution[name] for name in STATES}
        u = {name: self.solution[name] for name in CONTROLS}
        quantities = self.car.quantities(x, u, self.track.curvature(self.s), values=self.values)
        added = {q.name: self.solution[q.name] for q in self.solution.problem.controls if q.name not in u}
        return {**x, **u, **added, **quantities}

    def __getitem__(self, name: str) -> Array:
        if name not in self._channels:
            raise KeyError(f"the lap has no channel {name!r}; known: {', '.join(self._channels)}")
        return np.broadcast_to(self._channels[name], self.s.shape)

    @cached_property
    def _used_width(self) -> dict[str, Array]:
        problem = self.solution.problem
        if "wheel_margin" in problem.constants:
            margin = problem.constants["wheel_margin"]
            return used_width(self.track, self.s, self["n"], self["xi"], self.car.values, margin)
        edge = next(state.bounds[1] for state in problem.states if state.name == "n")
        return {"left": -self["n"] / edge, "right": self["n"] / edge}

    @property
    def channels(self) -> tuple[str, ...]:
        """Names that `lap[...]` knows."""
        return tuple(self._channels)

    def activity(self, name: str) -> NDArray[np.bool_]:
        """Return where a constraint is active: closer to its bound than `ACTIVE_WITHIN` of its size.

        Parameters
        ----------
        name : {"power", "ride_height", "left_edge", "right_edge", "kappa_front", "kappa_rear"}
            The constraint: engine power, the plank limit of the front ride height, the edges
            of the road (for the mass centre or for the outer wheel, as the problem has it), the slip
            limits of either axle (in front, that of braking).

        Returns
        -------
        ndarray of bool, shape (N,)

        Raises
        ------
        KeyError
            If there is no such constraint; the message lists them.
        """
        bounds = {q.name: q.bounds for q in (*self.solution.problem.states, *self.solution.problem.controls)}
        limits = {path.name: path.bounds[1] for path in self.solution.problem.path}
        front, rear = abs(bounds["kappa_fl"][0]), bounds["kappa_rl"][1]
        used = {
            "power": lambda: self["power"] / self.car.values["P_max"],
            "ride_height": lambda: self["h_f"] / limits.get("ride_height", np.inf),
            "left_edge": lambda: self._used_width["left"],
            "right_edge": lambda: self._used_width["right"],
            "kappa_front": lambda: -np.minimum(self["kappa_fl"], self["kappa_fr"]) / front,
            "kappa_rear": lambda: np.maximum(np.abs(self["kappa_rl"]), np.abs(self["kappa_rr"])) / rear,
        }
        if name not in used:
            raise KeyError(f"no constraint is named {name!r}; known: {', '.join(used)}")
        return np.asarray(used[name]() > 1 - ACTIVE_WITHIN)


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
    ranges = options.get("ranges", MAP_RANGES)
    if guess is not None:
        solution = ocp.solve(problem, guess.solution, mesh, settings, tolerance=tolerance)
        return Lap(name, track, car, solution, ranges)
    # nothing of the first two solutions is left in the lap: drafts of them are enough
    drafted = replace(settings, optimality=settings.draft or settings.optimality, tolerance=STARTING_ERROR)
    first = lap_problem(track, car, name=f"{name}, start", **{**options, "weights": STARTING_WEIGHTS})
    mesh = mesh or ocp.Mesh.uniform(max(1, round(track.length / interval_m)), 4)
    start = ocp.solve(first, quasi_steady_start(track, car), mesh, drafted)
    settled = ocp.solve(problem, start, _finer(start, tolerance, settings), drafted)
    finer = _finer(settled, tolerance, settings).divided(LONGEST_INTERVAL_M / track.length)
    solution = ocp.solve(problem, settled, finer, settings, tolerance=tolerance)
    history = (*start.history, *settled.history, *solution.history)
    return Lap(name, track, car, replace(solution, history=history), ranges)


def _finer(solution: ocp.Solution, tolerance: float, settings: ocp.Settings) -> ocp.Mesh:
    return ocp.refined(solution.mesh, solution.estimate.by_interval, tolerance, aim=settings.aim)
