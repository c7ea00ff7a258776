"""How the optimum changes with the numbers and functions of a problem, from one solve.

At an optimum the first change of the objective is the explicit derivative of the Lagrangian: what
the variables would change cancels, because the Lagrangian is stationary in them. The multipliers of
one solve therefore give the derivative with respect to everything the equations read. What the
variables do change is one further solve of linear equations: `derivative`.

The objective that is differentiated is the one that was minimised: the regulariser (2.171) is part
of it. `derivative` tells its share.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from thesislib.ocp.derivatives import Derivative, Derivatives
from thesislib.ocp.evaluation import end_values
from thesislib.ocp.lagrangian import explicit_gradients, joint_gradient, row_multipliers
from thesislib.ocp.problem import ProblemError, unknown
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution
from thesislib.ocp.system import AnySolution, System, iterates_of, parts


def sensitivity(solution: AnySolution) -> dict[str, float]:
    """Return the derivative of the minimised objective with respect to every constant.

    Parameters
    ----------
    solution : Solution or PhasedSolution
        An optimum with its multipliers.

    Returns
    -------
    dict
        By name of the constant, in units of the objective per unit of the constant. The regulariser
        is part of the objective. A constant of several phases changes in all of them.

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """
    system = System.solved(solution)
    collocated = system.collocated(iterates_of(solution).meshes)
    totals: dict[str, float] = {}
    at_joint = joint_gradient(solution, system)
    for part, transcription in zip(parts(solution), collocated.transcriptions, strict=True):
        multipliers = row_multipliers(part, transcription)
        names = list(part.problem.constants)
        along = explicit_gradients(part, transcription, multipliers)[: len(names)].sum(axis=1)
        at_ends = transcription.endpoints.constants_gradient(
            end_values(part.iterate), part.pointwise.constants, 1.0, multipliers[transcription.boundary_rows]
        )
        mine, at_joint = at_joint[: len(names)], at_joint[len(names) :]
        total = (along + np.array(at_ends).ravel() + mine) * part.problem.objective_scale
        for name, value in zip(names, total, strict=True):
            totals[name] = totals.get(name, 0.0) + float(value)
    return totals


def density(solution: Solution, name: str) -> Array:
    """Return the derivative of the minimised objective with respect to a data function.

    A small change δw(s) of the data changes the objective by ∫ density(s) δw(s) ds, which the
    solution's own quadrature gives as `solution.weights @ (density * change)`.

    Parameters
    ----------
    solution : Solution
        An optimum with its multipliers.
    name : str
        A data function of the problem.

    Returns
    -------
    ndarray, shape (N,)
        At the collocation points, in units of the objective per unit of the data and of the
        independent variable. The regulariser is part of the objective.

    Raises
    ------
    ProblemError
        If the problem has no such data or the solution has no multipliers.
    """
    return _density(solution, len(solution.problem.constants) + _data_index(solution, name))


def constant_density(solution: Solution, name: str) -> Array:
    """Return where along the range a constant acts on the minimised objective.

    Parameters
    ----------
    solution : Solution
        An optimum with its multipliers.
    name : str
        A constant of the problem.

    Returns
    -------
    ndarray, shape (N,)
        At the collocation points; its integral, `solution.weights @ density`, is the derivative that
        `sensitivity` returns, but for what the constant does in end costs and boundary conditions.

    Raises
    ------
    ProblemError
        If the problem has no such constant or the solution has no multipliers.
    """
    names = list(solution.problem.constants)
    if name not in names:
        raise ProblemError(unknown("constant", name, names))
    return _density(solution, names.index(name))


def derivative(
    solution: AnySolution, name: str, change: Array | Callable[[Array], Array] | None = None
) -> Derivative:
    """Return the derivative of a solution with respect to a constant, or to data in a direction.

    For one derivative; several of one solution share their factorisation as `Derivatives`, whose `by`
    has these arguments.
    """
    return Derivatives(solution).by(name, change)


def _density(solution: Solution, row: int) -> Array:
    """Return the derivative of the minimised objective by one of (constants, data), as a density."""
    transcription = System.solved(solution).collocated([solution.mesh]).transcriptions[0]
    gradient = explicit_gradients(solution, transcription, row_multipliers(solution, transcription))[row]
    return np.asarray(gradient * solution.problem.objective_scale / solution.weights)


def _data_index(solution: Solution, name: str) -> int:
    data = list(solution.problem.data)
    if name not in data:
        known = ", ".join(data) or "none"
        raise ProblemError(f"{solution.problem.name!r} reads no data named {name!r}; known: {known}")
    return data.index(name)
