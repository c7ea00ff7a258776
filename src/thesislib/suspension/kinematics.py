"""The linkage of one wheel as functions of the wheel's travel: what five links and the rocker leave free.

The five links of the wishbones and the track rod leave the carrier one freedom. Pose, rocker angle and
contact point become polynomials of the travel q, made once for a geometry and a steer angle, and the twelve
rod forces of the 26 equations are never needed. Right-hand wheels use the left one's in mirrored axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from thesislib.suspension.axle import LINKS, Axle, GeometryError
from thesislib.suspension.mechanism import rotation, wheel_down

Array = NDArray[np.float64]

_DEGREE = 20
_NODES = 41
_TOLERANCE = 1e-13  # m: rounding of lengths near one metre
_ITERATIONS = 30


@dataclass(frozen=True)
class Curves:
    """Vector-valued polynomials of the travel, in powers of q scaled to -1 .. 1.

    Attributes
    ----------
    coefficients : numpy.ndarray, shape (degree + 1, functions)
    travel : tuple of float
        The travels that -1 and 1 stand for, m.
    """

    coefficients: Array
    travel: tuple[float, float]

    @classmethod
    def through(cls, q: Array, values: Array, travel: tuple[float, float]) -> Curves:
        """Fit polynomials to `values` of shape (len(q), functions) at Chebyshev nodes `q`."""
        scaled = (2.0 * q - sum(travel)) / (travel[1] - travel[0])
        fitted = chebyshev.chebfit(scaled, values, _DEGREE)
        powers = [np.polynomial.chebyshev.cheb2poly(column) for column in fitted.T]
        padded = [np.pad(one, (0, _DEGREE + 1 - len(one))) for one in powers]
        return cls(np.column_stack(padded), travel)

    def derivative(self) -> Curves:
        """Return the derivatives with respect to q."""
        order = np.arange(1, len(self.coefficients))[:, None]
        scale = 2.0 / (self.travel[1] - self.travel[0])
        return Curves(scale * order * self.coefficients[1:], self.travel)

    def __getitem__(self, columns: slice) -> Curves:
        return Curves(self.coefficients[:, columns], self.travel)

    def __call__(self, q: Array) -> Array:
        """Return the values at `q`, shape (functions, *q.shape)."""
        x = (2.0 * np.asarray(q) - sum(self.travel)) / (self.travel[1] - self.travel[0])
        value = np.multiply.outer(self.coefficients[-1], np.ones_like(x))
        for row in self.coefficients[-2::-1]:
            value *= x
            value += row.reshape(row.shape + (1,) * x.ndim)
        return value


@dataclass(frozen=True)
class Kinematics:
    """Motion of the left wheel over its travel q (m, bump positive).

    Attributes
    ----------
    pose : Curves
        Displacement D (m), Euler angles phi, theta, psi (rad) of (3.3), (3.4): six functions.
    centre : Curves
        Wheel centre O_W in the chassis, m: three functions.
    down : Curves
        Unit vector from wheel centre to contact point, (3.17): three functions.
    spin : Curves
        Rotation of the carrier per travel, rad/m: three functions.
    rocker : Curves
        Rocker angle alpha, rad: one function.
    fit_error : float
        Largest difference of the polynomials and the linkage between the nodes, m and rad.
    """

    pose: Curves
    centre: Curves
    down: Curves
    spin: Curves
    rocker: Curves
    fit_error: float

    @property
    def travel(self) -> tuple[float, float]:
        """Least and largest travel, m."""
        return self.pose.travel


def kinematics(axle: Axle, steer: float = 0.0, travel: tuple[float, float] | None = None) -> Kinematics:
    """Return the motion of the left wheel over its travel.

    Parameters
    ----------
    axle : Axle
    steer : float
        Angle of the steering pinion, rad; for a right-hand wheel in mirrored axes, its negative.
    travel : tuple of float, optional
        Least and largest travel, m; the axle's own if not given.

    Raises
    ------
    GeometryError
        If the links cannot be assembled at a travel, or the rocker cannot follow the push rod.
    """
    low, high = travel or axle.travel
    nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    q = np.sort(0.5 * (low + high) + 0.5 * (high - low) * nodes)
    values = _linkage(axle, steer, q)
    curves = Curves.through(q, values, (low, high))
    between = 0.5 * (q[1:] + q[:-1])
    error = float(np.abs(curves(between).T - _linkage(axle, steer, between)).max())
    return Kinematics(
        pose=curves[0:6],
        centre=curves[6:9],
        down=curves[9:12],
        spin=curves[12:15],
        rocker=curves[15:16],
        fit_error=error,
    )


def _linkage(axle: Axle, steer: float, q: Array) -> Array:
    """Return pose (6), centre (3), down (3), spin (3) and rocker angle (1) at every travel."""
    pose = _poses(axle, steer, q)
    slopes, down, push_rod, spin = (
        np.asarray(one) for one in _pose_functions()(pose.T, *_given(axle, steer, q))
    )
    del slopes
    centre = axle.wheel_centre + pose[:, :3]
    alpha = _rocker_angles(axle, push_rod.T, q)
    return np.column_stack((pose, centre, down.T, spin.T, alpha))


def _given(axle: Axle, steer: float, q: Array) -> tuple[Array, ...]:
    inner = axle.chassis.copy()
    inner[4, 1] -= axle.pinion_radius * steer  # (3.2)
    arms = axle.carrier - axle.wheel_centre
    fixed = np.concatenate((inner.ravel(), arms.ravel(), axle.wheel_centre, axle.link_lengths[:5]))
    return np.tile(fixed[:, None], (1, len(q))), q[None, :]


@cache
def _pose_functions() -> ca.Function:
    """Residual of the five links and of the travel, downward vector, Q_6, and spin, for any geometry."""
    pose, fixed, q = ca.SX.sym("pose", 6), ca.SX.sym("fixed", 41), ca.SX.sym("q")
    inner, arms = ca.reshape(fixed[:15], 3, 5), ca.reshape(fixed[15:33], 3, 6)
    centre, lengths = fixed[33:36] + pose[:3], fixed[36:41]
    R = rotation(pose[3:])
    rows = [
        (ca.sumsqr(centre + R @ arms[:, i] - inner[:, i]) - lengths[i] ** 2) / (2 * lengths[i])
        for i in range(5)
    ]
    residual = ca.vertcat(*rows, pose[2] + q)
    # along the free motion d(pose)/dq = -(d residual / d pose)^-1 (0, ..., 0, 1)
    slope = -ca.solve(ca.jacobian(residual, pose), ca.DM([0, 0, 0, 0, 0, 1]))
    turning = ca.reshape(ca.jtimes(ca.vec(R), pose, slope), 3, 3) @ R.T
    spin = ca.vertcat(turning[2, 1], turning[0, 2], turning[1, 0])
    down = wheel_down(R @ ca.DM([0, 1, 0]))
    return ca.Function("pose", [pose, fixed, q], [residual, down, centre + R @ arms[:, 5], spin])


@cache
def _pose_jacobian() -> ca.Function:
    return _pose_functions().factory("jacobian", ["i0", "i1", "i2"], ["o0", "jac:o0:i0"])


def _poses(axle: Axle, steer: float, q: Array) -> Array:
    pose = np.zeros((len(q), 6))
    pose[:, 2] = -q
    given = _given(axle, steer, q)
    for _ in range(_ITERATIONS):
        residual, jacobian = (np.asarray(one) for one in _pose_jacobian()(pose.T, *given))
        worst = np.abs(residual).max(axis=0)
        if np.all(worst < _TOLERANCE):
            return pose
        blocks = jacobian.reshape(6, len(q), 6).transpose(1, 0, 2)
        pose = pose - np.linalg.solve(blocks, residual.T[:, :, None])[:, :, 0]
        if not np.all(np.isfinite(pose)):
            break
    at = int(np.argmax(np.nan_to_num(worst, nan=np.inf)))
    link = int(np.argmax(np.abs(np.nan_to_num(residual[:5, at], nan=np.inf))))
    raise GeometryError(
        f"{axle.name}: at a wheel travel of {1e3 * q[at]:.1f} mm the links do not meet, first the "
        f"{LINKS[link]}; this geometry cannot reach it."
    )


def _rocker_angles(axle: Axle, outer: Array, q: Array) -> Array:
    """Return the rocker angle that puts P_6 one rod's length from Q_6 (`outer`, shape (N, 3)).

    |P_6 - Q_6| = l_6 reads A cos(alpha) + B sin(alpha) = C, whose two roots are the rocker before and
    behind its dead centre; the one that is zero at rest is taken.
    """
    n, arm = axle.rocker_axis, axle.rod_end - axle.pivot
    along = (arm @ n) * n
    across = arm - along

    def terms(to_carrier: Array) -> tuple[Array, Array, Array]:
        A, B = to_carrier @ across, to_carrier @ np.cross(n, across)
        C = 0.5 * (arm @ arm + np.sum(to_carrier**2, axis=1) - axle.link_lengths[5] ** 2) - to_carrier @ along
        return A, B, C

    A, B, C = terms(outer - axle.pivot)
    reach = np.hypot(A, B)
    if not np.all(np.abs(C) < reach):
        at = int(np.argmax(np.abs(C) / reach))
        raise GeometryError(
            f"{axle.name}: at a wheel travel of {1e3 * q[at]:.1f} mm the rocker cannot follow the push rod; "
            "it has reached its dead centre."
        )
    A_0, B_0, C_0 = (float(one[0]) for one in terms((axle.carrier[5] - axle.pivot)[None, :]))
    branch = -np.sign(np.arctan2(B_0, A_0)) if abs(C_0) < np.hypot(A_0, B_0) else 1.0
    alpha = np.arctan2(B, A) + branch * np.arccos(C / reach)
    folded: Array = (alpha + np.pi) % (2 * np.pi) - np.pi
    return folded
