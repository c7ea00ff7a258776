"""What the calculus of variations asks at the ends of the range, and how well a solution meets it.

With the multipliers ν of the boundary conditions b and Φ the end cost, an optimum has at its ends

    λ(t_f) = ∂(Φ + ν·b)/∂x(t_f),     H(t_f) = -∂(Φ + ν·b)/∂t_f,
    λ(t_0) = -∂(Φ + ν·b)/∂x(t_0),    H(t_0) = ∂(Φ + ν·b)/∂t_0,

(2.95) and (2.94) and their twins at the start, where the end value is free; and a periodic state has a
costate that differs at the ends by these terms only. The costates that are compared are values of the
polynomials through the collocation points: the solver has made none of these equations hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from thesislib.ocp.endpoints import symbolic_ends
from thesislib.ocp.evaluation import end_values
from thesislib.ocp.iterate import Multipliers
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Ends, Point, interval
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution

# A bound whose multiplier is below this part of the costate does not hold an end value.
HELD = 1e-6


@dataclass(frozen=True)
class EndCondition:
    """One condition at an end.

    Attributes
    ----------
    name : str
        What is compared: `"costate v at the end"`, `"Hamiltonian at the end"`.
    value, expected : float
        Of the solution, and as the end cost and the boundary conditions ask.
    unit : str
        Unit of the quantity that the costate belongs to: the condition is in objective per this unit.
    """

    name: str
    value: float
    expected: float
    unit: str

    @property
    def difference(self) -> float:
        """The value less what is expected."""
        return self.value - self.expected


def transversality(solution: Solution) -> list[EndCondition]:
    """Return the conditions at the ends of a problem of one phase.

    Parameters
    ----------
    solution : Solution
        A solution with its multipliers.

    Returns
    -------
    list of EndCondition
        One for every end value of a state that is free there, every periodic state, and every free end
        of the independent variable that no bound holds.

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """
    return list(_conditions(solution, solution.multipliers))


def hamiltonian_at_ends(solution: Solution) -> tuple[float, float]:
    """Return the Hamiltonian at both ends, in units of the objective per unit of the independent variable.

    States, controls and costates are the values there of the polynomials of the first and the last
    interval. The regulariser's share is not in it.

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """
    multipliers = solution.multipliers
    pointwise, iterate, mesh = solution.pointwise, solution.iterate, solution.mesh
    ends = np.array([0.0, 1.0])
    z = np.vstack((iterate.states[:, [0, -1]], mesh.interpolate_controls(iterate.controls, ends)))
    outputs = pointwise.evaluate(z, iterate.parameters, ends)
    layout = pointwise.layout
    weights = [np.ones((1, 2))] if layout.has_lagrange else []
    weights.append(-multipliers.sums[:, [0, -1]])
    weights.append(_costates_at_ends(multipliers, mesh))
    total = (np.vstack(weights) * outputs[: layout.integrands + layout.states]).sum(axis=0)
    first, last = total * solution.problem.objective_scale / solution.span
    return float(first), float(last)


def _costates_at_ends(multipliers: Multipliers, mesh: Mesh) -> Array:
    """Return the scaled costates at both ends, from their polynomials, shape (n_x, 2)."""
    return mesh.interpolate_controls(multipliers.costates, np.array([0.0, 1.0]))


def _conditions(solution: Solution, multipliers: Multipliers) -> Iterator[EndCondition]:
    problem, pointwise, mesh = solution.problem, solution.pointwise, solution.mesh
    scale = problem.objective_scale
    by_state, by_independent = _end_gradients(pointwise, end_values(solution.iterate), multipliers)
    costates = _costates_at_ends(multipliers, mesh) * scale
    magnitude = np.abs(multipliers.costates).max(axis=1)
    forces = np.column_stack(
        (multipliers.bounds[: len(problem.states), 0] * mesh.weights[0], multipliers.left_out)
    )
    if not mesh.rule.start:
        last = multipliers.bounds[: len(problem.states), -1] * mesh.weights[-1]
        forces = np.column_stack((multipliers.left_out, last))
    for j, state in enumerate(problem.states):
        if state.name in problem.periodic:
            jump = (costates[j, 1] - costates[j, 0]) / state.size
            expected = (by_state[j, 0] + by_state[j, 1]) * scale / state.size
            name = f"costate {state.name} at the end less at the start"
            yield EndCondition(name, float(jump), float(expected), state.unit)
            continue
        for end, (where, values, sign) in enumerate(
            (("start", problem.initial, -1.0), ("end", problem.terminal, 1.0))
        ):
            low, high = interval(values[state.name]) if state.name in values else state.bounds
            if low == high or abs(forces[j, end]) > HELD * max(magnitude[j], HELD):
                continue
            value, expected = costates[j, end] / state.size, sign * by_state[j, end] * scale / state.size
            name = f"costate {state.name} at the {where}"
            yield EndCondition(name, float(value), float(expected), state.unit)
    hamiltonian = dict(zip(("initial", "final"), hamiltonian_at_ends(solution), strict=True))
    first = len(problem.parameters)
    for place, (free, parameter) in enumerate(problem.independent.free.items(), start=first):
        if abs(multipliers.parameters[place]) > HELD * max(1.0, abs(by_independent[free])):
            continue
        sign, where = (-1.0, "end") if free == "final" else (1.0, "start")
        asked = sign * by_independent[free] * scale
        yield EndCondition(f"Hamiltonian at the {where}", hamiltonian[free], asked, parameter.unit)


def _end_gradients(
    pointwise: Pointwise, ends: Array, multipliers: Multipliers
) -> tuple[Array, dict[str, float]]:
    """Return the derivatives of Φ + ν·b by the scaled states, (n_x, 2), and the independent variable."""
    problem, states = pointwise.problem, pointwise.layout.states
    symbols, constants, values = symbolic_ends(pointwise)
    places = {end: ca.SX.sym(end) for end in ("initial", "final")}
    name = problem.independent.name
    apart = Ends(*(Point({**getattr(values, end), name: places[end]}) for end in ("initial", "final")))
    total = ca.SX(0) if problem.mayer is None else ca.SX(problem.mayer(apart)) / problem.objective_scale
    if problem.boundary_equations is not None:
        given = problem.boundary_equations(apart)
        for condition, multiplier in zip(problem.boundary, multipliers.boundary, strict=False):
            total += multiplier * given[condition.name] / condition.size
    both = ca.vertcat(*places.values())
    gradient = ca.gradient(total, ca.vertcat(symbols, both))
    function = ca.Function("ends", [symbols, both, constants], [ca.densify(gradient)])
    start, span = pointwise.range(ends[2 * states :])
    found = np.array(function(ends, [start, start + span], pointwise.constants)).ravel()
    by_state = np.column_stack((found[:states], found[states : 2 * states]))
    return by_state, {"initial": float(found[-2]), "final": float(found[-1])}
