"""Checks of a solved suspension by means that did not solve it.

Balances are summed again from the solution with rotation matrices of another library; energy, reciprocity
and wheel rates come from differences of solutions and, beside them, from closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from thesislib.suspension.axle import GRAVITY, MIRROR, Axle
from thesislib.suspension.kinematics import kinematics
from thesislib.suspension.loads import WheelLoads
from thesislib.suspension.mechanism import Mechanism, Solution
from thesislib.suspension.tyre import loaded_radius

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Balances:
    """Largest sums over all load cases of what should be zero.

    Attributes
    ----------
    force, moment : float
        On a wheel carrier, N and N m about the wheel centre.
    torque : float
        On a rocker about its axis, N m.
    length : float
        Change of a link's length, m.
    """

    force: float
    moment: float
    torque: float
    length: float


def balances(axle: Axle, loads: WheelLoads, solution: Solution) -> Balances:
    """Sum forces and moments on every body of a solved axle, and measure the links."""
    ends, sums = [], {name: [0.0] for name in Balances.__annotations__}
    placed = []
    for i, side in enumerate((np.ones(3), MIRROR)):
        phi, theta, psi = solution.angles[:, i].T
        # R_z(psi) R_x(phi) R_y(theta) of (3.5) turns about moving axes in this order
        turn = Rotation.from_euler("ZXY", np.column_stack((psi, phi, theta)))
        centre = axle.wheel_centre * side + solution.displacement[:, i]
        outer = [centre + turn.apply((point - axle.wheel_centre) * side) for point in axle.carrier]
        rocker = Rotation.from_rotvec(solution.rocker[:, i, None] * (axle.rocker_axis * side))
        pivot = axle.pivot * side
        rod_end, spring_end = (
            pivot + rocker.apply((end - axle.pivot) * side) for end in (axle.rod_end, axle.spring_end)
        )
        inner = [np.broadcast_to(point * side, centre.shape).copy() for point in axle.chassis]
        inner[4][:, 1] -= axle.pinion_radius * loads.steer
        placed.append((centre, outer, [*inner, rod_end], pivot, rod_end))
        ends.append(spring_end)
    spring = ends[1] - ends[0]
    length = np.linalg.norm(spring, axis=1, keepdims=True)
    stretch = length - axle.heave_free_length
    tension = axle.heave_stiffness * (1.0 - axle.heave_hardening * stretch) * stretch * spring / length
    contacts = (solution.contact_left, solution.contact_right)
    for i, (centre, outer, inner, pivot, rod_end) in enumerate(placed):
        side = (np.ones(3), MIRROR)[i]
        tyre, moment = ((loads.left, loads.left_moment), (loads.right, loads.right_moment))[i]
        force = tyre + np.array([0.0, 0.0, axle.carrier_mass * GRAVITY])
        about = moment + np.cross(contacts[i] - centre, tyre)
        for j in range(6):
            along = inner[j] - outer[j]
            apart = np.linalg.norm(along, axis=1, keepdims=True)
            rod = solution.rod_forces[:, i, j, None] * along / apart
            force = force + rod
            about = about + np.cross(outer[j] - centre, rod)
            sums["length"].append(float(np.abs(apart - axle.link_lengths[j]).max()))
        # the last rod is the push rod: it acts on the rocker with the opposite sign
        turning = np.cross(rod_end - pivot, -rod) + np.cross(ends[i] - pivot, (tension, -tension)[i])
        elastic = axle.torsion_stiffness * solution.rocker[:, i] + (1.0, -1.0)[i] * axle.torsion_preload
        elastic = elastic + axle.anti_roll_stiffness * solution.rocker.sum(axis=1)
        sums["force"].append(float(np.abs(force).max()))
        sums["moment"].append(float(np.abs(about).max()))
        sums["torque"].append(float(np.abs(turning @ (axle.rocker_axis * side) - elastic).max()))
    return Balances(**{name: max(values) for name, values in sums.items()})


def _energy(axle: Axle, solution: Solution) -> Array:
    """Return the energy of springs and weights in J from rocker angles and wheel positions."""
    ends = []
    for i, side in enumerate((np.ones(3), MIRROR)):
        rocker = Rotation.from_rotvec(solution.rocker[:, i, None] * (axle.rocker_axis * side))
        ends.append(axle.pivot * side + rocker.apply((axle.spring_end - axle.pivot) * side))
    stretch = np.linalg.norm(ends[1] - ends[0], axis=1) - axle.heave_free_length
    left, right = solution.rocker.T
    energy = axle.heave_stiffness * (stretch**2 / 2.0 - axle.heave_hardening * stretch**3 / 3.0)
    energy += 0.5 * axle.torsion_stiffness * (left**2 + right**2) + axle.torsion_preload * (left - right)
    energy += 0.5 * axle.anti_roll_stiffness * (left + right) ** 2
    weight: Array = axle.carrier_mass * GRAVITY * solution.displacement[:, :, 2].sum(axis=1)
    result: Array = energy - weight
    return result


def virtual_work(mechanism: Mechanism, F_l: Array, F_r: Array, step: float = 1.0) -> float:
    """Return by how much the work of the loads misses the change of energy, over that change.

    Each load is changed by `step` (N) up and down on rigid tyres; the forces' work is the mean force times
    the contact points' motion.
    """
    energy, contact = [], []
    cases = [(F_l + sign * step * i, F_r + sign * step * (1 - i)) for i in (1, 0) for sign in (-1.0, 1.0)]
    for left, right in cases:
        solution = mechanism.solve(WheelLoads.of(left, right), rigid_tyre=True)
        energy.append(_energy(mechanism.axle, solution))
        contact.append(np.stack((solution.contact_left[:, 2], solution.contact_right[:, 2])))
    worst = 0.0
    for low, high in ((0, 1), (2, 3)):
        gained = energy[high] - energy[low]
        done = F_l * (contact[high][0] - contact[low][0]) + F_r * (contact[high][1] - contact[low][1])
        worst = max(worst, float((np.abs(gained - done) / np.abs(gained).max()).max()))
    return worst


def reciprocity_by_differences(mechanism: Mechanism, F_l: Array, F_r: Array, step: float = 5.0) -> float:
    """Return the largest relative difference of dz_l/dF_r and dz_r/dF_l on rigid tyres (Maxwell, Betti)."""
    contact = [
        mechanism.solve(WheelLoads.of(F_l + left, F_r + right), rigid_tyre=True)
        for left, right in ((0.0, step), (0.0, -step), (step, 0.0), (-step, 0.0))
    ]
    left_by_right = (contact[0].contact_left - contact[1].contact_left)[:, 2]
    right_by_left = (contact[2].contact_right - contact[3].contact_right)[:, 2]
    return float(np.abs(left_by_right / right_by_left - 1.0).max())


class WheelRates(NamedTuple):
    """Force per wheel travel at rest when both wheels move alike, and when they move oppositely: N/m."""

    heave: float
    roll: float


def rates_in_closed_form(axle: Axle, load: float) -> WheelRates:
    """Return the wheel rates at rest under `load` (N) per tyre, from motion ratios.

    With the motion ratio a = dalpha/dq, the heave spring's rate per rocker angle s = dL/dalpha and the
    preload torque tau, the heave rate is a^2 (K_t + 2 K_h s^2) + tau da/dq and the roll rate
    a^2 (K_t + 2 K_arb) + tau da/dq, both less the load's own F R d^2(r_z)/dq^2: the contact point moves
    under the wheel.
    """
    wheel, zero = kinematics(axle), np.zeros(1)
    slope = wheel.rocker.derivative()
    a, change = float(slope(zero)[0, 0]), float(slope.derivative()(zero)[0, 0])
    arm = np.cross(axle.rocker_axis, axle.spring_end - axle.pivot)
    across = axle.spring_end * MIRROR - axle.spring_end
    s = float(arm @ across / np.linalg.norm(across))
    down = float(wheel.down[2:3].derivative().derivative()(zero)[0, 0])
    common = a**2 * axle.torsion_stiffness + axle.torsion_preload * change - load * loaded_radius(load) * down
    return WheelRates(
        common + 2.0 * axle.heave_stiffness * (a * s) ** 2, common + 2.0 * axle.anti_roll_stiffness * a**2
    )


def rates_by_differences(mechanism: Mechanism, load: float, step: float = 2.0) -> WheelRates:
    """Return the wheel rates from solutions of the 26 equations around rest, on tyres of the rest's radius.

    The wheel centre's vertical motion is the travel; the tyre's squash does not enter it.
    """
    F_l = load + step * np.array([1.0, -1.0, 1.0, -1.0])
    F_r = load + step * np.array([1.0, -1.0, -1.0, 1.0])
    solution = mechanism.solve(WheelLoads.of(F_l, F_r))
    z = solution.displacement[:, :, 2]
    return WheelRates(
        2.0 * step / float(z[0, 0] - z[1, 0]),
        2.0 * step / float(z[2, 0] - z[3, 0]),
    )
