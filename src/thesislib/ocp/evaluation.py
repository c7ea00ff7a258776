"""What an iterate amounts to on its mesh: objective, integrals, defects; and a solution on another mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.iterate import Iterate
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import ProblemError, unknown
from thesislib.ocp.quadrature import Array
from thesislib.ocp.refinement import error_estimate
from thesislib.ocp.solution import Solution


def end_values(iterate: Iterate) -> Array:
    """Return the scaled end values that the end functions read, shape (2 n_x + n_p,)."""
    return np.concatenate((iterate.states[:, 0], iterate.states[:, -1], iterate.parameters))


def objective(pointwise: Pointwise, endpoints: Endpoints, iterate: Iterate) -> float:
    """Return the objective of an iterate without the regulariser, in its own unit."""
    total = float(endpoints.cost(end_values(iterate), pointwise.constants))
    if pointwise.layout.has_lagrange:
        outputs = pointwise.evaluate(iterate.points, iterate.parameters, iterate.mesh.collocation)
        total += float(iterate.mesh.weights @ outputs[0])
    return total * pointwise.problem.objective_scale


def integral(solution: Solution, name: str) -> float:
    """Return an integral of a solution, (2.155), in its unit.

    Parameters
    ----------
    solution : Solution
        The solution.
    name : str
        An integral constraint, or the integrand that is minimised.

    Raises
    ------
    ProblemError
        If the problem has no such integral.
    """
    pointwise, problem, iterate = solution.pointwise, solution.problem, solution.iterate
    names = [constraint.name for constraint in problem.integrals]
    sizes = [constraint.size for constraint in problem.integrals]
    if problem.lagrange is not None:
        names, sizes = [problem.lagrange, *names], [problem.objective_scale, *sizes]
    if name not in names:
        raise ProblemError(unknown("integral", name, names))
    outputs = pointwise.evaluate(iterate.points, iterate.parameters, iterate.mesh.collocation)
    # a name that is minimised and bounded is the same integrand twice
    row = names.index(name)
    return float(iterate.mesh.weights @ outputs[row]) * sizes[row]


def defects(solution: Solution) -> dict[str, Array]:
    """Return the defects of the collocated equations (2.147), interval by interval.

    Returns
    -------
    dict of str to ndarray, shape (K,)
        By state, the largest magnitude in every mesh interval, in units of the state: the miss over
        half an interval if the slope were wrong by this much all along it.
    """
    pointwise, iterate, mesh = solution.pointwise, solution.iterate, solution.mesh
    outputs = pointwise.evaluate(iterate.points, iterate.parameters, mesh.collocation)
    slopes = pointwise.derivatives(outputs)
    found = np.empty((pointwise.layout.states, mesh.intervals))
    for order, intervals in mesh.by_order():
        nodes = iterate.states[:, mesh.first[intervals][:, None] + np.arange(order + 1)]
        ours = slopes[:, mesh.first[intervals][:, None] + np.arange(order)]
        half = 0.5 * mesh.widths[intervals][:, None]
        miss = np.abs(nodes @ mesh.rule.differentiation(order).T - half * ours)
        found[:, intervals] = miss.max(axis=2)
    return {state.name: row * state.size for state, row in zip(solution.problem.states, found, strict=True)}


def resampled(solution: Solution, mesh: Mesh) -> Solution:
    """Return a solution carried to another mesh: states, controls, parameters and all multipliers.

    Objective, integrals and error estimate are those of the carried values, which solve nothing: the
    result is marked as not converged. It is a picture, or a start for another solve.
    """
    pointwise, iterate = solution.pointwise, solution.iterate.on(mesh)
    estimate = error_estimate(pointwise, mesh, iterate.states, iterate.controls, iterate.parameters)
    return replace(
        solution,
        iterate=iterate,
        objective=objective(pointwise, Endpoints(pointwise), iterate),
        estimate=estimate,
        converged=False,
        stopped="carried to another mesh, not solved there",
    )
