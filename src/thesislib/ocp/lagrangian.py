"""The Lagrangian's multipliers and its explicit derivatives by constants and data, at a solution."""

from __future__ import annotations

import numpy as np

from thesislib.ocp.evaluation import end_values
from thesislib.ocp.iterate import pack
from thesislib.ocp.problem import ProblemError
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution
from thesislib.ocp.system import AnySolution, System, iterates_of, parts
from thesislib.ocp.transcription import Transcription


def joint_arguments(solution: AnySolution) -> tuple[Array, Array, float, Array]:
    """Return what the end functions of all phases read: ends, constants, weight of the cost, multipliers."""
    ends = np.concatenate([end_values(part.iterate) for part in parts(solution)])
    constants = np.concatenate([part.pointwise.constants for part in parts(solution)])
    return ends, constants, 1.0, iterates_of(solution).links


def joint_gradient(solution: AnySolution, system: System) -> Array:
    """Return the derivative of links and common cost by the constants of all phases, scaled."""
    if isinstance(solution, Solution):
        return np.zeros(len(solution.problem.constants))
    functions = system.joint[0]
    return np.array(functions.constants_gradient(*joint_arguments(solution))).ravel()


def row_multipliers(solution: Solution, transcription: Transcription) -> Array:
    """Return the multipliers of the constraints in the solver's sign."""
    multipliers = pack(solution.iterate, transcription)[2]
    if multipliers is None:
        raise ProblemError(f"the solution of {solution.problem.name!r} has no multipliers")
    return multipliers


def explicit_gradients(solution: Solution, transcription: Transcription, multipliers: Array) -> Array:
    """Return the Lagrangian's explicit derivatives, a row per constant and data function.

    Shape (n_constants + n_data, N): the share of every collocation point, in the scaled objective.
    """
    pointwise, mesh, iterate = solution.pointwise, solution.mesh, solution.iterate
    gradients = pointwise.gradients.map(mesh.points)(
        *pointwise.arguments(iterate.points, iterate.parameters, mesh.collocation),
        transcription.output_weights(multipliers),
    )
    return np.array(gradients)
