"""The suspension in two unknowns: the wheel travels of an axle, by virtual work.

The linkage does no work in its joints, so that the principle of virtual work needs only what a wheel's
travel moves: the tyre force its contact point, the weight the wheel, and the springs the rocker. It is the
26 equations with their rod forces eliminated, and agrees with them to the accuracy of the polynomials of
:mod:`thesislib.suspension.kinematics`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thesislib.suspension.axle import GRAVITY, MIRROR, Axle
from thesislib.suspension.kinematics import Kinematics, kinematics
from thesislib.suspension.loads import Stance, WheelLoads, stance
from thesislib.suspension.mechanism import ConvergenceError, spring_stiffness
from thesislib.suspension.tyre import loaded_radius

Array = NDArray[np.float64]

_ITERATIONS = 25
_TOLERANCE = 1e-11  # m: a step this small moves no ride height by a nanometre


@dataclass(frozen=True)
class Equilibrium(Stance):
    """Equilibrium of the reduced axle for N load cases.

    Attributes
    ----------
    travel : numpy.ndarray, shape (N, 2)
        Travel of the left and right wheel in the chassis, m, bump positive.
    rocker : numpy.ndarray, shape (N, 2)
        Rocker angles in each side's own mirrored axes, rad: equal in heave.
    """

    travel: Array
    rocker: Array


class Spring(NamedTuple):
    """Heave spring over both rocker angles: tension, its slope, length, and the length's derivatives."""

    tension: Array
    slope: Array
    length: Array
    gradient: tuple[Array, Array]
    curvature: tuple[Array, Array, Array]


