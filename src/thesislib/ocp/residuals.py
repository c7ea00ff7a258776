"""Residuals with names: which equation, which mesh interval, which place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from thesislib.ocp.phased import PhasedSolution
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution
from thesislib.ocp.system import AnySolution, System, iterates_of, parts
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
    limit : str
        Of a bound, which one: `"above 560 kW"`.
    """

    equation: str
    interval: int | None
    place: str
    amount: float
    unit: str
    scaled: float
    limit: str = ""

    def __str__(self) -> str:
        where = f"interval {self.interval}, " if self.interval is not None else ""
        limit = f" {self.limit}" if self.limit else ""
        return f"{self.equation}, {where}{self.place}: {self.amount:.3g} {self.unit}{limit}"


def residuals(solution: AnySolution) -> list[Residual]:
    """Return the worst violation of every equation and every bound.

    A defect is reported as the miss of the state over its interval, in units of the state.
    """
    collocated = System.solved(solution).collocated(iterates_of(solution).meshes)
    programme, iterates = collocated.programme, iterates_of(solution)
    x = collocated.pack(iterates)[0]
    g = np.array(programme.derivatives["jac_g"](x, collocated.parameters(iterates))[0]).ravel()
    rows = (g, programme.rows_lower, programme.rows_upper)
    bounds = (x, programme.lower, programme.upper)
    found = []
    for part, transcription, a, c in zip(
        parts(solution), collocated.transcriptions, collocated.variables, collocated.rows, strict=False
    ):
        prefix = f"{part.problem.name}: " if isinstance(solution, PhasedSolution) else ""
        ours = _cut(rows, c, transcription.rows), _cut(bounds, a, transcription.variables)
        found += list(_of_phase(part, transcription, *ours, prefix))
    if isinstance(solution, PhasedSolution):
        for row, link in enumerate(solution.problem.links, start=int(collocated.rows[-1])):
            value, side = _violation(*_cut(rows, row, 1))
            limit = _limit(side[0], link.bounds, link.unit)
            amount = float(value[0])
            found.append(
                Residual(f"link {link.name}", None, "ends", amount * link.size, link.unit, amount, limit)
            )
    return found


Triple = tuple[Array, Array, Array]


def _cut(values: Triple, first: int, count: int) -> Triple:
    value, lower, upper = (part[first : first + count] for part in values)
    return value, lower, upper


def _of_phase(
    solution: Solution, transcription: Transcription, rows: Triple, bounds: Triple, prefix: str
) -> Iterator[Residual]:
    """Yield the worst violation of every equation and bound of one phase."""
    problem, mesh = solution.problem, solution.mesh
    places, unit = solution.points, problem.independent.unit
    row_misses, row_sides = _violation(*rows)
    bound_misses, bound_sides = _violation(*bounds)

    def worst(
        label: str, misses: Array, sides: Array, size: float, of: str, limits: tuple[float, float] | None
    ) -> Residual:
        at = int(np.nanargmax(np.where(np.isnan(misses), np.inf, misses)))
        place = f"{problem.independent.name} = {places[at]:.1f} {unit}"
        limit = "" if limits is None else _limit(sides[at], limits, of)
        miss = float(misses[at])
        return Residual(prefix + label, int(mesh.interval[at]), place, miss * size, of, miss, limit)

    for state, index in zip(problem.states, transcription.defect_rows, strict=True):
        label = f"defect of {state.name}"
        yield worst(label, row_misses[index], row_sides[index], state.size, state.unit, None)
    for constraint, index in zip(problem.path, transcription.path_rows, strict=True):
        label, of = f"path constraint {constraint.name}", constraint.unit
        yield worst(label, row_misses[index], row_sides[index], constraint.size, of, constraint.bounds)
    quantities = (*problem.states, *problem.controls)
    for quantity, index in zip(quantities, transcription.point_index, strict=True):
        label, of = f"bound of {quantity.name}", quantity.unit
        yield worst(label, bound_misses[index], bound_sides[index], quantity.size, of, quantity.bounds)
    for parameter, at in zip(problem.all_parameters, transcription.parameter_index, strict=True):
        miss, limit = float(bound_misses[at]), _limit(bound_sides[at], parameter.bounds, parameter.unit)
        label, size = f"{prefix}bound of {parameter.name}", parameter.size
        yield Residual(label, None, "whole range", miss * size, parameter.unit, miss, limit)
    for integral, index in zip(problem.integrals, transcription.sum_rows, strict=True):
        total = float(row_misses[index].sum())
        label = f"{prefix}integral {integral.name}"
        yield Residual(label, None, "whole range", total * integral.size, integral.unit, total)
    for integral, at in zip(problem.integrals, transcription.sum_index[:, -1], strict=True):
        miss, limit = float(bound_misses[at]), _limit(bound_sides[at], integral.bounds, integral.unit)
        label = f"{prefix}bound of integral {integral.name}"
        yield Residual(label, None, "whole range", miss * integral.size, integral.unit, miss, limit)
    for condition, row in zip(problem.conditions, transcription.boundary_rows, strict=True):
        miss, limit = float(row_misses[row]), _limit(row_sides[row], condition.bounds, condition.unit)
        label = f"{prefix}boundary condition {condition.name}"
        yield Residual(label, None, "ends", miss * condition.size, condition.unit, miss, limit)


def undefined(solution: AnySolution) -> str | None:
    """Say which equation, or which derivative of one, has no finite value first along the range.

    Parameters
    ----------
    solution : Solution or PhasedSolution
        Usually one at which the solver met such a number.

    Returns
    -------
    str or None
        None where all are finite.
    """
    for part in parts(solution):
        said = _undefined(part)
        if said:
            return f"{part.problem.name}: {said}" if isinstance(solution, PhasedSolution) else said
    return None


def _undefined(solution: Solution) -> str | None:
    pointwise, problem, iterate = solution.pointwise, solution.problem, solution.iterate
    z = iterate.points
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


def worst_error(solution: AnySolution) -> Residual:
    """Return the state and place at which the error estimate is largest."""
    part = max(parts(solution), key=lambda phase: phase.error)
    problem, errors = part.problem, part.estimate
    state, interval = divmod(int(errors.by_state.argmax()), part.mesh.intervals)
    place = float(part.places(errors.place[state, interval]))
    error = float(errors.by_state[state, interval])
    where = f"{problem.independent.name} = {place:.1f} {problem.independent.unit}"
    prefix = f"{problem.name}: " if isinstance(solution, PhasedSolution) else ""
    return Residual(f"{prefix}state {problem.states[state].name}", interval, where, error, "relative", error)


def _violation(values: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return by how much bounds are violated, and on which side: -1 below, 1 above."""
    below, above = lower - values, values - upper
    return np.maximum(np.maximum(below, above), 0.0), np.where(above >= below, 1, -1)


def _limit(side: int, bounds: tuple[float, float], unit: str) -> str:
    """Say which bound is violated; an equation with zero has none to name."""
    if bounds == (0.0, 0.0):
        return ""
    return f"above {bounds[1]:g} {unit}" if side > 0 else f"below {bounds[0]:g} {unit}"
