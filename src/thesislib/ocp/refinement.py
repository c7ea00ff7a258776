"""Error estimate of a collocated solution, and the mesh that it asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.quadrature import Array, interpolation_matrix

# A state that stays below this part of its bounds is measured by this part.
SMALLEST_SIZE = 1e-3


@dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """Relative state errors (2.162) in the scaled variables.

    The one in the denominator of (2.162) stands for the size of a state. Where the problem gives a state
    a scale, that is its size; where the scale is only that of the bounds, which may be far away, the
    largest magnitude along the trajectory takes its place.

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

    In every interval the dynamics are evaluated on one collocation point more than it has, along
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
    reached = np.clip(np.abs(states).max(axis=1), SMALLEST_SIZE, 1.0)
    given = np.array([state.scale is not None for state in pointwise.problem.states])
    size = np.where(given, 1.0, reached)[:, None, None]
    largest = np.empty((count, mesh.intervals))
    place = np.empty((count, mesh.intervals))
    for order, intervals in mesh.by_order():
        finer, coarse = mesh.rule.points(order + 1), mesh.rule.points(order)
        nodes, finer_nodes = mesh.rule.support(order), mesh.rule.support(order + 1)
        first = mesh.first[intervals]
        x = states[:, first[:, None] + np.arange(order + 1)]
        u = controls[:, first[:, None] + np.arange(order)]
        x_finer = x @ interpolation_matrix(nodes, finer_nodes).T
        at_points = x_finer[..., :-1] if mesh.rule.start else x_finer[..., 1:]
        u_finer = u @ interpolation_matrix(coarse, finer).T
        starts, widths = mesh.boundaries[intervals], mesh.widths[intervals]
        fractions = starts[:, None] + 0.5 * widths[:, None] * (1 + finer)
        shape = (len(intervals), order + 1)
        z = np.concatenate((at_points, u_finer)).reshape(-1, fractions.size)
        outputs = pointwise.evaluate(z, parameters, fractions.ravel())
        slopes = pointwise.derivatives(outputs).reshape(count, *shape)
        gained = slopes @ mesh.rule.integration(order + 1).T * (0.5 * widths[:, None])
        difference = np.abs(x_finer[..., :1] + gained - x_finer[..., 1:])
        relative = difference / (size + np.abs(x_finer).max(axis=2, keepdims=True))
        at = relative.argmax(axis=2)
        largest[:, intervals] = np.take_along_axis(relative, at[..., None], axis=2)[..., 0]
        place[:, intervals] = starts + 0.5 * widths * (1 + finer_nodes[1:][at])
    return ErrorEstimate(largest, place)


@dataclass(frozen=True, eq=False)
class Refinement:
    """The next mesh, and what made it of the present one.

    Attributes
    ----------
    mesh : Mesh
        The next mesh.
    grown, divided, reduced, merged : int
        How many intervals of the present mesh got points, were divided, lost points, or became one with
        their neighbour.
    """

    mesh: Mesh
    grown: int = 0
    divided: int = 0
    reduced: int = 0
    merged: int = 0

    def __str__(self) -> str:
        words = [
            f"{count} {what}"
            for count, what in (
                (self.grown, "with more points"),
                (self.divided, "divided"),
                (self.reduced, "with fewer points"),
                (self.merged, "merged"),
            )
            if count
        ]
        return "intervals: " + ", ".join(words) if words else "unchanged"


def refined(
    mesh: Mesh, errors: Array, tolerance: float, lowest: int = 3, highest: int = 10, aim: float = 1.0
) -> Mesh:
    """Return the next mesh of the ph method without reduction; see `refine`."""
    return refine(mesh, errors, tolerance, lowest, highest, aim).mesh


