"""The lap problem written down in `casadi.Opti`, as the tutorials of CasADi do it.

The statement of the problem (bounds, scales, equations) and the ends of the mesh intervals are the library's.
What makes a nonlinear programme of them stands here once more and shares nothing with `thesislib.ocp`:
collocation coefficients, one matrix of states and one of controls, a loop over the mesh intervals, one
constraint after another. CasADi differentiates what comes of it. It is a programme of the same variables,
bounds, constraints and objective as the library's, in another order, and so a check on it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np
from numpy.polynomial import legendre
from programmes import Solved, Stopwatch, solved
from scipy.interpolate import BarycentricInterpolator

from thesislib import ocp
from thesislib.ocp.iterate import Iterate

Array = np.ndarray


class Plain:
    """A periodic problem on a mesh as an optimisation problem of `casadi.Opti`.

    Parameters
    ----------
    problem : ocp.Problem
        The problem: all states periodic, no integral or boundary condition, like every lap.
    mesh : ocp.Mesh
        Where its intervals end, and how many Radau points each has.

    Raises
    ------
    ValueError
        If the problem has more than a lap has.
    """

    def __init__(self, problem: ocp.Problem, mesh: ocp.Mesh) -> None:
        if (
            set(problem.periodic) != {state.name for state in problem.states}
            or problem.integrals
            or problem.boundary
        ):
            raise ValueError(
                f"{problem.name!r} is no lap: not all of its states are periodic, or it has integral or "
                "boundary conditions."
            )
        self.problem, self.mesh = problem, mesh
        # what is held at zero is no variable here: the equations get a zero for it
        self.free = [q for q in problem.parameters if q.bounds[0] < q.bounds[1]]
        self.opti = ca.Opti()
        self.states = self.opti.variable(len(problem.states), mesh.points)
        self.controls = self.opti.variable(len(problem.controls), mesh.points)
        self.parameters = self.opti.variable(len(self.free)) if self.free else ca.MX(0, 1)
        self._constrain()

    def _constrain(self) -> None:
        problem, mesh, opti = self.problem, self.mesh, self.opti
        start, span = float(problem.independent.initial), float(problem.independent.final)
        span -= start
        orders = mesh.orders.tolist()
        coefficients = {order: coefficients_of(order) for order in set(orders)}
        intervals = list(zip(mesh.boundaries[:-1], mesh.widths, mesh.first.tolist(), orders, strict=True))
        fractions = np.concatenate([low + width * coefficients[n][0] for low, width, _, n in intervals])
        data = np.array([function(start + span * fractions) for function in problem.data.values()])
        everywhere = point_function(problem, self.free, span).map(mesh.points)
        slopes, path, integrand = everywhere(
            self.states, self.controls, ca.repmat(self.parameters, 1, mesh.points), data
        )
        objective = 0
        for _, width, first, order in intervals:
            _, differentiation, weights = coefficients[order]
            here, after = slice(first, first + order), (first + order) % mesh.points
            nodes = ca.horzcat(self.states[:, here], self.states[:, after])
            opti.subject_to(nodes @ (0.5 * differentiation.T) == 0.5 * width * slopes[:, here])
            objective += width * (integrand[:, here] @ weights)
        for row, constraint in enumerate(problem.path):
            low, high = (bound / constraint.size for bound in constraint.bounds)
            if low == high:
                opti.subject_to(path[row, :] == low)
            else:
                opti.subject_to(ca.vec(path[row, :]) <= high)
        gaps = np.diff(fractions, append=1.0 + fractions[0]) * span / problem.independent.scale
        for row, state in enumerate(problem.states):
            self._bound(self.states[row, :], state)
        for row, control in enumerate(problem.controls):
            self._bound(self.controls[row, :], control)
            ahead = ca.horzcat(self.controls[row, 1:], self.controls[row, 0])
            steps = ahead - self.controls[row, :]
            objective += 0.5 * control.rate_weight * (steps**2 @ (1.0 / gaps))
        for row, parameter in enumerate(self.free):
            self._bound(self.parameters[row], parameter)
        opti.minimize(objective)

    def _bound(self, variables: ca.MX, quantity: ocp.State | ocp.Control | ocp.Parameter) -> None:
        low, high = (bound / quantity.size for bound in quantity.bounds)
        self.opti.subject_to(self.opti.bounded(low, ca.vec(variables), high))

    def programme(self) -> ca.Function:
        """Return objective and constraints as a function of states, controls and free parameters."""
        arguments = [self.states, self.controls, *([self.parameters] if self.free else [])]
        return ca.Function("programme", arguments, [self.opti.f, self.opti.g])

    def solve(
        self,
        start: Iterate,
        options: Mapping[str, Any],
        *,
        expand: bool = False,
        multipliers: Array | None = None,
        watch: Stopwatch | None = None,
    ) -> Solved:
        """Solve from an iterate on the mesh.

        Parameters
        ----------
        start : Iterate
            Scaled values; its multipliers are not used.
        options : mapping
            Options of IPOPT, without a prefix.
        expand : bool
            Whether CasADi makes one graph of scalars of the whole programme before it differentiates.
        multipliers : ndarray, optional
            Those of an earlier solve of the same programme, for IPOPT's start with multipliers.
        watch : Stopwatch, optional
            Where the preparation begins; by default here.

        Returns
        -------
        Solved
        """
        watch, opti = watch or Stopwatch(), self.opti
        own = {"expand": expand, "detect_simple_bounds": True, "record_time": True, "print_time": False}
        opti.solver("ipopt", own, {"print_level": 0, "sb": "yes", **options})
        opti.set_initial(self.states, start.states[:, : self.mesh.points])
        opti.set_initial(self.controls, start.controls)
        names = [parameter.name for parameter in self.problem.parameters]
        places = [names.index(parameter.name) for parameter in self.free]
        if self.free:
            opti.set_initial(self.parameters, start.parameters[places])
        if multipliers is not None:
            opti.set_initial(opti.lam_g, multipliers)
        found = opti.solve_limited()
        seconds = watch.read()
        states = np.reshape(found.value(self.states), (-1, self.mesh.points))
        controls = np.reshape(found.value(self.controls), (-1, self.mesh.points))
        parameters = np.zeros(len(names))
        if self.free:
            parameters[places] = found.value(self.parameters)
        iterate = Iterate(self.mesh, np.column_stack((states, states[:, 0])), controls, parameters)
        objective, duals = float(found.value(opti.f)), np.array(found.value(opti.lam_g))
        return solved(found.stats(), iterate, objective, seconds, duals)


def with_opti(
    problem: ocp.Problem,
    start: Iterate,
    options: Mapping[str, Any],
    *,
    expand: bool = False,
    multipliers: Array | None = None,
) -> Solved:
    """Write a problem down on the start's mesh and solve it; arguments as of `Plain.solve`."""
    watch = Stopwatch()
    plain = Plain(problem, start.mesh)
    return plain.solve(start, options, expand=expand, multipliers=multipliers, watch=watch)


