"""Quadratic Lyapunov functions of the older literature, as far as they can be reconstructed (figure 7.14).

None of their coefficients is printed. V_lit1 is the Lyapunov equation's with Q = 1. V_lit2 is read as a
kinetic energy v² + lambda omega² whose lambda cancels the cross term of its linear rate. V_lit3 is read as
V_lit1 turned in the phase plane to where its largest certified set is largest.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from thesislib.stability.ascent import Ascent, Goal, Region
from thesislib.stability.bivariate import Polynomial
from thesislib.stability.fields import ExactCar
from thesislib.stability.phase_plane import polygon_area
from thesislib.stability.program import ProgramError
from thesislib.stability.programs import level_of, linear_lyapunov, quadratic
from thesislib.stability.rays import Rays

Array = NDArray[np.float64]


def linear_function(car: ExactCar, to_state: Array) -> Polynomial:
    """Return V_lit1."""
    return linear_lyapunov(car.field, to_state)


def energy_function(car: ExactCar, to_state: Array) -> Polynomial:
    """Return V_lit2, up to a factor."""
    A = to_state @ car.field.jacobian @ np.linalg.inv(to_state)
    weight = -A[0, 1] / A[1, 0]
    return quadratic(to_state.T @ np.diag([1.0, weight]) @ to_state)


def turned_function(car: ExactCar, to_state: Array, angles: int = 361) -> Polynomial:
    """Return V_lit3: V_lit1 turned by the angle for which {V <= level} has the largest area."""
    V = linear_function(car, to_state)
    P = _matrix(V, np.asarray(np.linalg.inv(to_state)))
    best, largest = V, 0.0
    rays = Rays(360)
    for angle in np.linspace(-np.pi / 2, np.pi / 2, angles):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turned = quadratic(to_state.T @ turn @ P @ turn.T @ to_state)
        level = level_of(car.field, turned, 240)
        if not 0 < level < np.inf:
            continue
        area = polygon_area(rays.points(rays.boundary(turned, level)) @ to_state.T)
        if area > largest:
            best, largest = turned, area
    return best


def _matrix(V: Polynomial, to_z: NDArray[Any]) -> Array:
    c = V.coefficients
    P = np.array([[c[2, 0], c[1, 1] / 2], [c[1, 1] / 2, c[0, 2]]])
    return np.asarray(to_z.T @ P @ to_z)


def largest_region(car: ExactCar, V: Polynomial, goal: Goal) -> Region:
    """Return the largest certified level set of a given V.

    Raises
    ------
    ProgramError
        If none can be certified.
    """
    region = Ascent((car,), goal).accept(V, 0.0)
    if region is None:
        raise ProgramError("No level set of this quadratic function can be certified.")
    return region
