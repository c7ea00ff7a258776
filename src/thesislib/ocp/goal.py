"""What the state errors of a mesh are worth in the objective.

A collocated solution follows the equations of motion at the collocation points only. Between them its slope
differs from them by a residual r(t): it is a solution of the problem whose dynamics are f + r. The costates
tell what that is worth: ∫ λ·r dt is the first change of the optimum. A mesh interval that resists refinement
can be judged so by what it does to the objective, which a relative state error does not say.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thesislib.ocp.quadrature import Array, interpolation_matrix
from thesislib.ocp.solution import Solution

# Points beyond an interval's own at which the residual is measured: it vanishes at its own.
_MORE = 2


@dataclass(frozen=True, eq=False)
class GoalError:
    """Effect of the state errors on the objective, by mesh interval, in units of the objective.

    Attributes
    ----------
    signed : ndarray, shape (K,)
        First-order estimate of the objective's error: the objective is too large by their sum.
    bound : ndarray, shape (K,)
        The same without cancelling, ∫ |λ|·|r| state by state.
    """

    signed: Array
    bound: Array


@dataclass(frozen=True)
class Resisting:
    """A mesh interval whose state error has stayed above a tolerance.

    Attributes
    ----------
    begin, end : float
        Where it is, in units of the independent variable.
    error : float
        Relative state error (2.162).
    bound : float
        Bound on its effect on the objective; see `GoalError`.
    """

    begin: float
    end: float
    error: float
    bound: float

    def __str__(self) -> str:
        return f"{self.begin:.1f} to {self.end:.1f}: error {self.error:.1e}, at most {self.bound:.1e}"


def goal_error(solution: Solution) -> GoalError:
    """Return what the state errors of a solution are worth in its objective.

    Parameters
    ----------
    solution : Solution
        An optimum with its multipliers.

    Returns
    -------
    GoalError

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """
    mesh, iterate, pointwise = solution.mesh, solution.iterate, solution.pointwise
    costates = solution.multipliers.costates
    count = pointwise.layout.states
    signed, bound = np.zeros(mesh.intervals), np.zeros(mesh.intervals)
    for order, intervals in mesh.by_order():
        own, nodes = mesh.rule.points(order), mesh.rule.support(order)
        tau, weights = np.polynomial.legendre.leggauss(order + _MORE)
        first, half = mesh.first[intervals][:, None], 0.5 * mesh.widths[intervals][:, None]
        at_nodes = iterate.states[:, first + np.arange(order + 1)]
        to_tau = interpolation_matrix(nodes, tau)
        states = at_nodes @ to_tau.T
        # the slope is a polynomial of one degree less: known at the points, and so everywhere
        slopes = at_nodes @ mesh.rule.differentiation(order).T @ interpolation_matrix(own, tau).T
        points = first + np.arange(order)
        controls = iterate.controls[:, points] @ interpolation_matrix(own, tau).T
        along = costates[:, points] @ interpolation_matrix(own, tau).T
        fractions = mesh.boundaries[intervals][:, None] + half * (1 + tau)
        z = np.concatenate((states, controls)).reshape(-1, fractions.size)
        outputs = pointwise.evaluate(z, iterate.parameters, fractions.ravel())
        motion = pointwise.derivatives(outputs).reshape(count, *fractions.shape)
        worth = along * (slopes - half * motion) @ weights
        signed[intervals] = worth.sum(axis=0)
        bound[intervals] = (np.abs(along * (slopes - half * motion)) @ weights).sum(axis=0)
    scale = solution.problem.objective_scale
    return GoalError(signed * scale, bound * scale)


def resisting(solution: Solution, tolerance: float) -> tuple[Resisting, ...]:
    """Return the mesh intervals whose state error is above a tolerance, in their order.

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """
    errors, bounds = solution.estimate.by_interval, goal_error(solution).bound
    ends = solution.mesh_points
    return tuple(
        Resisting(float(ends[k]), float(ends[k + 1]), float(errors[k]), float(bounds[k]))
        for k in np.flatnonzero(errors > tolerance)
    )