def coefficients_of(order: int) -> tuple[Array, Array, Array]:
    """Return Radau points with the start, slopes at them of the state's polynomial, and weights, on [0, 1].

    CasADi's own stop at nine points and have the end of the interval where these have the start: they come
    from NumPy's Legendre polynomials and SciPy's interpolation instead.

    Returns
    -------
    points : ndarray, shape (order,)
    differentiation : ndarray, shape (order, order + 1)
    weights : ndarray, shape (order,)
    """
    points = np.sort(np.real(legendre.legroots([0.0] * (order - 1) + [1.0, 1.0])))
    support = BarycentricInterpolator(np.append(points, 1.0), np.eye(order + 1))
    gauss, gauss_weights = legendre.leggauss(order)
    weights = gauss_weights @ BarycentricInterpolator(points, np.eye(order))(gauss)
    return 0.5 * (points + 1.0), 2.0 * support.derivative(points), 0.5 * weights


def point_function(problem: ocp.Problem, free: list[ocp.Parameter], span: float) -> ca.Function:
    """Return slopes, path expressions and integrand at one point, scaled; the car's numbers are constants."""
    x, u = ca.SX.sym("x", len(problem.states)), ca.SX.sym("u", len(problem.controls))
    p, w = ca.SX.sym("p", len(free)), ca.SX.sym("w", len(problem.data))
    values: dict[str, Any] = {q.name: 0.0 for q in problem.parameters} | dict(problem.constants)
    for quantities, symbols in ((problem.states, x), (problem.controls, u), (free, p)):
        values |= {q.name: symbols[row] * q.size for row, q in enumerate(quantities)}
    values |= {name: w[row] for row, name in enumerate(problem.data)}
    equations = problem.equations(ocp.Point(values))
    slopes = [span * equations.derivatives[q.name] / q.size for q in problem.states]
    path = [equations.path[q.name] / q.size for q in problem.path]
    integrand = span * equations.integrands[str(problem.lagrange)] / problem.objective_scale
    outputs = [ca.vertcat(*slopes), ca.vertcat(*path), integrand]
    return ca.Function("point", [x, u, p, w], [ca.densify(output) for output in outputs])
