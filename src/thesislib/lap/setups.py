"""What a lap is computed for, in names and numbers, so that other processes and later runs can rebuild it.

A road, a car and a problem hold functions and splines. A `Setup` holds what they are made from: it can be
sent to a worker process and is part of the key under which a solution is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from thesislib import ocp, roads
from thesislib.lap.adjustments import MAP_RANGES, MapRanges
from thesislib.lap.edges import Edges
from thesislib.lap.minimum_time import SETTINGS, Lap, minimum_lap_time
from thesislib.lap.problem import FRONT_HEIGHT_LIMIT_M, HALF_WIDTH_M, Units, lap_problem, units_of
from thesislib.ocp.storage import load, save
from thesislib.studies import stored
from thesislib.suspension.metamodel import Metamodel, RearConstant
from thesislib.suspension.stiffness import StiffnessMetamodel
from thesislib.vehicles import RacingCar, Readings

Suspension = Literal["table_3_1", "table_3_2", "reconciled"]


@dataclass(frozen=True)
class Setup:
    """A road, a car, and how their open places are read.

    Attributes
    ----------
    track : str
        Name of the road in ``data/tracks``, or path of a road file.
    values : mapping of str to float
        Numbers of the car that differ from its files, in SI: ``{"mass": 700.0}``.
    readings : Readings
        Choices about the car that the thesis leaves open.
    rear_constant : {"printed", "text"}
        Reading of the rear ride height's constant, see `Metamodel.from_file`.
    offset_rms_m : float
        Distance in m, root mean square, of the centre line from the road file's; positive for a smoother
        line, see `roads.smoothed`.
    front_slip_limit : float
        Bound on the size of the front wheels' longitudinal slip.
    half_width_m : float
        Bound on the distance of the mass centre from the centre line.
    front_height_limit_m : float
        Bound on the front ride height.
    metamodel : {"table_3_1", "table_3_2", "reconciled"}
        Ride heights and roll angles of Table 3.1; of Table 3.2, which has the heave stiffness; or of the
        latter with its constants moved to those of Table 3.1.
    free : mapping of str to (float, float)
        Adjustments that the optimiser chooses, and their bounds in SI; see `adjustments`.
    ranges : MapRanges
        Of the water-bed constraint (4.30).
    continuous_balance : float
        Bound on the aerodynamic balance as a control, row (Q); zero for none.
    edges : {"centre", "wheels"}
        Whether the mass centre stays within 4 m of the centre line, or all wheels on the road.
    wheel_margin_m : float
        Room between a wheel's contact centre and the edge of the road, if `edges` is "wheels".

    Raises
    ------
    ValueError
        If there is no such metamodel or no such edges.
    """

    track: str = "barcelona"
    values: Mapping[str, float] = field(default_factory=dict)
    readings: Readings = field(default_factory=Readings)
    rear_constant: RearConstant = "printed"
    offset_rms_m: float = 0.0
    front_slip_limit: float = 0.3
    half_width_m: float = HALF_WIDTH_M
    front_height_limit_m: float = FRONT_HEIGHT_LIMIT_M
    metamodel: Suspension = "table_3_1"
    free: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    ranges: MapRanges = MAP_RANGES
    continuous_balance: float = 0.0
    edges: Edges = "centre"
    wheel_margin_m: float = 0.0

    def __post_init__(self) -> None:
        if self.metamodel not in get_args(Suspension):
            raise ValueError(
                f"metamodel = {self.metamodel!r} is not one of {', '.join(get_args(Suspension))}."
            )
        if self.edges not in get_args(Edges):
            raise ValueError(f"edges = {self.edges!r} is not one of {', '.join(get_args(Edges))}.")

    def road(self) -> roads.CentreLine:
        """Return the road; raises as `roads.load` and `roads.smoothed` do."""
        return roads.smoothed(roads.load(self.track), self.offset_rms_m)

    def car(self) -> RacingCar:
        """Return the car with its suspension; raises as `RacingCar.from_file` does."""
        base = Metamodel.from_file(rear_constant=self.rear_constant)
        ride: Metamodel | StiffnessMetamodel = base
        if self.metamodel != "table_3_1":
            raw = StiffnessMetamodel.from_file()
            ride = raw.reconciled(base) if self.metamodel == "reconciled" else raw
        return RacingCar.from_file(ride=ride, readings=self.readings).replace(**self.values)

    @property
    def options(self) -> dict[str, Any]:
        """What `lap_problem` takes of the set-up besides road and car."""
        return {
            "front_slip_limit": self.front_slip_limit,
            "free": self.free,
            "ranges": self.ranges,
            "continuous_balance": self.continuous_balance,
            "half_width_m": self.half_width_m,
            "front_height_limit_m": self.front_height_limit_m,
            "edges": self.edges,
            "wheel_margin_m": self.wheel_margin_m,
        }

    def problem(self, name: str, *, units: Units | None = None) -> ocp.Problem:
        """Return the minimum lap time problem of this set-up.

        Parameters
        ----------
        name : str
            Name of the problem.
        units : Units, optional
            Scaling; by default that of the car. Laps that are compared share one, so that the same
            regulariser is added to both.
        """
        return lap_problem(self.road(), self.car(), name=name, units=units, **self.options)

    def units(self) -> Units:
        """Return the fundamental units of section 4.3.1 for the car."""
        return units_of(self.car())


@dataclass(frozen=True)
class Start:
    """A lap solved cold, kept on disk, from which other laps start.

    Attributes
    ----------
    setup : Setup
        What it is solved for.
    tolerance : float
        Largest relative state error (2.162).
    interval_m : float
        Length in m of its first mesh's intervals.
    path : str
        Where the solution is kept; ends in ``.npz``. No result depends on it, and so no key of one.
    optimality : float, optional
        IPOPT's tolerance to which `tighten` has solved it again.
    """

    setup: Setup
    tolerance: float
    interval_m: float
    path: str = field(compare=False)
    optimality: float | None = None

    def solve(self, name: str) -> bool:
        """Solve the lap, or in a run from stored solutions find it, and keep it at `path`.

        Parameters
        ----------
        name : str
            Stands in messages and in the name of the stored solution.

        Returns
        -------
        bool
            Whether the solution was read rather than computed.

        Raises
        ------
        ocp.SolveError
            As `minimum_lap_time`.
        """

        def solved() -> Lap:
            return minimum_lap_time(
                self.setup.road(),
                self.setup.car(),
                tolerance=self.tolerance,
                interval_m=self.interval_m,
                name=name,
                **self.setup.options,
            )

        inputs = {"setup": self.setup, "tolerance": self.tolerance, "m": self.interval_m}
        return _kept(name, inputs, self.path, solved)

    def tighten(self, path: str, name: str, *, optimality: float = 1e-10) -> tuple[Start, bool]:
        """Solve the lap again from itself, on its own mesh, until the barrier has left nothing behind.

        A lap's last barrier parameter makes it a few hundredths of a millisecond too long. That does not
        matter for the lap, but for what a bound is worth: the plank limit's price is then 1.5 % off.

        Parameters
        ----------
        path : str
            Where the solution is kept; ends in ``.npz``.
        name : str
            Stands in messages and in the name of the stored solution.
        optimality : float
            IPOPT's tolerance on the scaled programme.

        Returns
        -------
        Start
            The lap at `path`.
        bool
            Whether the solution was read rather than computed.

        Raises
        ------
        ocp.SolveError
            If the solver did not finish.
        """

        def solved() -> Lap:
            base = self.lap()
            return minimum_lap_time(
                base.track,
                base.car,
                tolerance=min(100.0 * self.tolerance, 0.1),  # so that nothing is refined
                guess=base,
                name=name,
                settings=replace(SETTINGS, optimality=optimality, draft=None, barrier=10.0 * optimality),
                **self.setup.options,
            )

        inputs = {"start": self, "optimality": optimality}
        return replace(self, path=path, optimality=optimality), _kept(name, inputs, path, solved)

    def lap(self, name: str = "base lap") -> Lap:
        """Read the lap that `solve` has kept.

        Raises
        ------
        FileNotFoundError
            If it is not there: it was never solved, or this machine does not share its folder.
        ocp.ProblemError
            As `thesislib.ocp.storage.load`.
        """
        if not Path(self.path).is_file():
            raise FileNotFoundError(
                f"{name} is to be read from {self.path}, and there is no such file on this machine. "
                "`Start.solve` writes it; workers on other machines need its folder on a shared file system."
            )
        solution = load(self.setup.problem(name), self.path)
        return Lap(name, self.setup.road(), self.setup.car(), solution, self.setup.ranges)


def _kept(name: str, inputs: Mapping[str, Any], path: str, solve: Callable[[], Lap]) -> bool:
    """Solve a lap, or in a run from stored solutions find it, and keep it at `path`; return whether found."""
    place = Path(path)

    def file() -> Mapping[str, np.ndarray]:
        save(solve().solution, place)
        return {"file": np.frombuffer(place.read_bytes(), dtype=np.uint8)}

    result = stored(name, inputs, file)
    if result.stored:
        place.write_bytes(np.asarray(result["file"]).tobytes())
    return result.stored


@dataclass(frozen=True)
class Solved:
    """How a problem was solved, as a worker process has told it.

    Attributes
    ----------
    entries : mapping
        What `ocp.Solution.summary` returned there.
    """

    entries: Mapping[str, Any]

    @classmethod
    def of(cls, result: Mapping[str, Any]) -> Solved:
        """Take the entries out of a case's result, where `told` has put them."""
        return cls({name[len(_SOLVE) :]: value for name, value in result.items() if name.startswith(_SOLVE)})

    def summary(self) -> Mapping[str, Any]:
        """Return the entries."""
        return self.entries


_SOLVE = "solve "


def told(solution: ocp.Solution) -> dict[str, Any]:
    """Return a solution's summary under the names that keep it apart from a case's other results."""
    return {_SOLVE + name: value for name, value in solution.summary().items()}
