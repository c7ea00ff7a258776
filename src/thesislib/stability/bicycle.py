"""The single-track car of section 7.2: lateral motion at constant speed, its equilibria, linear theory.

State x = (v, omega): lateral speed in m/s and yaw rate in rad/s, SAE axes. Both tyre slips are functions of
one combination each of the two,

    xi_f = (v + a omega)/u_0,    xi_r = (v - b omega)/u_0,

which makes (xi_f, xi_r), the *slip coordinates*, the natural ones: each tyre's curve bends along one axis.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from thesislib.stability.tyres import MagicFormula, RationalTyre, Tyre, rational_fit
from thesislib.vehicles.parameters import ParameterSet

Slip = Literal["linear", "arctan"]
GRAVITY = 9.81

_REACH = 1.2  # rad: equilibria are looked for at slips up to this


@dataclass(frozen=True)
class Bicycle:
    """A single-track car with one cornering curve for each axle.

    Attributes
    ----------
    mass, I_z : float
        kg and kg m².
    a, b : float
        Mass centre behind the front and before the rear axle, m.
    u_0 : float
        Forward speed, m/s.
    delta : float
        Steering angle, rad.
    front, rear : Tyre
        Axle forces.
    slip : {"linear", "arctan"}
        Slip angles (7.10), (7.11), or (7.9), (7.8).

    Raises
    ------
    ValueError
        If a number is not positive, or the steering angle exceeds 0.5 rad.
    """

    mass: float
    I_z: float
    a: float
    b: float
    u_0: float
    front: Tyre
    rear: Tyre
    delta: float = 0.0
    slip: Slip = "linear"
    matrix: NDArray[np.float64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("mass", "I_z", "a", "b", "u_0"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} = {getattr(self, name):g} of the single-track car is not positive.")
        if not abs(self.delta) <= 0.5:
            raise ValueError(f"delta = {self.delta:g} rad is outside -0.5 .. 0.5 (steering angle).")
        if self.slip not in ("linear", "arctan"):
            raise ValueError(f"slip = {self.slip!r} is not one of linear, arctan.")
        object.__setattr__(self, "matrix", np.array([[1.0, self.a], [1.0, -self.b]]) / self.u_0)

    @classmethod
    def from_file(
        cls, name: str = "bicycle", *, tyres: Literal["magic", "rational"] = "rational", **values: float
    ) -> Bicycle:
        """Return the car of ``data/vehicles/<name>.toml`` on dry road, with other `values` where given.

        Raises
        ------
        KeyError, TypeError, ValueError
            If a value has an unknown name, is no number or outside its range.
        """
        numbers: dict[str, Any] = ParameterSet.from_file(name).replace(**values).values
        front, rear = MagicFormula.from_file("front"), MagicFormula.from_file("rear")
        car = cls(**numbers, front=front, rear=rear)
        return car if tyres == "magic" else car.fitted()

    def fitted(self) -> Bicycle:
        """Return this car with the rational fits (7.13) of its tyres and slip angles (7.10), (7.11)."""
        return replace(self, front=rational_fit(self.front), rear=rational_fit(self.rear), slip="linear")

    @property
    def wheelbase(self) -> float:
        """l = a + b, m."""
        return self.a + self.b

    @property
    def odd(self) -> bool:
        """Whether the motion to the right mirrors that to the left."""
        tyres = (self.front, self.rear)
        return self.delta == 0.0 and all(
            isinstance(t, MagicFormula) or getattr(t, "odd", False) for t in tyres
        )

    def to_slip(self, x: Any) -> Any:
        """Return (xi_f, xi_r) of states (..., 2)."""
        return np.asarray(x) @ self.matrix.T

    def from_slip(self, xi: Any) -> Any:
        """Return states (v, omega) of slip coordinates (..., 2)."""
        return np.asarray(xi) @ np.linalg.inv(self.matrix).T

    def slip_angles(self, xi: Any) -> Any:
        """Return (alpha_f, alpha_r) of slip coordinates (..., 2)."""
        xi = np.asarray(xi, dtype=float)
        angles = xi if self.slip == "linear" else np.arctan(xi)
        return angles - np.array([self.delta, 0.0])

    def rates(self, x: Any) -> Any:
        """Return d(v, omega)/dt of states (..., 2): (7.4) and (7.5)."""
        x = np.asarray(x, dtype=float)
        alpha = self.slip_angles(self.to_slip(x))
        F_f, F_r = self.front.force(alpha[..., 0]), self.rear.force(alpha[..., 1])
        v_dot = (F_f + F_r) / self.mass - self.u_0 * x[..., 1]
        return np.stack([v_dot, (self.a * F_f - self.b * F_r) / self.I_z], axis=-1)

    def jacobian(self, x: Any) -> NDArray[np.float64]:
        """Return the derivative of `rates` at states (..., 2), shape (..., 2, 2); at rest (7.34)."""
        xi = self.to_slip(x)
        alpha = self.slip_angles(xi)
        stretch = np.ones_like(xi) if self.slip == "linear" else 1 / (1 + xi**2)
        C_f = self.front.slope(alpha[..., 0]) * stretch[..., 0]
        C_r = self.rear.slope(alpha[..., 1]) * stretch[..., 1]
        by_slip = np.stack(
            [
                np.stack([C_f / self.mass, C_r / self.mass], axis=-1),
                np.stack([self.a * C_f / self.I_z, -self.b * C_r / self.I_z], axis=-1),
            ],
            axis=-2,
        )
        return np.asarray(by_slip @ self.matrix - np.array([[0.0, self.u_0], [0.0, 0.0]]))

    def equilibria(self) -> NDArray[np.float64]:
        """Return all equilibria with slips up to 1.2 rad, shape (n, 2), in the order of v.

        Newton's method from a grid of starts; what it finds more than once counts once.
        """
        axis = np.linspace(-_REACH, _REACH, 33)
        xi = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        x = self.from_slip(xi)
        with np.errstate(all="ignore"):
            for _ in range(60):
                jacobian, rates = self.jacobian(x), self.rates(x)
                good = np.abs(np.linalg.det(jacobian)) > 1e-9
                x, jacobian, rates = x[good], jacobian[good], rates[good]
                step = np.linalg.solve(jacobian, rates[..., None])[..., 0]
                largest = np.abs(self.to_slip(step)).max(axis=-1, keepdims=True)
                x = x - step * np.minimum(1.0, 0.1 / np.maximum(largest, 1e-300))
                x = x[(np.abs(self.to_slip(x)) <= 2.0).all(axis=-1)]
        x = x[np.abs(self.rates(x)).max(axis=-1) < 1e-9]
        x = x[(np.abs(self.to_slip(x)) <= _REACH).all(axis=-1)]
        found: list[NDArray[np.float64]] = []
        for one in x[np.argsort(x[:, 0])]:
            if not any(np.abs(one - other).max() < 1e-6 for other in found):
                found.append(one)
        return np.array(found).reshape(-1, 2)

    def trim(self) -> NDArray[np.float64]:
        """Return the stable equilibrium nearest to straight running, shape (2,).

        Raises
        ------
        ValueError
            If there is none: the car cannot hold this steering angle at this speed.
        """
        stable = [x for x in self.equilibria() if np.linalg.eigvals(self.jacobian(x)).real.max() < 0]
        if not stable:
            raise ValueError(
                f"The car has no stable equilibrium at u_0 = {self.u_0:g} m/s and delta = "
                f"{np.degrees(self.delta):g}°: no region of attraction to look for."
            )
        return min(stable, key=lambda x: float(np.linalg.norm(self.to_slip(x))))


@dataclass(frozen=True)
class LinearTheory:
    """What the linearised car says about stability at straight running.

    Attributes
    ----------
    determinant : float
        C_f C_r l² + M u_0² (a C_f - b C_r), N² m²/rad²: (7.36) with the sign that follows from (7.34), where
        both stiffnesses are negative. Positive means stable.
    determinant_printed : float
        The form printed in the thesis, with minus.
    understeer : float
        K_us = M (a C_f - b C_r) / (l C_f C_r), rad s²/m: steering angle beyond l/R per lateral acceleration.
    damping : float
        Largest real part of the eigenvalues, 1/s.
    C_front, C_rear : float
        Cornering stiffnesses (7.35), N/rad.
    """

    determinant: float
    determinant_printed: float
    understeer: float
    damping: float
    C_front: float
    C_rear: float

    @property
    def understeer_deg_per_g(self) -> float:
        """K_us in degrees per g."""
        return float(np.degrees(self.understeer) * GRAVITY)


def linear_theory(car: Bicycle) -> LinearTheory:
    """Return (7.34) to (7.36) of a car that runs straight."""
    C_f, C_r = float(car.front.slope(0.0)), float(car.rear.slope(0.0))
    moment = car.a * C_f - car.b * C_r
    stiff = C_f * C_r * car.wheelbase**2
    kinetic = car.mass * car.u_0**2 * moment
    return LinearTheory(
        determinant=stiff + kinetic,
        determinant_printed=stiff - kinetic,
        understeer=car.mass * moment / (car.wheelbase * C_f * C_r),
        damping=float(np.linalg.eigvals(replace(car, delta=0.0).jacobian(np.zeros(2))).real.max()),
        C_front=C_f,
        C_rear=C_r,
    )


def comparison_car(tyre: RationalTyre) -> Bicycle:
    """Return the car of the literature comparison with this tyre on both axles."""
    numbers: dict[str, Any] = ParameterSet.from_file("comparison_car").values
    return Bicycle(**numbers, front=tyre, rear=tyre)
