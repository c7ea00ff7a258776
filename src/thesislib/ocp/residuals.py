"""Residuals with names: which equation, which mesh interval, which place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.iterate import pack
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution
from thesislib.ocp.transcription import Transcription


@dataclass(frozen=True)
class Residual:
    """One violated condition.

    Attributes
    ----------
    equation : str
        What is violated.
    interval : int or None
        Mesh interval, counted from 0; None at the ends.
    place : str
        Value of the independent variable, with unit.
    amount : float
        By how much, in `unit`.
    unit : str
        Unit of the amount.
    scaled : float
        The violation as the solver sees it.
    """

    equation: str
    interval: int | None
    place: str
    amount: float
    unit: str
    scaled: float

    def __str__(self) -> str:
        where = f"interval {self.interval}, " if self.interval is not None else ""
        return f"{self.equation}, {where}{self.place}: {self.amount:.3g} {self.unit}"


def worst_residual(solution: Solution) -> Residual:
    """Return the constraint or bound that a solution violates most, in scaled size.

    Parameters
    ----------
    solution : Solution
        Usually one that did not converge.

    Returns
    -------
    Residual
    """
    return max(residuals(solution), key=lambda residual: residual.scaled)


def residuals(solution: Solution) -> list[Residual]:
    """Return the worst violation of every equation and every bound.

    A defect is reported as the miss of the state over its interval, in units of the state.
    """
    pointwise, problem, mesh = solution.pointwise, solution.problem, solution.mesh
    transcription = Transcription(pointwise, Endpoints(pointwise), mesh)
    programme = transcription.programme()
    x = pack(solution.iterate, transcription)[0]
    parameters = transcription.parameter_vector(solution.iterate.parameters)
    g = np.array(programme.derivatives["jac_g"](x, parameters)[0]).ravel()
    rows = _violation(g, programme.rows_lower, programme.rows_upper)
    bounds = _violation(x, programme.lower, programme.upper)
    places = solution.points
    unit = problem.independent.unit

    def worst(label: str, violations: Array, size: float, of: str) -> Residual:
        at = int(np.nanargmax(np.where(np.isnan(violations), np.inf, violations)))
        place = f"{problem.independent.name} = {places[at]:.1f} {unit}"
        return Residual(
            label, int(mesh.interval[at]), place, float(violations[at] * size), of, float(violations[at])
        )

    found = []
    for state, index in zip(problem.states, transcription.defect_rows, strict=True):
        found.append(worst(f"defect of {state.name}", rows[index], state.size, state.unit))
    for constraint, index in zip(problem.path, transcription.path_rows, strict=True):
        label = f"path constraint {constraint.name}"
        found.append(worst(label, rows[index], constraint.size, constraint.unit))
    for quantity, index in zip((*problem.states, *problem.controls), transcription.point_index, strict=True):
        found.append(worst(f"bound of {quantity.name}", bounds[index], quantity.size, quantity.unit))
    for integral, index in zip(problem.integrals, transcription.sum_rows, strict=True):
        total = float(rows[index].sum())
        found.append(
            Residual(
                f"integral {integral.name}", None, "whole range", total * integral.size, integral.unit, total
            )
        )
    for condition, row in zip(problem.boundary, transcription.boundary_rows, strict=True):
        size = float(rows[row])
        found.append(
            Residual(
                f"boundary condition {condition.name}",
                None,
                "ends",
                size * condition.size,
                condition.unit,
                size,
            )
        )
    return found


def undefined(solution: Solution) -> str | None:
    """Say which equation, or which derivative of one, has no finite value first along the range.

    Parameters
    ----------
    solution : Solution
        Usually one at which the solver met such a number.

    Returns
    -------
    str or None
        None where all are finite.
    """
    pointwise, problem, iterate = solution.pointwise, solution.problem, solution.iterate
    z = np.vstack((iterate.states[:, :-1], iterate.controls))
    arguments = pointwise.arguments(z, iterate.parameters, solution.mesh.collocation)
    unknowns = [q.name for q in (*problem.states, *problem.controls, *problem.all_parameters)]
    labels = list(pointwise.output_names)
    for output, unknown in zip(*pointwise.jacobian_sparsity.get_triplet(), strict=True):
        labels.append(f"{pointwise.output_names[output]}, derived by {unknowns[unknown]},")
    numbers = np.vstack(
        [
            np.array(function.map(z.shape[1])(*arguments))
            for function in (pointwise.values, pointwise.jacobian)
        ]
    )
    for point, column in enumerate(numbers.T):
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            place = f"{problem.independent.name} = {solution.points[point]:g} {problem.independent.unit}"
            interval = int(solution.mesh.interval[point])
            return f"{labels[bad[0]]} is {column[bad[0]]} in interval {interval}, {place}"
    return None


def worst_error(solution: Solution) -> Residual:
    """Return the state and place at which the error estimate is largest."""
    problem, errors = solution.problem, solution.estimate
    state, interval = divmod(int(errors.by_state.argmax()), solution.mesh.intervals)
    place = float(solution.places(errors.place[state, interval]))
    error = float(errors.by_state[state, interval])
    where = f"{problem.independent.name} = {place:.1f} {problem.independent.unit}"
    return Residual(f"state {problem.states[state].name}", interval, where, error, "relative", error)


def _violation(values: Array, lower: Array, upper: Array) -> Array:
    return np.maximum(np.maximum(lower - values, values - upper), 0.0)