class ReducedAxle:
    """One axle in minimal coordinates.

    Parameters
    ----------
    axle : Axle
    """

    def __init__(self, axle: Axle) -> None:
        self.axle = axle
        self.wheel = kinematics(axle)
        self._fast = _Fast(self.wheel)

    def solve(
        self,
        loads: WheelLoads,
        *,
        heave_stiffness: ArrayLike | None = None,
        rigid_tyre: bool = False,
    ) -> Equilibrium:
        """Return the equilibrium under vertical tyre forces, by Newton's method on all cases at once.

        Parameters
        ----------
        loads : WheelLoads
            N cases without horizontal forces, moments or steer; those need the 26 equations.
        heave_stiffness : array_like, optional
            K_h in N/m of each case; the axle's own if not given.
        rigid_tyre : bool
            Leave the tyre's squash out.

        Raises
        ------
        ValueError
            If the loads have other components, or a heave stiffness is not above zero.
        ConvergenceError
            If there is no equilibrium within the axle's travel.
        """
        if not loads.vertical_only or np.any(loads.steer):
            raise ValueError(
                f"{self.axle.name}: the reduced axle takes vertical tyre forces alone; use the 26 equations."
            )
        K_h = spring_stiffness(self.axle, loads, heave_stiffness)
        F = loads.left[:, 2], loads.right[:, 2]
        R = tuple(loaded_radius(one, rigid=rigid_tyre) for one in F)
        q = np.zeros((2, len(loads)))
        low, high = self.wheel.travel
        for _ in range(_ITERATIONS):
            g, J = self._balance(q, F, R, K_h)
            determinant = J[0] * J[2] - J[1] ** 2
            step = np.stack((J[2] * g[0] - J[1] * g[1], J[0] * g[1] - J[1] * g[0])) / determinant
            q = np.clip(q - step, low, high)
            if not np.all(np.isfinite(q)) or float(np.abs(step).max(initial=0.0)) < _TOLERANCE:
                break
        self._refuse_unbalanced(step, q, F)
        left, right = self.contact(q[0], R[0]), self.contact(q[1], R[1]) * MIRROR
        rocker = np.stack([self._fast.rocker(one) for one in q], axis=1)
        standing = stance(left, right, self.axle.reference_plane)
        return Equilibrium(**vars(standing), travel=q.T, rocker=rocker)

    def contact(self, q: Array, R: Array) -> Array:
        """Return the left wheel's contact point in m, shape (N, 3), at travels `q` and tyre radii `R`."""
        return (self.wheel.centre(q) + R * self.wheel.down(q)).T

    def spring(self, alpha: tuple[Array, Array], K_h: ArrayLike) -> Spring:
        """Return the heave spring at rocker angles in mirrored axes: (3.10) and its derivatives."""
        axle = self.axle
        n, arm = axle.rocker_axis, axle.spring_end - axle.pivot
        along = (arm @ n) * n
        across, turned = arm - along, np.cross(n, arm - along)
        signs = ((1.0, 1.0, 1.0), (-1.0, 1.0, -1.0))  # left end minus mirrored right end
        offset = (axle.pivot + along) * np.array([0.0, 2.0, 0.0])
        c, s = [np.cos(one) for one in alpha], [np.sin(one) for one in alpha]
        end = [[c[i] * across[k] + s[i] * turned[k] for k in range(3)] for i in range(2)]
        rate = [[c[i] * turned[k] - s[i] * across[k] for k in range(3)] for i in range(2)]
        span = [offset[k] + signs[0][k] * end[0][k] + signs[1][k] * end[1][k] for k in range(3)]
        length = np.sqrt(span[0] ** 2 + span[1] ** 2 + span[2] ** 2)
        gradient = tuple(sum(signs[i][k] * span[k] * rate[i][k] for k in range(3)) / length for i in range(2))
        second = [
            (sum(rate[i][k] ** 2 - signs[i][k] * span[k] * end[i][k] for k in range(3)) - gradient[i] ** 2)
            / length
            for i in range(2)
        ]
        mixed = (
            sum(signs[0][k] * signs[1][k] * rate[0][k] * rate[1][k] for k in range(3))
            - gradient[0] * gradient[1]
        ) / length
        stretch = length - axle.heave_free_length
        return Spring(
            K_h * (stretch - axle.heave_hardening * stretch**2),
            K_h * (1.0 - 2.0 * axle.heave_hardening * stretch),
            length,
            (gradient[0], gradient[1]),
            (second[0], mixed, second[1]),
        )

    def _balance(
        self, q: Array, F: tuple[Array, Array], R: tuple[Array, ...], K_h: Array
    ) -> tuple[Array, tuple[Array, Array, Array]]:
        """Return minus the generalised forces on both travels, and their symmetric derivative."""
        axle = self.axle
        sides = [self._fast(one) for one in q]
        alpha = sides[0].alpha, sides[1].alpha
        spring = self.spring(alpha, K_h)
        torque, stiffness = [], []
        for i in range(2):
            twist = alpha[i] - alpha[1 - i]
            elastic = axle.torsion_stiffness * alpha[i] + axle.torsion_preload
            torque.append(elastic + axle.anti_roll_stiffness * twist + spring.tension * spring.gradient[i])
        own = axle.torsion_stiffness + axle.anti_roll_stiffness
        for i in range(2):
            stiffness.append(
                own + spring.slope * spring.gradient[i] ** 2 + spring.tension * spring.curvature[2 * i]
            )
        mixed = (
            spring.slope * spring.gradient[0] * spring.gradient[1]
            + spring.tension * spring.curvature[1]
            - axle.anti_roll_stiffness
        )
        weight = axle.carrier_mass * GRAVITY
        g, J = [], []
        for i, side in enumerate(sides):
            g.append(side.alpha_1 * torque[i] + weight - F[i] * (R[i] * side.down_1 - 1.0))
            J.append(side.alpha_2 * torque[i] + side.alpha_1**2 * stiffness[i] - F[i] * R[i] * side.down_2)
        return np.stack(g), (J[0], sides[0].alpha_1 * sides[1].alpha_1 * mixed, J[1])

    def _refuse_unbalanced(self, step: Array, q: Array, F: tuple[Array, Array]) -> None:
        failed = np.flatnonzero(~(np.abs(step).max(axis=0) < _TOLERANCE))
        if failed.size:
            at = failed[0]
            low, high = self.wheel.travel
            raise ConvergenceError(
                f"{self.axle.name}: no equilibrium at wheel travels {1e3 * low:g} .. {1e3 * high:g} mm "
                f"for {failed.size} of {q.shape[1]} load cases, the first at F_l = {F[0][at] / 1e3:g} kN, "
                f"F_r = {F[1][at] / 1e3:g} kN."
            )


class _Side(NamedTuple):
    alpha: Array
    alpha_1: Array
    alpha_2: Array
    down_1: Array
    down_2: Array


class _Fast:
    """The five functions of the travel that vertical forces need, evaluated in one go."""

    def __init__(self, wheel: Kinematics) -> None:
        alpha, down = wheel.rocker, wheel.down[2:3]
        slopes = alpha.derivative(), down.derivative()
        curves = (alpha, slopes[0], slopes[0].derivative(), slopes[1], slopes[1].derivative())
        rows = len(alpha.coefficients)
        padded = [np.pad(one.coefficients, ((0, rows - len(one.coefficients)), (0, 0))) for one in curves]
        self._curves = type(alpha)(np.hstack(padded), wheel.travel)
        self.rocker = lambda q: alpha(q)[0]

    def __call__(self, q: Array) -> _Side:
        return _Side(*self._curves(q))