def refine(
    mesh: Mesh,
    errors: Array,
    tolerance: float,
    lowest: int = 3,
    highest: int = 10,
    aim: float = 1.0,
    reduction: float = 0.0,
    keep: np.ndarray | None = None,
) -> Refinement:
    """Return the next mesh of the ph method, (2.163) and (2.164), and where little is needed, less of it.

    An interval above tolerance gets ⌈log(e/ε)/log N_k⌉ points more (the base of the
    logarithm, which the thesis does not print, is the number of points); where that
    exceeds `highest`, it is divided into intervals of `lowest` points.

    An interval far below tolerance loses the points by which the same rule would bring its error up to
    √`reduction` times the tolerance. Neighbours that have `lowest` points then become one.

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
    reduction : float
        Part of the tolerance below which an interval is reduced; zero for never.
    keep : ndarray of bool, shape (K,), optional
        Intervals that are not reduced, because they lie where the mesh was refined before: a mesh that
        takes back what it gave would go in circles.

    Returns
    -------
    Refinement
        With the same mesh where every error is within tolerance.
    """
    if np.all(errors <= tolerance):
        return Refinement(mesh)
    errors = np.maximum(errors, np.finfo(float).eps)
    base = np.log(np.maximum(mesh.orders, 2))
    orders, pieces = mesh.orders.copy(), np.ones(mesh.intervals, dtype=int)
    above = errors > tolerance
    more = np.maximum(1, np.ceil(np.log(errors / (aim * tolerance)) / base)).astype(int)
    grown = above & (mesh.orders + more <= highest)
    divided = above & ~grown
    orders[grown] += more[grown]
    pieces[divided] = np.maximum(np.ceil((mesh.orders + more)[divided] / lowest).astype(int), 2)
    orders[divided] = lowest
    small = errors < reduction * tolerance
    if keep is not None:
        small &= ~keep
    less = np.floor(np.log(np.sqrt(reduction) * tolerance / errors) / base) if reduction else np.zeros(1)
    fewer = np.where(small, np.maximum(mesh.orders - less, np.minimum(mesh.orders, lowest)), orders).astype(
        int
    )
    reduced, orders = small & (fewer < mesh.orders), fewer
    joins = _joins(small & (orders == lowest))
    starts, parts, kept = mesh.boundaries[:-1], [np.array([0.0])], []
    for k in range(mesh.intervals):
        if k + 1 < mesh.intervals and joins[k]:
            continue  # the neighbour's part begins where this one did
        begin = starts[k - 1] if k and joins[k - 1] else starts[k]
        parts.append(np.linspace(begin, mesh.boundaries[k + 1], pieces[k] + 1)[1:])
        kept += [int(orders[k])] * int(pieces[k])
    finer = Mesh(np.concatenate(parts), np.array(kept), mesh.rule)
    return Refinement(finer, int(grown.sum()), int(divided.sum()), int(reduced.sum()), int(joins.sum()))


def coarsened(mesh: Mesh, errors: Array, tolerance: float, lowest: int = 3, aim: float = 0.1) -> Mesh:
    """Return a coarser mesh for a solution that need be known to a larger tolerance only.

    Every interval loses the points by which the rule of (2.163) would bring its error up to `aim` times the
    tolerance, down to `lowest`. Neighbours that then have `lowest` points, and whose errors would stay there
    if their width were doubled, become one.

    Parameters
    ----------
    mesh : Mesh
        The present mesh.
    errors : ndarray, shape (K,)
        Relative error in each interval.
    tolerance : float
        Relative error allowed on the new mesh.
    lowest : int
        Fewest points of an interval.
    aim : float
        Part of the tolerance that is made use of: the rule is an estimate, and what it spoils has to be
        refined again.

    Returns
    -------
    Mesh
    """
    errors = np.maximum(errors, np.finfo(float).eps)
    less = np.floor(np.log(np.maximum(aim * tolerance / errors, 1.0)) / np.log(np.maximum(mesh.orders, 2)))
    orders = np.maximum(mesh.orders - less, np.minimum(mesh.orders, lowest)).astype(int)
    # the error of a polynomial on an interval of twice the width grows by two to its order
    reached = errors * np.maximum(mesh.orders, 2.0) ** (mesh.orders - orders) * 2.0 ** (lowest + 1)
    joins = _joins((orders == lowest) & (reached < aim * tolerance))
    keep = ~joins
    return Mesh(np.concatenate(([0.0], mesh.boundaries[1:][keep])), orders[keep], mesh.rule)


def _joins(small: np.ndarray) -> np.ndarray:
    """Return which intervals become one with the next: pairs of small neighbours, none in two pairs."""
    joins = np.zeros(len(small), dtype=bool)
    for k in range(len(small) - 1):
        joins[k] = small[k] and small[k + 1] and not (k and joins[k - 1])
    return joins
