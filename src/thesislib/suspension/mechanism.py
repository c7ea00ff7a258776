"""The suspension as 26 equations in 26 unknowns, (3.1), (3.8), (3.9), (3.12), (3.13), (3.19) and (3.20).

Per side: six coordinates of the wheel carrier, the rocker angle and six rod forces. Unknowns are counted
in mm, hundredths of a radian and kN, equations in mm, kN and 0.1 kN m, which brings the condition number
of the Jacobian from several millions to about fifty.

Readings. Direction d_i points from carrier to chassis, so that a rod force is positive in tension; the
rocker feels the push rod with the opposite sign of the carrier (Newton's third law), which (3.8) and
(3.12) as printed cannot both mean with one d_6. Moments in (3.19) are taken as d_1i x d_i, the order that
its tyre term has. The right rocker's axis is the mirror image of the left one's as a vector of points, so
that rockers turn in opposite senses in heave and alike in roll, as K_arb (alpha_L + alpha_R) needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from thesislib.polynomials import design_matrix
from thesislib.suspension.axle import GRAVITY, LINKS, MIRROR, Axle
from thesislib.suspension.loads import Stance, WheelLoads, stance
from thesislib.suspension.tyre import loaded_radius

Array = NDArray[np.float64]

UNKNOWNS = 26
_SCALES = np.tile(np.r_[np.full(3, 1e-3), np.full(4, 1e-2), np.full(6, 1e3)], 2)
_RESIDUAL = 1e-8  # mm, kN, 0.1 kN m: a hundred times the rounding of the length equations
_ITERATIONS = 30
_SAMPLE, _START_DEGREE = 250, 5  # a large mesh starts from polynomials of 56 terms through a part of it


class ConvergenceError(RuntimeError):
    """The equations were not solved; the message says for which loads."""


def rotation(angles: ca.SX) -> ca.SX:
    """Return R_z(psi) R_x(phi) R_y(theta) of (3.4), (3.5) for `angles` = (phi, theta, psi)."""
    phi, theta, psi = ca.vertsplit(angles)
    about_x = ca.vertcat(
        ca.horzcat(1, 0, 0),
        ca.horzcat(0, ca.cos(phi), -ca.sin(phi)),
        ca.horzcat(0, ca.sin(phi), ca.cos(phi)),
    )
    about_y = ca.vertcat(
        ca.horzcat(ca.cos(theta), 0, ca.sin(theta)),
        ca.horzcat(0, 1, 0),
        ca.horzcat(-ca.sin(theta), 0, ca.cos(theta)),
    )
    about_z = ca.vertcat(
        ca.horzcat(ca.cos(psi), -ca.sin(psi), 0),
        ca.horzcat(ca.sin(psi), ca.cos(psi), 0),
        ca.horzcat(0, 0, 1),
    )
    return about_z @ about_x @ about_y


def turned(axis: ArrayLike, angle: ca.SX, arm: ArrayLike) -> ca.SX:
    """Return R(n, alpha) `arm` of (3.6), (3.7)."""
    n, vector = ca.DM(np.asarray(axis)), ca.DM(np.asarray(arm))
    return (
        ca.cos(angle) * vector
        + (1 - ca.cos(angle)) * ca.dot(n, vector) * n
        + ca.sin(angle) * ca.cross(n, vector)
    )


def wheel_down(spindle: ca.SX) -> ca.SX:
    """Return the unit vector from wheel centre to contact point, (3.17), with the road normal (0, 0, 1)."""
    normal = ca.DM([0, 0, 1])
    along = -ca.cross(spindle, ca.cross(spindle, normal))
    return along / ca.norm_2(along)


@dataclass(frozen=True)
class Solution(Stance):
    """Solution of the 26 equations for N load cases.

    Attributes
    ----------
    displacement : numpy.ndarray, shape (N, 2, 3)
        D of (3.3) of the left and right wheel carrier from the design position, m.
    angles : numpy.ndarray, shape (N, 2, 3)
        Euler angles phi, theta, psi, rad.
    rocker : numpy.ndarray, shape (N, 2)
        alpha_L and alpha_R, rad.
    rod_forces : numpy.ndarray, shape (N, 2, 6)
        R_L1 to R_L6 and R_R1 to R_R6, N, positive in tension.
    camber, toe : numpy.ndarray, shape (N, 2)
        Angles of (3.21) and (3.22), rad, right-hand rule about x and z of the car.
    residual : float
        Largest residual of the scaled equations.
    """

    displacement: Array
    angles: Array
    rocker: Array
    rod_forces: Array
    camber: Array
    toe: Array
    residual: float


class Mechanism:
    """The equations of one axle, ready to be solved.

    Parameters
    ----------
    axle : Axle
    """

    def __init__(self, axle: Axle) -> None:
        self.axle = axle

    @cached_property
    def equations(self) -> ca.Function:
        """The residual of the scaled equations: ``(unknowns (26), given (18)) -> (26, contact points)``.

        ``given`` holds left and right tyre force (N) and moment (N m), both loaded radii (m), the steer
        angle (rad), and K_h (N/m), K_t and K_arb (N m/rad).
        """
        axle = self.axle
        unknowns, given = ca.SX.sym("x", UNKNOWNS), ca.SX.sym("p", 18)
        physical = unknowns * ca.DM(_SCALES)
        forces, moments = ca.reshape(given[0:6], 3, 2), ca.reshape(given[6:12], 3, 2)
        radius, (steer, K_h, K_t, K_arb) = given[12:14], ca.vertsplit(given[14:18])
        alpha = physical[6], physical[19]

        spring_ends = [
            ca.DM(axle.pivot * side)
            + turned(axle.rocker_axis * side, alpha[i], (axle.spring_end - axle.pivot) * side)
            for i, side in enumerate((np.ones(3), MIRROR))
        ]
        spring = spring_ends[1] - spring_ends[0]
        length = ca.norm_2(spring)
        stretch = length - axle.heave_free_length
        F_heave = K_h * (1 - axle.heave_hardening * stretch) * stretch  # (3.10)

        equations, contacts, spindles = [], [], []
        for i, side in enumerate((np.ones(3), MIRROR)):
            x = physical[13 * i : 13 * (i + 1)]
            R, D, rods = rotation(x[3:6]), x[0:3], x[7:13]
            centre = ca.DM(axle.wheel_centre * side) + D
            arms = [R @ ca.DM((point - axle.wheel_centre) * side) for point in axle.carrier]
            rod_end = ca.DM(axle.pivot * side) + turned(
                axle.rocker_axis * side, alpha[i], (axle.rod_end - axle.pivot) * side
            )
            inner = [ca.SX(ca.DM(point * side)) for point in axle.chassis]
            inner[4] -= ca.vertcat(0, axle.pinion_radius * steer, 0)  # (3.2)
            along = [end - (centre + arm) for end, arm in zip((*inner, rod_end), arms, strict=True)]
            d = [vector / ca.norm_2(vector) for vector in along]

            lengths = [  # (3.1), divided by 2 l so that it counts metres
                (ca.sumsqr(vector) - length**2) / (2 * length)
                for vector, length in zip(along, axle.link_lengths, strict=True)
            ]
            spindle = R @ ca.DM([0, 1, 0])  # (3.15)
            to_road = radius[i] * wheel_down(spindle)  # (3.16)
            weight = ca.DM([0, 0, axle.carrier_mass * GRAVITY])  # (3.11)
            force = forces[:, i] + weight + sum(r * e for r, e in zip(ca.vertsplit(rods), d, strict=True))
            lever = [arm - arms[0] for arm in arms]
            d_1W = -arms[0]
            moment = moments[:, i] + ca.cross(d_1W + to_road, forces[:, i]) + ca.cross(d_1W, weight)
            moment += sum(
                r * ca.cross(a, e) for r, a, e in zip(ca.vertsplit(rods[1:]), lever[1:], d[1:], strict=True)
            )
            n, sign = ca.DM(axle.rocker_axis * side), (1, -1)[i]
            pivot = ca.DM(axle.pivot * side)
            torque = -rods[5] * ca.dot(ca.cross(rod_end - pivot, d[5]), n)
            torque += sign * F_heave / length * ca.dot(ca.cross(spring_ends[i] - pivot, spring), n)
            torque -= K_t * alpha[i] + sign * axle.torsion_preload + K_arb * (alpha[0] + alpha[1])
            equations.append(
                ca.vertcat(1e3 * ca.vertcat(*lengths), 1e-3 * force, 1e-2 * moment, 1e-2 * torque)
            )
            contacts.append(centre + to_road)
            spindles.append(spindle)
        results = [ca.vertcat(*equations), ca.horzcat(*contacts), ca.horzcat(*spindles)]
        return ca.Function("equations", [unknowns, given], results, ["x", "p"], ["g", "contact", "spindle"])

    @cached_property
    def _functions(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        """Residual of the equations alone, one step of Newton's method, and contact points with spindles."""
        x, p = ca.SX.sym("x", UNKNOWNS), ca.SX.sym("p", 18)
        g, *places = self.equations(x, p)
        # shared subexpressions go by `cse`: a quarter of the Jacobian's cost
        residual = ca.Function("residual", [x, p], ca.cse([g]))
        both = ca.Function("both", [x, p], ca.cse([g, ca.jacobian(g, x)]))
        at, given = ca.MX.sym("x", UNKNOWNS), ca.MX.sym("p", 18)
        value, jacobian = both(at, given)
        step = ca.Function("step", [at, given], [at - ca.solve(jacobian, value, "qr")])
        return residual, step, ca.Function("places", [x, p], places)

    def _newton(self, start: Array, given: Array) -> tuple[Array, Array]:
        """Return unknowns and residuals, shape (26, N), after Newton's method on all cases not solved yet."""
        residual, step, _ = self._functions
        x, left = start.copy(), np.full(start.shape, np.inf)
        unsolved = np.arange(x.shape[1])
        for _ in range(_ITERATIONS):
            x[:, unsolved] = np.asarray(step(x[:, unsolved], given[:, unsolved]))
            left[:, unsolved] = np.asarray(residual(x[:, unsolved], given[:, unsolved]))
            worst = np.abs(left[:, unsolved]).max(axis=0)
            if not np.all(np.isfinite(worst)):
                break
            unsolved = unsolved[worst > _RESIDUAL]
            if not unsolved.size:
                break
        return x, left

    def solve(
        self, loads: WheelLoads, *, heave_stiffness: ArrayLike | None = None, rigid_tyre: bool = False
    ) -> Solution:
        """Solve the equations for every load case by Newton's method from the design position.

        A large mesh is solved in two steps: 250 of its cases from the design position, and all of them from
        polynomials through these, which leaves one or two steps for each instead of seven.

        Parameters
        ----------
        loads : WheelLoads
            N cases.
        heave_stiffness : array_like, shape broadcastable to the loads' shape, optional
            K_h in N/m of each case; the axle's own if not given.
        rigid_tyre : bool
            Leave the tyre's squash out.

        Raises
        ------
        ConvergenceError
            If a case is not solved to rounding, or the solution lies on another branch of the linkage.
        ValueError
            If a heave stiffness is not above zero.
        """
        stiffness = spring_stiffness(self.axle, loads, heave_stiffness)
        radii = [loaded_radius(force[:, 2], rigid=rigid_tyre) for force in (loads.left, loads.right)]
        springs = np.tile([self.axle.torsion_stiffness, self.axle.anti_roll_stiffness], (len(loads), 1))
        given = np.column_stack(
            (
                loads.left,
                loads.right,
                loads.left_moment,
                loads.right_moment,
                *radii,
                loads.steer,
                stiffness,
                springs,
            )
        ).T
        start = np.zeros((UNKNOWNS, len(loads)))
        if len(loads) > 2 * _SAMPLE and loads.vertical_only and not np.any(loads.steer):
            start = self._polynomial_start(given)
        found, residual = self._newton(start, given)
        self._refuse_unsolved(residual, found.T, given.T)
        contact, spindle = (np.asarray(one) for one in self._functions[2](found, given))
        x = (found.T * _SCALES).reshape(-1, 2, 13)
        contact = contact.T.reshape(-1, 2, 3)
        camber, toe = wheel_angles(spindle.T.reshape(-1, 2, 3))
        standing = stance(contact[:, 0], contact[:, 1], self.axle.reference_plane)
        return Solution(
            **vars(standing),
            displacement=x[:, :, 0:3],
            angles=x[:, :, 3:6],
            rocker=x[:, :, 6],
            rod_forces=x[:, :, 7:13],
            camber=camber,
            toe=toe,
            residual=float(np.abs(residual).max()),
        )

    def _polynomial_start(self, given: Array) -> Array:
        """Return unknowns from polynomials through a few cases that are solved from the design position."""
        # deflections are nearly linear in a compliance, not in a stiffness
        inputs = np.column_stack((given[2], given[5], 1.0 / given[15]))
        lowest, width = inputs.min(axis=0), np.ptp(inputs, axis=0)
        inputs = 2.0 * (inputs - lowest)[:, width > 0.0] / width[width > 0.0] - 1.0
        chosen = np.random.default_rng(3).permutation(given.shape[1])[:_SAMPLE]
        part, _ = self._newton(np.zeros((UNKNOWNS, _SAMPLE)), given[:, chosen])
        phi = design_matrix(inputs, _START_DEGREE)
        through, *_ = np.linalg.lstsq(phi[chosen], part.T, rcond=None)
        return (phi @ through).T

    def _refuse_unsolved(self, residual: Array, found: Array, given: Array) -> None:
        worst = np.abs(residual).max(axis=0)
        failed = np.flatnonzero(~(worst <= _RESIDUAL))
        if failed.size:
            F_l, F_r = given[failed[0], [2, 5]]
            equation = _named(int(np.argmax(np.abs(residual[:, failed[0]]))))
            raise ConvergenceError(
                f"{self.axle.name}: {failed.size} of {len(found)} load cases were not solved, the first at "
                f"F_l = {F_l / 1e3:g} kN, F_r = {F_r / 1e3:g} kN, where {equation} is left at "
                f"{worst[failed[0]]:.1e}: the linkage cannot follow these loads."
            )
        rocker = np.abs(found[:, [6, 19]] * 1e-2).max()
        if rocker > np.pi / 2:
            raise ConvergenceError(
                f"{self.axle.name}: a rocker turned by {np.degrees(rocker):.0f} degrees, past its dead "
                "centre."
            )


