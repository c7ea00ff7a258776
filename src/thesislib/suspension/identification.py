"""Which axle has the ride heights of Table 3.1, and what the table can say about an axle (section 3.2.1).

The thesis prints no hard points. A table of five independent slopes does not determine the thirty numbers
of an axle; what it does determine is counted here by the singular values of the slopes' derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from thesislib.polynomials import fit
from thesislib.suspension.axle import GRAVITY, MIRROR, Axle
from thesislib.suspension.kinematics import kinematics
from thesislib.suspension.loads import WheelLoads
from thesislib.suspension.reduced import ReducedAxle
from thesislib.suspension.tyre import loaded_radius

Array = NDArray[np.float64]


class Slopes(NamedTuple):
    """The five independent slopes of one axle in Table 3.1: mm, rad and kN."""

    h_F: float
    h_FF: float
    h_FlFr: float
    phi_F: float
    phi_FF: float


SLOPES = Slopes._fields

FREE = (
    "torsion_stiffness",
    "anti_roll_stiffness",
    "heave_hardening",
    "spring_arm_length",
    "spring_arm_angle",
    "rod_arm_length",
    "rod_arm_angle",
    "pivot_y",
    "pivot_z",
    "rod_pickup_z",
)
"""What an identification may move. Stiffnesses and lengths of arms count as natural logarithms, the
hardening in 1/m, angles in rad, positions in dm, so that a change of 0.1 is a moderate one in each."""


def at_rest(axle: Axle, load: float, height: float) -> Axle:
    """Return the axle with preload, free length and reference plane such that the car stands as designed.

    Parameters
    ----------
    axle : Axle
    load : float
        Vertical force of each tyre at rest, N (SAE, negative).
    height : float
        Ride height at rest, m.
    """
    wheel, zero = kinematics(axle), np.zeros(1)
    radius = loaded_radius(load)
    turn = float(wheel.rocker.derivative()(zero)[0, 0])
    drop = float(wheel.down[2:3].derivative()(zero)[0, 0])
    torque = (load * (radius * drop - 1.0) - axle.carrier_mass * GRAVITY) / turn
    length = float(np.linalg.norm(axle.spring_end * MIRROR - axle.spring_end))
    road = float(wheel.centre(zero)[2, 0] + radius * wheel.down(zero)[2, 0])
    return replace(axle, torsion_preload=torque, heave_free_length=length, reference_plane=road + height)


def moved(axle: Axle, changes: dict[str, float], load: float, height: float) -> Axle:
    """Return the axle with some of :data:`FREE` changed, standing at rest as before.

    Raises
    ------
    ValueError
        If a name is not in :data:`FREE`.
    GeometryError
        If the changed axle cannot work.
    """
    unknown = sorted(set(changes) - set(FREE))
    if unknown:
        raise ValueError(f"{', '.join(unknown)} cannot be identified; there are {', '.join(FREE)}.")
    by = {name: changes.get(name, 0.0) for name in FREE}
    pivot = axle.pivot + 0.1 * np.array([0.0, by["pivot_y"], by["pivot_z"]])
    ends = {}
    for arm in ("spring", "rod"):
        end = getattr(axle, f"{arm}_end") - axle.pivot
        turned = _about(axle.rocker_axis, by[f"{arm}_arm_angle"], end)
        ends[f"{arm}_end"] = pivot + np.exp(by[f"{arm}_arm_length"]) * turned
    carrier = axle.carrier.copy()
    carrier[5, 2] += 0.1 * by["rod_pickup_z"]
    changed = replace(
        axle,
        torsion_stiffness=axle.torsion_stiffness * np.exp(by["torsion_stiffness"]),
        anti_roll_stiffness=axle.anti_roll_stiffness * np.exp(by["anti_roll_stiffness"]),
        heave_hardening=axle.heave_hardening + by["heave_hardening"],
        pivot=pivot,
        carrier=carrier,
        link_lengths=np.array([]),
        **ends,
    )
    return at_rest(changed, load, height)


def slopes(axle: Axle, heaviest: float, points: int = 31) -> Slopes:
    """Return the slopes of the quadratic metamodel of an axle, fitted on a square mesh of loads.

    Parameters
    ----------
    axle : Axle
    heaviest : float
        Largest vertical tyre force, N (SAE, negative); the mesh goes from zero to it.
    points : int
        Loads per wheel.
    """
    F_l, F_r = np.meshgrid(*2 * (np.linspace(0.0, heaviest, points),), indexing="ij")
    solution = ReducedAxle(axle).solve(WheelLoads.of(F_l, F_r))
    loads = 1e-3 * np.column_stack((F_l.ravel(), F_r.ravel()))
    h = fit(loads, 1e3 * solution.height, 2).coefficients
    phi = fit(loads, solution.roll, 2).coefficients
    return Slopes(h[1], h[3], h[4], phi[1], phi[3])


@dataclass(frozen=True)
class Identified:
    """Result of an identification.

    Attributes
    ----------
    axle : Axle
    slopes : Slopes
        Those of the axle.
    evaluations : int
        Axles that were tried.
    """

    axle: Axle
    slopes: Slopes
    evaluations: int


def identify(
    axle: Axle,
    target: Slopes,
    free: Sequence[str],
    *,
    heaviest: float,
    load: float,
    height: float,
    wanted: Sequence[str] = SLOPES[:4],
    attachment: float = 1e-4,
) -> Identified:
    """Move some numbers of an axle until its metamodel has the slopes of a table.

    Parameters
    ----------
    axle : Axle
        Where to begin.
    target : Slopes
        What the table says.
    free : sequence of str
        Which of :data:`FREE` may move.
    heaviest : float
        Largest vertical tyre force of the mesh, N (SAE, negative).
    load, height : float
        Vertical force of each tyre (N) and ride height (m) at rest.
    wanted : sequence of str
        Which slopes to reach; the last one follows from the others by reciprocity.
    attachment : float
        Price of leaving the beginning, per unit of the free numbers, against relative errors of slopes: it
        settles what the slopes leave open.

    Raises
    ------
    ValueError
        If the slopes are not reached to 0.1 %.
    """
    index = [SLOPES.index(name) for name in wanted]
    goal = np.array(target)[index]

    def residual(x: Array) -> Array:
        reached = slopes(moved(axle, dict(zip(free, x, strict=True)), load, height), heaviest)
        return np.concatenate((np.array(reached)[index] / goal - 1.0, attachment * x))

    found = least_squares(residual, np.zeros(len(free)), x_scale=0.1, max_nfev=60)
    identified = moved(axle, dict(zip(free, found.x, strict=True)), load, height)
    reached = slopes(identified, heaviest)
    missed = np.abs(np.array(reached)[index] / goal - 1.0)
    if not np.all(missed < 1e-3):
        worst = int(np.argmax(missed))
        raise ValueError(
            f"{axle.name}: {wanted[worst]} = {np.array(reached)[index][worst]:.5g} stays {missed[worst]:.2%} "
            f"away from {goal[worst]:.5g}; the free numbers {', '.join(free)} cannot reach it."
        )
    return Identified(identified, reached, int(found.nfev))


@dataclass(frozen=True)
class Identifiability:
    """What the slopes of a table say about the free numbers of an axle.

    Attributes
    ----------
    derivatives : numpy.ndarray, shape (5, free)
        Changes of the slopes, each in units of its last printed digit, per hundredth of a free number.
    singular_values : numpy.ndarray, shape (5,)
        Of `derivatives`: a value far below 1 is a combination that the printed digits cannot show.
    rank : int
        How many singular values are above `visible`.
    visible : float
    """

    derivatives: Array
    singular_values: Array
    rank: int
    visible: float


def identifiability(
    axle: Axle,
    digits: Slopes,
    *,
    heaviest: float,
    load: float,
    height: float,
    step: float = 1e-3,
    visible: float = 0.1,
) -> Identifiability:
    """Differentiate the slopes with respect to every one of :data:`FREE`, by central differences.

    Parameters
    ----------
    axle : Axle
    digits : Slopes
        One unit of the last printed digit of each slope.
    heaviest, load, height : float
        As in :func:`identify`.
    step : float
        Half-width of the differences, in the units of :data:`FREE`.
    visible : float
        Singular values below this count as zero: a change of a hundredth moves no slope by a tenth of a
        digit.
    """
    columns = []
    for name in FREE:
        high, low = (
            np.array(slopes(moved(axle, {name: sign * step}, load, height), heaviest)) for sign in (1, -1)
        )
        columns.append((high - low) / (2.0 * step))
    derivatives = 1e-2 * np.column_stack(columns) / np.array(digits)[:, None]
    values = np.linalg.svd(derivatives, compute_uv=False)
    return Identifiability(derivatives, values, int(np.sum(values > visible)), visible)


def _about(axis: Array, angle: float, arm: Array) -> Array:
    """Return R(n, angle) `arm`, (3.6)."""
    along = (arm @ axis) * axis
    turned: Array = along + np.cos(angle) * (arm - along) + np.sin(angle) * np.cross(axis, arm)
    return turned
