"""The racing car in mid-corner with all but its lateral motion frozen.

Forward speed u, steer, longitudinal slips and wheel loads are held at the values of a lap. What is left is a
motion in lateral speed and yaw rate, as that of the single-track car, in which each axle is the sum of two
unequal tyres under combined slip. It adds to its side force Y a yaw moment M, of its longitudinal forces left
and right, and both are functions of the one slip coordinate xi of the axle as long as the forward speed of
each wheel is that of the trim:

    dv/dt = (Y_f + Y_r - Y_0)/M_car - u omega,    I_z domega/dt = a Y_f - b Y_r + M_f + M_r - M_0.

Along a lap the trim is no equilibrium. The constants Y_0 and M_0, the inertia forces of that moment, make it
one. `RacingTrim.whole_car_rates` is the same with nothing left out, by the model of chapter 4.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from flint import arb, arb_series
from numpy.typing import NDArray

from thesislib import provenance
from thesislib.vehicles import RacingCar, Readings
from thesislib.vehicles.elementary import elementary
from thesislib.vehicles.racing_car import CONTROLS, WHEELS
from thesislib.vehicles.tyres import tyre_forces

Array = NDArray[np.float64]

_COMPLEX_STEP = 1e-30


@dataclass(frozen=True)
class FrozenWheel:
    """A wheel as the trim holds it.

    Attributes
    ----------
    load : float
        N, positive.
    kappa : float
        Longitudinal slip.
    stretch : float
        u over the wheel's own forward speed before it is steered: 1 on the centre line.
    y : float
        Distance to the right of the centre line, m.
    """

    load: float
    kappa: float
    stretch: float
    y: float


@dataclass(frozen=True)
class FrozenAxle:
    """Two wheels and what they add to the lateral motion, over the axle's slip coordinate.

    Attributes
    ----------
    lever : float
        Distance of the axle before the mass centre, m: a or -b.
    steer : float
        rad; 0 at the rear.
    wheels : tuple of two FrozenWheel
    parameters : mapping
        Table B.1.
    """

    lever: float
    steer: float
    wheels: tuple[FrozenWheel, FrozenWheel]
    parameters: Mapping[str, float] = field(repr=False)

    def force_and_moment(self, xi: Any) -> tuple[Any, Any]:
        """Return Y in N and M in N m at slip coordinates: numbers, arrays, or power series of arb balls."""
        cosine, sine = float(np.cos(self.steer)), float(np.sin(self.steer))
        Y, M = 0.0, 0.0
        for wheel in self.wheels:
            sideways = xi * wheel.stretch
            alpha = elementary(xi).arctan(sideways) - self.steer
            tyre = tyre_forces(wheel.load, wheel.kappa, alpha, self.parameters)
            Y = Y + tyre.F_y * cosine + tyre.F_x * sine
            M = M + (tyre.F_y * sine - tyre.F_x * cosine) * wheel.y
        return Y, M

    def slopes(self, xi: Any) -> tuple[Any, Any]:
        """Return dY/dxi and dM/dxi at slip coordinates, by a complex step."""
        force, moment = self.force_and_moment(np.asarray(xi) + _COMPLEX_STEP * 1j)
        return force.imag / _COMPLEX_STEP, moment.imag / _COMPLEX_STEP

    def enclosed(self, xi: arb) -> tuple[tuple[arb, arb], tuple[arb, arb]]:
        """Return balls that hold (Y, M) and (dY/dxi, dM/dxi) for all slip coordinates in a ball."""
        both = self.force_and_moment(arb_series([xi, 1], prec=2))
        (Y, dY), (M, dM) = ((series[0], series[1]) for series in both)
        return (Y, M), (dY, dM)


@dataclass(frozen=True)
class RacingTrim:
    """A car frozen at a place of a lap.

    Attributes
    ----------
    lap : str
        Name of the lap.
    corner : int
        Number of the corner.
    s : float
        Place, m.
    motion : mapping
        ``u`` and ``v`` in m/s, ``omega`` in rad/s.
    control : mapping
        (4.26): ``delta`` in rad, ``kappa_fl`` …, ``F_flz`` … <= 0 in N.
    car : RacingCar
        Mass, lengths and tyres; no suspension is asked for, as the loads are held.

    Raises
    ------
    ValueError
        If the car does not move forwards or a wheel has no load.
    """

    lap: str
    corner: int
    s: float
    motion: Mapping[str, float]
    control: Mapping[str, float]
    car: RacingCar = field(repr=False)

    def __post_init__(self) -> None:
        if not self.motion["u"] > 0:
            raise ValueError(f"{self}: u = {self.motion['u']:g} m/s is not positive.")
        for wheel in WHEELS:
            if not self.control[f"F_{wheel}z"] < 0:
                load = self.control[f"F_{wheel}z"]
                raise ValueError(f"{self}: F_{wheel}z = {load:g} N is not negative, the wheel has no load.")

    def __str__(self) -> str:
        return f"Corner {self.corner} of {self.lap}"

    @property
    def mass(self) -> float:
        """M, kg."""
        return self.car.values["mass"]

    @property
    def I_z(self) -> float:
        """Yaw moment of inertia, kg m²."""
        return self.car.values["I_z"]

    @property
    def a(self) -> float:
        """Mass centre behind the front axle, m."""
        return self.car.values["a"]

    @property
    def b(self) -> float:
        """Mass centre before the rear axle, m."""
        return round(self.car.values["wheelbase"] - self.a, 12)

    @property
    def gyration(self) -> float:
        """Radius of gyration k = sqrt(I_z/M), m."""
        return float(np.sqrt(self.I_z / self.mass))

    @property
    def u_0(self) -> float:
        """Forward speed, m/s."""
        return self.motion["u"]

    @property
    def delta(self) -> float:
        """Steering angle, rad."""
        return self.control["delta"]

    @cached_property
    def matrix(self) -> Array:
        """(xi_f, xi_r) = matrix @ (v, omega)."""
        return np.array([[1.0, self.a], [1.0, -self.b]]) / self.u_0

    @cached_property
    def axles(self) -> tuple[FrozenAxle, FrozenAxle]:
        """The front and the rear axle."""
        p = self.car.values

        def axle(end: str, lever: float, steer: float) -> FrozenAxle:
            wheels = []
            for name, side in ((f"{end}l", -1.0), (f"{end}r", 1.0)):
                y = side * p[f"w_{end}"]
                stretch = self.u_0 / (self.u_0 - self.motion["omega"] * y)
                load = -self.control[f"F_{name}z"]
                wheels.append(FrozenWheel(load, self.control[f"kappa_{name}"], stretch, y))
            return FrozenAxle(lever, steer, (wheels[0], wheels[1]), p)

        return axle("f", self.a, self.delta), axle("r", -self.b, 0.0)

    def trim(self) -> Array:
        """Return the state (v, omega) that is held in equilibrium."""
        return np.array([self.motion["v"], self.motion["omega"]])

    def to_slip(self, x: Any) -> Any:
        """Return (xi_f, xi_r) of states (..., 2)."""
        return np.asarray(x) @ self.matrix.T

    def from_slip(self, xi: Any) -> Any:
        """Return states (v, omega) of slip coordinates (..., 2)."""
        return np.asarray(xi) @ np.linalg.inv(self.matrix).T

    @cached_property
    def inertia(self) -> Array:
        """Lateral force and yaw moment (N, N m) of the accelerations dv/dt and domega/dt at the trim."""
        free = self._free_rates(self.trim())
        return np.array([self.mass * free[0], self.I_z * free[1]])

    def rates(self, x: Any) -> Any:
        """Return d(v, omega)/dt of states (..., 2)."""
        return self._free_rates(x) - self.inertia / np.array([self.mass, self.I_z])

    def _free_rates(self, x: Any) -> Any:
        x = np.asarray(x, dtype=float)
        xi = self.to_slip(x)
        (Y_f, M_f), (Y_r, M_r) = (axle.force_and_moment(xi[..., k]) for k, axle in enumerate(self.axles))
        v_dot = (Y_f + Y_r) / self.mass - self.u_0 * x[..., 1]
        return np.stack([v_dot, (self.a * Y_f - self.b * Y_r + M_f + M_r) / self.I_z], axis=-1)

    def jacobian(self, x: Any) -> Array:
        """Return the derivative of `rates` at a state (2,), shape (2, 2)."""
        xi = self.to_slip(x)
        columns = []
        for k, axle in enumerate(self.axles):
            dY, dM = axle.slopes(xi[k])
            columns.append([dY / self.mass, (axle.lever * dY + dM) / self.I_z])
        by_slip = np.array(columns, dtype=float).T
        return np.asarray(by_slip @ self.matrix - np.array([[0.0, self.u_0], [0.0, 0.0]]))

    @property
    def growth(self) -> float:
        """Largest real part of the eigenvalues at the trim, 1/s; not negative where no margin exists."""
        return float(np.linalg.eigvals(self.jacobian(self.trim())).real.max())

    def whole_car_rates(self, x: Any, *, held: bool = True) -> Any:
        """Return d(v, omega)/dt of states (..., 2) by `RacingCar.quantities`, at constant u.

        Each wheel's forward speed follows the yaw rate here.

        Parameters
        ----------
        x : array, shape (..., 2)
        held : bool
            Whether the trim is made an equilibrium.
        """
        x = np.asarray(x, dtype=float)
        state = {"n": 0.0, "xi": 0.0, "u": self.u_0, "v": x[..., 0], "omega": x[..., 1]}
        q = self.car.quantities(state, self.control, 0.0)
        rates = np.stack([q["dv_ds"], q["domega_ds"]], axis=-1) / np.asarray(q["slowness"])[..., None]
        return rates - self.whole_car_rates(self.trim(), held=False) if held else rates


def read_trims(name: str = "mid_corner_trims") -> tuple[RacingTrim, ...]:
    """Return the trims of ``data/stability/<name>.csv``, with the car of chapter 4.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    KeyError, ValueError
        If a column is missing or a value is no number or outside what a trim allows.
    """
    path = provenance.project_root() / "data" / "stability" / f"{name}.csv"
    car = RacingCar.from_file(readings=Readings(suspension="rigid"))
    with path.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))

    def number(row: Mapping[str, str], quantity: str, unit: str) -> float:
        return float(row[f"{quantity}_{unit}" if unit else quantity])

    trims = []
    for row in rows:
        motion = {quantity: number(row, quantity, unit) for quantity, unit in MOTION_UNITS.items()}
        control = {quantity: number(row, quantity, control_unit(quantity)) for quantity in CONTROLS}
        trims.append(RacingTrim(row["lap"], int(row["corner"]), float(row["s_m"]), motion, control, car))
    return tuple(trims)


MOTION_UNITS = {"u": "mps", "v": "mps", "omega": "radps"}
"""Units of the motion in the file of trims."""


def control_unit(name: str) -> str:
    """Return the unit of a control in the file of trims, empty for slips."""
    return "rad" if name == "delta" else "N" if name.startswith("F_") else ""
