"""How the optimum changes with the numbers and functions of a problem, from one solve.

At an optimum the first change of the objective is the explicit derivative of the Lagrangian: what
the variables would change cancels, because the Lagrangian is stationary in them. The multipliers of
one solve therefore give the derivative with respect to everything the equations read.

The objective that is differentiated is the one that was minimised: the regulariser (2.171) is part
of it. Where its share is small and hardly changes, so is the difference to the plain objective.
"""

from __future__ import annotations

import numpy as np

from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.iterate import pack
from thesislib.ocp.problem import ProblemError
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution
from thesislib.ocp.transcription import Transcription


def sensitivity(solution: Solution) -> dict[str, float]:
    """Return the derivative of the minimised objective with respect to every constant.

    Parameters
    ----------
    solution : Solution
        An optimum with its multipliers.

    Returns
    -------
    dict
        By name of the constant, in units of the objective per unit of the constant. The regulariser
        is part of the objective.

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """
    pointwise, problem = solution.pointwise, solution.problem
    transcription, multipliers = _multipliers(solution)
    iterate = solution.iterate
    along = _gradients(solution, transcription, multipliers)[: len(problem.constants)].sum(axis=1)
    at_ends = transcription.endpoints.constants_gradient(
        np.concatenate((iterate.states[:, 0], iterate.states[:, -1], iterate.parameters)),
        pointwise.constants,
        1.0,
        multipliers[transcription.boundary_rows],
    )
    total = (along + np.array(at_ends).ravel()) * problem.objective_scale
    return {name: float(value) for name, value in zip(problem.constants, total, strict=True)}


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
    problem = solution.problem
    if name not in problem.data:
        known = ", ".join(problem.data) or "none"
        raise ProblemError(f"{problem.name!r} reads no data named {name!r}; known: {known}")
    transcription, multipliers = _multipliers(solution)
    row = len(problem.constants) + list(problem.data).index(name)
    gradient = _gradients(solution, transcription, multipliers)[row]
    return np.asarray(gradient * problem.objective_scale / solution.weights)


def _multipliers(solution: Solution) -> tuple[Transcription, Array]:
    """Return where the constraints stand, and their multipliers in the solver's sign."""
    pointwise = solution.pointwise
    transcription = Transcription(pointwise, Endpoints(pointwise), solution.mesh)
    multipliers = pack(solution.iterate, transcription)[2]
    if multipliers is None:
        raise ProblemError(f"the solution of {solution.problem.name!r} has no multipliers")
    return transcription, multipliers


def _gradients(solution: Solution, transcription: Transcription, multipliers: Array) -> Array:
    """Return the Lagrangian's explicit derivatives, a row per constant and data function.

    Shape (n_constants + n_data, N): the share of every collocation point, in the scaled objective.
    """
    pointwise, mesh, iterate = solution.pointwise, solution.mesh, solution.iterate
    gradients = pointwise.gradients.map(mesh.points)(
        *pointwise.arguments(iterate.points, iterate.parameters, mesh.collocation),
        transcription.output_weights(multipliers),
    )
    return np.array(gradients)
