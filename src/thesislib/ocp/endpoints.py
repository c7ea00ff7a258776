"""End costs and end conditions as scaled functions of the end values, of one phase or of several."""

from __future__ import annotations

import casadi as ca

from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Ends, Point, ProblemError


class EndFunctions:
    """A cost and conditions of end values with their derivatives.

    Parameters
    ----------
    ends : casadi.SX, shape (n_e,)
        Scaled end values.
    constants : casadi.SX, shape (n_c,)
        Constants.
    cost : casadi.SX
        Scaled cost.
    conditions : casadi.SX, shape (n_b,)
        Scaled conditions.

    Attributes
    ----------
    cost, conditions : casadi.Function
        Of (ends, constants).
    cost_gradient, conditions_jacobian : casadi.Function
        Their derivatives with respect to the ends.
    hessian, constants_gradient : casadi.Function
        Of (ends, constants, cost multiplier, multipliers): upper triangle of the Hessian with respect
        to the ends, and gradient with respect to the constants, of the sum that the multipliers make.
    mixed : casadi.Function
        Of the same arguments: Jacobian of (conditions, gradient of that sum by the ends) by the constants.
    """

    def __init__(self, ends: ca.SX, constants: ca.SX, cost: ca.SX, conditions: ca.SX) -> None:
        sigma, multipliers = ca.SX.sym("sigma"), ca.SX.sym("lam", conditions.numel())
        total = sigma * cost + ca.dot(multipliers, conditions)
        arguments, weighted = [ends, constants], [ends, constants, sigma, multipliers]
        gradient = ca.gradient(total, ends)
        by_constants = ca.jacobian(ca.vertcat(conditions, gradient), constants)
        self.count = conditions.numel()
        self.cost = ca.Function("cost", arguments, [cost])
        self.conditions = ca.Function("conditions", arguments, [ca.densify(conditions)])
        self.cost_gradient = ca.Function("cost_gradient", arguments, [ca.densify(ca.gradient(cost, ends))])
        self.conditions_jacobian = ca.Function(
            "conditions_jacobian", arguments, [ca.jacobian(conditions, ends)]
        )
        self.hessian = ca.Function("hessian", weighted, [ca.triu(ca.hessian(total, ends)[0])])
        self.constants_gradient = ca.Function(
            "constants_gradient", weighted, [ca.densify(ca.gradient(total, constants))]
        )
        self.mixed = ca.Function("mixed", weighted, [ca.densify(by_constants)])


class Endpoints(EndFunctions):
    """Mayer cost and boundary conditions of one problem.

    The ends are (initial states, final states, parameters).

    Parameters
    ----------
    pointwise : Pointwise
        Brings the problem and the scales.

    Raises
    ------
    ProblemError
        If the boundary equations give other conditions than the problem names.
    """

    def __init__(self, pointwise: Pointwise) -> None:
        problem = pointwise.problem
        symbols, constants, ends = symbolic_ends(pointwise)
        cost = ca.SX(0) if problem.mayer is None else ca.SX(problem.mayer(ends)) / problem.objective_scale
        given = {} if problem.boundary_equations is None else dict(problem.boundary_equations(ends))
        wanted = [condition.name for condition in problem.boundary]
        if sorted(given) != sorted(wanted):
            raise ProblemError(
                f"boundary_equations of {problem.name!r} give {sorted(given)}, not {sorted(wanted)}"
            )
        rows = [given[condition.name] / condition.size for condition in problem.boundary]
        if len(problem.conditions) > len(problem.boundary):
            name = problem.independent.name
            rows.append((ends.final[name] - ends.initial[name]) / problem.conditions[-1].size)
        conditions = ca.vertcat(*rows) if rows else ca.SX(0, 1)
        super().__init__(symbols, constants, cost, conditions)


def symbolic_ends(pointwise: Pointwise) -> tuple[ca.SX, ca.SX, Ends]:
    """Return scaled end values and constants of a problem as symbols, and the `Ends` they make.

    Returns
    -------
    ends : casadi.SX
        Initial states, final states and parameters, scaled.
    constants : casadi.SX
    values : Ends
        The same in physical units, by name.
    """
    problem, layout = pointwise.problem, pointwise.layout
    first, last = ca.SX.sym("x0", layout.states), ca.SX.sym("xf", layout.states)
    p, c = ca.SX.sym("p", layout.parameters), ca.SX.sym("c", len(problem.constants))
    start, span = pointwise.range(p)
    shared = {parameter.name: p[i] * parameter.size for i, parameter in enumerate(problem.all_parameters)}
    shared |= {name: c[i] for i, name in enumerate(problem.constants)}

    def end(states: ca.SX, place: ca.SX | float) -> Point:
        values = {state.name: states[i] * state.size for i, state in enumerate(problem.states)}
        return Point(values | shared | {problem.independent.name: place})

    return ca.vertcat(first, last, p), c, Ends(end(first, start), end(last, start + span))
