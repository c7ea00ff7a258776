"""Error estimate of a collocated solution, and the mesh that it asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.quadrature import (
    Array,
    interpolation_matrix,
    radau_integration,
    radau_points,
)


@dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """Relative state errors (2.162) in the scaled variables.

    Attributes
    ----------
    by_state : ndarray, shape (n_x, K)
        Largest relative error of every state in every mesh interval.
    place : ndarray, shape (n_x, K)
        Fraction of the range at which it stands.
    """

    by_state: Array
    place: Array

    @property
    def by_interval(self) -> Array:
        """Largest relative error in every mesh interval, shape (K,)."""
        return np.asarray(self.by_state.max(axis=0))

    @property
    def largest(self) -> float:
        """Largest relative error of the mesh."""
        return float(self.by_state.max())


def error_estimate(
    pointwise: Pointwise, mesh: Mesh, states: Array, controls: Array, parameters: Array
) -> ErrorEstimate:
    """Estimate the error of a solution by (2.160)–(2.162).

    In every interval the dynamics are evaluated on one Radau point more than it has, along
    the interpolated solution, and integrated from the interval's start; the difference to
    the interpolated states is the error.

    Parameters
    ----------
    pointwise : Pointwise
        The problem's point functions.
    mesh : Mesh
        The mesh of the solution.
    states : ndarray, shape (n_x, N + 1)
        Scaled states at the nodes.
    controls : ndarray, shape (n_u, N)
        Scaled controls at the collocation points.
    parameters : ndarray, shape (n_p,)
        Scaled parameters.

    Returns
    -------
    ErrorEstimate
    """
    count = pointwise.layout.states
    largest = np.empty((count, mesh.intervals))
    place = np.empty((count, mesh.intervals))
    for order, intervals in mesh.by_order():
        finer = radau_points(order + 1)
        coarse = radau_points(order)
        nodes = np.append(coarse, 1.0)
        first = mesh.first[intervals]
        x = states[:, first[:, None] + np.arange(order + 1)]
        u = controls[:, first[:, None] + np.arange(order)]
        x_finer = x @ interpolation_matrix(nodes, np.append(finer, 1.0)).T
        u_finer = u @ interpolation_matrix(coarse, finer).T
        starts, widths = mesh.boundaries[intervals], mesh.widths[intervals]
        fractions = starts[:, None] + 0.5 * widths[:, None] * (1 + finer)
        shape = (len(intervals), order + 1)
        z = np.concatenate((x_finer[..., :-1], u_finer)).reshape(-1, fractions.size)
        outputs = pointwise.evaluate(z, parameters, fractions.ravel())
        slopes = pointwise.derivatives(outputs).reshape(count, *shape)
        gained = slopes @ radau_integration(order + 1).T * (0.5 * widths[:, None])
        difference = np.abs(x_finer[..., :1] + gained - x_finer[..., 1:])
        relative = difference / (1 + np.abs(x_finer).max(axis=2, keepdims=True))
        at = relative.argmax(axis=2)
        largest[:, intervals] = np.take_along_axis(relative, at[..., None], axis=2)[..., 0]
        ends = np.append(finer[1:], 1.0)
        place[:, intervals] = starts + 0.5 * widths * (1 + ends[at])
    return ErrorEstimate(largest, place)


def refined(
    mesh: Mesh, errors: Array, tolerance: float, lowest: int = 3, highest: int = 10, aim: float = 1.0
) -> Mesh:
    """Return the next mesh of the ph method, (2.163) and (2.164).

    An interval above tolerance gets ⌈log(e/ε)/log N_k⌉ points more (the base of the
    logarithm, which the thesis does not print, is the number of points); where that
    exceeds `highest`, it is divided into intervals of `lowest` points.

    Parameters
    ----------
    mesh : Mesh
        The present mesh.
    errors : ndarray, shape (K,)
        Relative error in each interval.
    tolerance : float
        Relative error allowed.
    lowest, highest : int
        N_min and N_max.
    aim : float
        Part of the tolerance that takes the place of ε, at most 1.

    Returns
    -------
    Mesh
        The same mesh where every error is within tolerance.
    """
    boundaries, orders = [np.array([0.0])], []
    for k in range(mesh.intervals):
        order = int(mesh.orders[k])
        pieces = 1
        if errors[k] > tolerance:
            more = max(1, int(np.ceil(np.log(errors[k] / (aim * tolerance)) / np.log(max(order, 2)))))
            if order + more <= highest:
                order += more
            else:
                pieces = max(int(np.ceil((order + more) / lowest)), 2)
                order = lowest
        ends = np.linspace(mesh.boundaries[k], mesh.boundaries[k + 1], pieces + 1)[1:]
        boundaries.append(ends)
        orders.extend([order] * pieces)
    return Mesh(np.concatenate(boundaries), np.array(orders))
