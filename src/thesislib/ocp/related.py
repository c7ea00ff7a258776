"""A start from the solution of a problem that has something less, or something more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from thesislib.ocp.iterate import Iterate, Multipliers, Scales, guessed
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import ProblemError
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution


@dataclass(frozen=True, eq=False)
class Related:
    """A solution of a related problem, to start from.

    What both problems have, by name, is taken over with its multipliers. What only the new problem has
    starts from `values`, or where they do not say from the middle of its bounds, without multipliers:
    a parameter that was fixed, a control that did not exist, a constraint that did not hold.

    Attributes
    ----------
    solution : Solution
        The solution of the related problem, over the same range.
    values : mapping
        Guesses as `solve` takes them; they go before the solution's.
    multipliers : bool
        Whether the multipliers are taken over.
    """

    solution: Solution
    values: Mapping[str, Any] = field(default_factory=dict)
    multipliers: bool = True


def taken_over(related: Related, pointwise: Pointwise, mesh: Mesh | None = None) -> Iterate:
    """Return the iterate with which a problem starts from the solution of a related one.

    Parameters
    ----------
    related : Related
        The solution, and what it does not know.
    pointwise : Pointwise
        Brings the problem and its scales.
    mesh : Mesh, optional
        Where to put it; by default on the solution's own mesh.

    Returns
    -------
    Iterate

    Raises
    ------
    ProblemError
        If the range or a unit differs, or a value is no guess of this problem.
    """
    theirs, ours = related.solution.problem, pointwise.problem
    ranges = [(problem.independent.initial, problem.independent.final) for problem in (theirs, ours)]
    if ranges[0] != ranges[1]:
        raise ProblemError(
            f"{theirs.name!r} cannot start {ours.name!r}: it runs over {ranges[0]}, not over {ranges[1]}"
        )
    shared = [name for name in ours.units if name in theirs.units and name not in related.values]
    for name in shared:
        if theirs.units[name] != ours.units[name]:
            raise ProblemError(
                f"{theirs.name!r} cannot start {ours.name!r}: {name} is in {theirs.units[name]} there "
                f"and in {ours.units[name]} here"
            )
    finer = mesh or related.solution.mesh
    old = related.solution.iterate.on(finer)
    known: dict[str, Any] = {}
    for name in shared:
        kind, index, quantity = related.solution.find(name)
        rows = {"state": old.states, "control": old.controls, "parameter": old.parameters}[kind]
        known[name] = rows[index] * quantity.size
    iterate = guessed(pointwise, finer, {**known, **related.values})
    if not related.multipliers or old.multipliers is None:
        return iterate
    carried = _carried(old.multipliers, related.solution.pointwise, pointwise, finer)
    return replace(iterate, multipliers=carried)


def _carried(old: Multipliers, theirs: Pointwise, ours: Pointwise, mesh: Mesh) -> Multipliers:
    """Return multipliers by name in the scales of another problem, zero where a name is new."""
    names, known = ours.problem.names, theirs.problem.names
    scale, size = Scales.of(ours), Scales.of(theirs)
    factor = size.objective / scale.objective

    def rows(values: Array, kinds: Sequence[str], mine: Array, their: Array) -> Array:
        wanted = [name for kind in kinds for name in names[kind]]
        given = [name for kind in kinds for name in known[kind]]
        taken = np.zeros((len(wanted), *values.shape[1:]))
        for place, name in enumerate(wanted):
            if name in given:
                source = given.index(name)
                taken[place] = values[source] * (factor * mine[place] / their[source])
        return taken

    both = (np.concatenate((one.states, one.controls)) for one in (scale, size))
    # what held a parameter in other bounds says nothing about these
    bounds = {q.name: q.bounds for q in theirs.problem.all_parameters}
    same = np.array([q.bounds == bounds.get(q.name) for q in ours.problem.all_parameters], dtype=bool)
    return Multipliers(
        costates=rows(old.costates, ["states"], scale.states, size.states),
        path=rows(old.path, ["path constraints"], scale.path, size.path),
        bounds=rows(old.bounds, ["states", "controls"], *both),
        left_out=rows(old.left_out, ["states"], scale.states, size.states),
        sums=rows(old.sums, ["integral constraints"], scale.integrals, size.integrals),
        boundary=rows(old.boundary, ["boundary conditions"], scale.boundary, size.boundary),
        parameters=rows(old.parameters, ["parameters"], scale.parameters, size.parameters) * same,
    )
