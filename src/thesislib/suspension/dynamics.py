"""The axle as a vibrating system, replayed under the loads of a lap (section 8.1, first item).

The metamodel takes the suspension to be in equilibrium at every moment. Here each axle carries its share of
the body on springs, dampers and tyres, in four minimal coordinates: distance of the axle's centre from the
road, roll angle, and the travels of both wheels. The linkage is eliminated as in
:mod:`thesislib.suspension.reduced`, so that the equations are ordinary and need no constraint forces; with
the 26 equations they would be differential-algebraic of index three.

The axles are taken one by one. Front and rear heave decouple exactly if the body's radius of gyration in
pitch is the geometric mean of the distances of its mass centre from the axles, and nearly so in such cars.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from thesislib.suspension.axle import GRAVITY, MIRROR, Axle
from thesislib.suspension.kinematics import Curves
from thesislib.suspension.loads import WheelLoads
from thesislib.suspension.mechanism import ConvergenceError, turned
from thesislib.suspension.reduced import Equilibrium, ReducedAxle
from thesislib.suspension.tyre import force_at_radius

Array = NDArray[np.float64]

# m, rad, their rates, and per unit of them: a hundredth of the smallest difference that is reported
_TOLERANCE, _RELATIVE = 1e-8, 1e-7


@dataclass(frozen=True)
class RideHistory:
    """Motion of an axle under a load history, and the equilibria that the same loads would have.

    Attributes
    ----------
    t : numpy.ndarray, shape (N,)
        Time, s.
    height, roll : numpy.ndarray, shape (N,)
        Ride height in m and roll angle in rad of the moving axle.
    travel : numpy.ndarray, shape (N, 2)
        Wheel travels, m.
    tyre_forces : numpy.ndarray, shape (N, 2)
        Vertical forces that the tyres then have, N.
    equilibrium : Equilibrium
        The axle at rest under the loads of each time.
    """

    t: Array
    height: Array
    roll: Array
    travel: Array
    tyre_forces: Array
    equilibrium: Equilibrium

    @property
    def height_difference(self) -> Array:
        """Ride height in motion minus at rest, m."""
        return self.height - self.equilibrium.height

    @property
    def roll_difference(self) -> Array:
        """Roll angle in motion minus at rest, rad."""
        return self.roll - self.equilibrium.roll


class DynamicAxle:
    """Equations of motion of one axle with its share of the body.

    Parameters
    ----------
    axle : Axle
    body_mass : float
        The body's share, kg.
    roll_inertia : float
        The body's share about the roll axis, kg m^2.

    Raises
    ------
    ValueError
        If mass or inertia is not above zero.
    """

    def __init__(self, axle: Axle, body_mass: float, roll_inertia: float) -> None:
        for name, value in (("body_mass", body_mass), ("roll_inertia", roll_inertia)):
            if not value > 0.0:
                raise ValueError(f"{name} = {value:g} of the {axle.name} must be above zero.")
        self.axle = axle
        self.body_mass = body_mass
        self.roll_inertia = roll_inertia
        self.reduced = ReducedAxle(axle)

    @cached_property
    def rates(self) -> ca.Function:
        """``(state (8), force on the body (N), moment on the body (N m)) -> (rates (8), tyre forces (2))``.

        State: road below the axle's origin (m), roll (rad), both travels (m), and their rates.
        """
        axle, wheel = self.axle, self.reduced.wheel
        x, force, moment = ca.SX.sym("x", 8), ca.SX.sym("P"), ca.SX.sym("N")
        road, roll, q, v = x[0], x[1], x[2:4], x[4:8]
        alpha = [_horner(wheel.rocker, q[i])[0] for i in range(2)]
        slope = -ca.tan(roll)
        mass = ca.diag(ca.SX([self.body_mass, self.roll_inertia, 0, 0]))
        weight = axle.carrier_mass * GRAVITY
        generalised = ca.vertcat(-force, moment, -self._elastic_slope(alpha, q))
        tyres = []
        for i, side in enumerate((1.0, -1.0)):
            centre, down = _horner(wheel.centre, q[i]), _horner(wheel.down, q[i])
            y, z, y_down, z_down = side * centre[1], centre[2], side * down[1], down[2]
            R = (road + slope * y - z) / (z_down - slope * y_down)
            F = force_at_radius(R, xp=ca)
            travel = ca.DM([float(i == 0), float(i == 1)])
            at_wheel = ca.vertcat(-1, y, -travel)  # vertical velocity of the wheel centre per rate
            mass += axle.carrier_mass * at_wheel @ at_wheel.T
            lever = R * ca.jacobian(z_down, q[i]) - 1
            generalised += weight * at_wheel + F * ca.vertcat(-1, y + R * y_down, lever * travel)
            # the wheel centre moves sideways while the body rolls
            generalised -= axle.carrier_mass * at_wheel * ca.jacobian(y, q[i]) * v[2 + i] * v[1]
            tyres.append(F)
        generalised -= ca.vertcat(0, 0, self._damping(alpha, q, v[2:4]))
        accelerations = ca.solve(mass, generalised)
        return ca.Function("rates", [x, force, moment], [ca.vertcat(v, accelerations), ca.vertcat(*tyres)])

    def _spring_length(self, alpha: list[ca.SX]) -> ca.SX:
        axle = self.axle
        ends = [axle.pivot + turned(axle.rocker_axis, angle, axle.spring_end - axle.pivot) for angle in alpha]
        return ca.SX(ca.norm_2(ends[0] - ca.DM(MIRROR) * ends[1]))

    def _elastic_slope(self, alpha: list[ca.SX], q: ca.SX) -> ca.SX:
        """Return the derivative of the springs' energy with respect to both travels."""
        axle = self.axle
        stretch = self._spring_length(alpha) - axle.heave_free_length
        energy = 0.5 * axle.anti_roll_stiffness * (alpha[0] - alpha[1]) ** 2
        energy += axle.heave_stiffness * (stretch**2 / 2 - axle.heave_hardening * stretch**3 / 3)
        for angle in alpha:
            energy += 0.5 * axle.torsion_stiffness * angle**2 + axle.torsion_preload * angle
        return ca.gradient(energy, q)

    def _damping(self, alpha: list[ca.SX], q: ca.SX, v: ca.SX) -> ca.SX:
        per_travel = ca.jacobian(self._spring_length(alpha), q)
        turning = ca.jacobian(ca.vertcat(*alpha), q)
        heave = self.axle.heave_damping * per_travel.T @ (per_travel @ v)
        return heave + self.axle.rocker_damping * turning.T @ (turning @ v)

    def wrench(self, equilibrium: Equilibrium, loads: WheelLoads) -> tuple[Array, Array]:
        """Return force (N, down) and moment (N m) on the body that hold it over the given tyre forces."""
        F = np.column_stack((loads.left[:, 2], loads.right[:, 2]))
        contact = np.column_stack((equilibrium.contact_left[:, 1], equilibrium.contact_right[:, 1]))
        weight = self.axle.carrier_mass * GRAVITY
        y = np.stack([self.reduced.wheel.centre(one)[1] for one in equilibrium.travel.T], axis=1)
        return -F.sum(axis=1) - 2.0 * weight, -(contact * F).sum(axis=1) - weight * (y[:, 0] - y[:, 1])

    def state(self, equilibrium: Equilibrium) -> Array:
        """Return the states at rest in the given equilibria, shape (N, 8)."""
        slope = -np.tan(equilibrium.roll)
        road = equilibrium.contact_left[:, 2] - slope * equilibrium.contact_left[:, 1]
        rest = np.zeros((len(road), 4))
        return np.column_stack((road, equilibrium.roll, equilibrium.travel, rest))

    def modes(self, load: float) -> NDArray[np.complex128]:
        """Return the eigenvalues in 1/s about equal vertical tyre forces `load` (N), by frequency."""
        loads = WheelLoads.of([load], [load])
        rest = self.reduced.solve(loads)
        x, P, N = ca.SX.sym("x", 8), *(float(one[0]) for one in self.wrench(rest, loads))
        jacobian = ca.Function("J", [x], [ca.jacobian(self.rates(x, P, N)[0], x)])
        eigenvalues = np.linalg.eigvals(np.asarray(jacobian(self.state(rest)[0])))
        upper = eigenvalues[eigenvalues.imag >= 0.0]
        ordered: NDArray[np.complex128] = upper[np.argsort(np.abs(upper))]
        return ordered

    def _integrated(self, t: Array, force: Array, moment: Array, start: Array) -> Array:
        """Return the states, shape (8, N), at times `t` under a wrench linear between them, by CVODES."""
        x, at, u = ca.SX.sym("x", 8), ca.SX.sym("t"), ca.SX.sym("u", 5)
        since = at - u[0]
        rates = self.rates(x, u[1] + u[2] * since, u[3] + u[4] * since)[0]
        step = np.diff(t)
        pieces = np.stack((t[:-1], force[:-1], np.diff(force) / step, moment[:-1], np.diff(moment) / step))
        options = {"abstol": _TOLERANCE, "reltol": _RELATIVE, "max_num_steps": 100_000}
        solver = ca.integrator(
            "ride", "cvodes", {"x": x, "t": at, "u": u, "ode": rates}, float(t[0]), t[1:].tolist(), options
        )
        try:
            found = np.asarray(solver(x0=start, u=pieces)["xf"])
        except RuntimeError as error:
            reason = str(error).strip().splitlines()[-1]
            raise ConvergenceError(f"{self.axle.name}: the replay was not integrated: {reason}") from error
        return np.column_stack((start, found))

    def replay(self, t: ArrayLike, F_l: ArrayLike, F_r: ArrayLike) -> RideHistory:
        """Move the axle by the load history of a lap, from the equilibrium at its beginning.

        The body is pushed by the force and moment that would hold it in equilibrium over the given tyre
        forces, linear between the given times. What inertia and damping add is the difference between the
        axle's motion and its equilibria.

        Parameters
        ----------
        t : array_like, shape (N,)
            Time, s, increasing.
        F_l, F_r : array_like, shape (N,)
            Vertical tyre forces, N (SAE).

        Raises
        ------
        ValueError
            If times do not increase or the lengths differ.
        ConvergenceError
            If the loads have no equilibrium, or the integration fails.
        """
        times = np.asarray(t, dtype=float)
        loads = WheelLoads.of(F_l, F_r)
        if times.ndim != 1 or len(times) != len(loads) or len(times) < 2 or not np.all(np.diff(times) > 0.0):
            raise ValueError(
                f"A load history needs increasing times and one load for each, not {len(times)} times and "
                f"{len(loads)} loads."
            )
        rest = self.reduced.solve(loads)
        P, N = self.wrench(rest, loads)
        found = self._integrated(times, P, N, self.state(rest)[0])
        road, roll, *travel = found[:4]
        tyres = np.asarray(self.rates(found, P[None, :], N[None, :])[1]).T
        height = (self.axle.reference_plane - road) * np.cos(roll)
        return RideHistory(times, height, roll, np.stack(travel, axis=1), tyres, rest)


def sprung_share(axle: Axle, static_load: float) -> float:
    """Return the body mass in kg that rests on an axle whose tyres carry `static_load` (N) each."""
    return -2.0 * static_load / GRAVITY - 2.0 * axle.carrier_mass


def _horner(curves: Curves, q: ca.SX) -> ca.SX:
    """Return polynomials of the travel as one expression."""
    low, high = curves.travel
    x = (2 * q - (low + high)) / (high - low)
    value = ca.SX(ca.DM(curves.coefficients[-1]))
    for row in curves.coefficients[-2::-1]:
        value = value * x + ca.DM(row)
    return value