def spring_stiffness(axle: Axle, loads: WheelLoads, given: ArrayLike | None) -> Array:
    """Return K_h in N/m for every load case; refuse what is not above zero."""
    own: ArrayLike = axle.heave_stiffness if given is None else given
    stiffness = np.ravel(np.broadcast_to(np.asarray(own, dtype=float), loads.shape or (1,)))
    if not np.all(stiffness > 0.0):
        raise ValueError(f"{axle.name}: heave_stiffness = {stiffness.min():g} N/m must be above zero.")
    return stiffness


def wheel_angles(spindle: Array) -> tuple[Array, Array]:
    """Return camber (3.21) and toe (3.22), (3.23) in rad for spindle directions of shape (..., 3)."""
    camber = np.arcsin(spindle[..., 2])
    # e_cp = e_cw x e_rn = (e_y, -e_x, 0) up to length; its angle from the x-axis is the toe angle
    return camber, np.arctan2(-spindle[..., 0], spindle[..., 1])


def _named(row: int) -> str:
    side, within = ("left", "right")[row // 13], row % 13
    groups: Sequence[tuple[int, str]] = (
        (6, f"the length of the {side} {LINKS[min(within, 5)]}, (3.1),"),
        (9, f"the {side} force balance, {('(3.12)', '(3.13)')[row // 13]},"),
        (12, f"the {side} moment balance, {('(3.19)', '(3.20)')[row // 13]},"),
    )
    for end, name in groups:
        if within < end:
            return name
    return f"the {side} rocker's balance, {('(3.8)', '(3.9)')[row // 13]},"
