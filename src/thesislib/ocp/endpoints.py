"""End cost and boundary conditions as scaled functions of the end values."""

from __future__ import annotations

import casadi as ca
import numpy as np

from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Ends, Point, ProblemError


class Endpoints:
    """Mayer cost and boundary conditions with their derivatives.

    Parameters
    ----------
    pointwise : Pointwise
        Brings the problem and the scales.

    Attributes
    ----------
    cost, conditions : casadi.Function
        Scaled end cost and scaled boundary conditions of (initial states, final states,
        parameters, constants).
    cost_gradient, conditions_jacobian, hessian : casadi.Function
        Derivatives with respect to (initial states, final states, parameters); the
        Hessian is that of (cost multiplier) * cost + (multipliers) · conditions.
    """

    def __init__(self, pointwise: Pointwise) -> None:
        problem, layout = pointwise.problem, pointwise.layout
        first, last = ca.SX.sym("x0", layout.states), ca.SX.sym("xf", layout.states)
        p, c = ca.SX.sym("p", layout.parameters), ca.SX.sym("c", len(problem.constants))
        start, span = pointwise.range(p)
        shared = {parameter.name: p[i] * parameter.size for i, parameter in enumerate(problem.all_parameters)}
        shared |= {name: c[i] for i, name in enumerate(problem.constants)}

        def end(states: ca.SX, place: ca.SX | float) -> Point:
            values = {state.name: states[i] * state.size for i, state in enumerate(problem.states)}
            return Point(values | shared | {problem.independent.name: place})

        ends = Ends(end(first, start), end(last, start + span))
        cost = ca.SX(0) if problem.mayer is None else ca.SX(problem.mayer(ends)) / problem.objective_scale
        given = {} if problem.boundary_equations is None else dict(problem.boundary_equations(ends))
        wanted = [condition.name for condition in problem.boundary]
        if sorted(given) != sorted(wanted):
            raise ProblemError(
                f"boundary_equations of {problem.name!r} give {sorted(given)}, not {sorted(wanted)}"
            )
        self.scale = np.array([condition.size for condition in problem.boundary])
        conditions = ca.SX(0, 1)
        if problem.boundary:
            conditions = ca.vertcat(*(given[b.name] / b.size for b in problem.boundary))
        unknowns = ca.vertcat(first, last, p)
        sigma, multipliers = ca.SX.sym("sigma"), ca.SX.sym("lam", conditions.numel())
        jacobian = ca.jacobian(conditions, unknowns)
        hessian = ca.triu(ca.hessian(sigma * cost + ca.dot(multipliers, conditions), unknowns)[0])
        gradient = ca.jacobian(cost, unknowns)
        arguments = [first, last, p, c]
        weights = [sigma, multipliers]
        self.cost = ca.Function("cost", arguments, [cost])
        self.conditions = ca.Function("conditions", arguments, [ca.densify(conditions)])
        self.cost_gradient = ca.Function("cost_gradient", arguments, [ca.densify(gradient)])
        self.conditions_jacobian = ca.Function("conditions_jacobian", arguments, [jacobian])
        self.hessian = ca.Function("hessian", [*arguments, *weights], [hessian])
        by_constants = ca.gradient(sigma * cost + ca.dot(multipliers, conditions), c)
        self.constants_gradient = ca.Function(
            "constants_gradient", [*arguments, *weights], [ca.densify(by_constants)]
        )
