"""From an optimal control problem and a mesh to a sparse nonlinear programme.

The differential form (2.147) of multi-interval Radau collocation. The Jacobian and the
Hessian are constant sparse matrices times the nonzeros of the point functions: assembling
them by hand is what makes the evaluation linear in the number of points, with a small
constant. An integral constraint is a chain of per-interval partial sums, never one dense
row, which would defeat sparse differentiation and the factorisation alike.
"""

from __future__ import annotations

from functools import cached_property

import casadi as ca
import numpy as np
import scipy.sparse as sp

from thesislib.ocp.assembly import assemble, selection, stored
from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Quantity, interval
from thesislib.ocp.programme import Programme, end_hessian_part, end_jacobian_part, functions
from thesislib.ocp.quadrature import Array
from thesislib.ocp.regularisation import rate_penalty


class Transcription:
    """Variables, constraints and their places for one problem on one mesh.

    Parameters
    ----------
    pointwise : Pointwise
        The problem's scaled point functions.
    endpoints : Endpoints
        Its scaled end functions.
    mesh : Mesh
        The mesh.

    Notes
    -----
    Variables are ordered point by point (states, then controls), then the states that are not
    periodic at the end which the points leave out, the partial sums of the integrals and the parameters.
    Constraints: defects point by point, path constraints point by point, partial sums,
    boundary conditions. A periodic state has one variable for both ends, so that (4.29)
    needs no constraint.
    """

    def __init__(self, pointwise: Pointwise, endpoints: Endpoints, mesh: Mesh) -> None:
        self.pointwise, self.endpoints, self.mesh = pointwise, endpoints, mesh
        problem, layout = pointwise.problem, pointwise.layout
        points, size = mesh.points, layout.variables
        self.point_index = np.arange(points * size).reshape(points, size).T
        self.wrapped = np.array([state.name in problem.periodic for state in problem.states])
        at_points = self.point_index[: layout.states]
        # the end that the points leave out; a periodic state has the variable of the other end there
        other = at_points[:, 0] if mesh.rule.start else at_points[:, -1]
        self.left_out = np.where(self.wrapped, other, points * size + np.cumsum(~self.wrapped) - 1)
        nodes = (at_points, self.left_out) if mesh.rule.start else (self.left_out, at_points)
        self.node_index = np.column_stack(nodes)
        offset = points * size + int((~self.wrapped).sum())
        integrals = len(problem.integrals)
        self.sum_index = offset + np.arange(integrals * mesh.intervals).reshape(mesh.intervals, integrals).T
        offset += integrals * mesh.intervals
        self.parameter_index = offset + np.arange(layout.parameters)
        self.variables = offset + layout.parameters
        self.defect_rows = np.arange(points * layout.states).reshape(points, layout.states).T
        start = points * layout.states
        self.path_rows = start + np.arange(points * layout.path).reshape(points, layout.path).T
        start += points * layout.path
        self.sum_rows = start + np.arange(integrals * mesh.intervals).reshape(mesh.intervals, integrals).T
        start += integrals * mesh.intervals
        self.boundary_rows = start + np.arange(len(problem.conditions))
        self.rows = start + len(problem.conditions)
        self.penalty = rate_penalty(pointwise, mesh, self.point_index, self.variables)

    @property
    def end_index(self) -> np.ndarray:
        """Variables the end functions read: initial states, final states, parameters."""
        return np.concatenate((self.node_index[:, 0], self.node_index[:, -1], self.parameter_index))

    @cached_property
    def differentiation(self) -> sp.csr_array:
        """Differentiation matrices of all intervals, shape (N, N + 1)."""
        rows, columns, values = [], [], []
        for order, intervals in self.mesh.by_order():
            matrix = self.mesh.rule.differentiation(order)
            first = self.mesh.first[intervals][:, None, None]
            i, j = np.meshgrid(np.arange(order), np.arange(order + 1), indexing="ij")
            rows.append((first + i).ravel())
            columns.append((first + j).ravel())
            values.append(np.tile(matrix.ravel(), len(intervals)))
        coordinates = (np.concatenate(rows), np.concatenate(columns))
        shape = (self.mesh.points, self.mesh.points + 1)
        return sp.csr_array((np.concatenate(values), coordinates), shape=shape)

    def output_weights(self, multipliers: Array, objective: float = 1.0) -> Array:
        """Return the weight every point output has in the Lagrangian.

        Parameters
        ----------
        multipliers : ndarray, shape (rows,)
            Multipliers of the constraints, CasADi's sign.
        objective : float
            Multiplier of the objective.

        Returns
        -------
        ndarray, shape (n_outputs, N)
        """
        layout, mesh = self.pointwise.layout, self.mesh
        parts = [np.full((1, mesh.points), objective) * mesh.weights] if layout.has_lagrange else []
        parts.append(-multipliers[self.sum_rows][:, mesh.interval] * mesh.weights)
        parts.append(-multipliers[self.defect_rows] * mesh.half_widths)
        parts.append(multipliers[self.path_rows])
        return np.vstack(parts)

    def programme(self) -> Programme:
        """Return the nonlinear programme."""
        lower, upper = self._variable_bounds()
        rows_lower, rows_upper = self._row_bounds()
        x = ca.MX.sym("x", self.variables)
        layout, mesh = self.pointwise.layout, self.mesh
        constants, data = len(self.pointwise.constants), len(self.pointwise.problem.data)
        p = ca.MX.sym("p", constants + data * mesh.points)
        z = ca.reshape(x[: mesh.points * layout.variables], layout.variables, mesh.points)
        point = [
            z,
            ca.repmat(x[self.parameter_index.tolist()], 1, mesh.points),
            ca.repmat(p[:constants], 1, mesh.points),
            ca.reshape(p[constants:], data, mesh.points),
            ca.MX(mesh.collocation[None, :]),
        ]
        ends = [x[self.end_index.tolist()], p[:constants]]
        penalty = ca.DM(self.penalty)
        outputs = self.pointwise.values.map(mesh.points)(*point)
        f = self.endpoints.cost(*ends) + 0.5 * ca.dot(x, ca.mtimes(penalty, x))
        if layout.has_lagrange:
            f += ca.mtimes(outputs[0, :], ca.DM(mesh.weights))
        g = self._constraints(x, outputs, ends)
        gradient, jacobian = self._first_derivatives(x, point, ends, penalty)
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.rows)
        hessian = self._hessian(point, ends, lam_f, lam_g)
        derivatives = functions(x, p, (f, gradient, g, jacobian), (lam_f, lam_g, hessian))
        nlp = {"x": x, "p": p, "f": f, "g": g}
        return Programme(nlp, derivatives, lower, upper, rows_lower, rows_upper)

    def parameter_vector(self, scaled_parameters: Array) -> Array:
        """Return the programme's parameters: constants, then the data at the points."""
        data = self.pointwise.data(self.mesh.collocation, scaled_parameters)
        return np.concatenate((self.pointwise.constants, data.T.ravel()))

    def _constraints(self, x: ca.MX, outputs: ca.MX, ends: list[ca.MX]) -> ca.MX:
        layout, mesh = self.pointwise.layout, self.mesh
        first = layout.integrands
        nodes = ca.reshape(x[self.node_index.T.ravel().tolist()], layout.states, mesh.points + 1)
        slopes = ca.mtimes(nodes, ca.DM(self.differentiation.T.tocsc()))
        half = ca.repmat(ca.DM(mesh.half_widths).T, layout.states, 1)
        defects = slopes - half * outputs[first : first + layout.states, :]
        sums = ca.MX(0, 1)
        if self.sum_rows.size:
            gather = sp.csc_array(
                (mesh.weights, (np.arange(mesh.points), mesh.interval)), shape=(mesh.points, mesh.intervals)
            )
            totals = ca.reshape(x[self.sum_index.T.ravel().tolist()], self.sum_index.shape[0], mesh.intervals)
            before = ca.horzcat(ca.MX.zeros(self.sum_index.shape[0], 1), totals[:, :-1])
            gained = ca.mtimes(outputs[int(layout.has_lagrange) : first, :], ca.DM(gather))
            sums = ca.vec(totals - before - gained)
        path = ca.vec(outputs[first + layout.states :, :])
        return ca.densify(ca.vertcat(ca.vec(defects), path, sums, self.endpoints.conditions(*ends)))

    def output_places(self) -> tuple[np.ndarray, Array]:
        """Return the constraint row of every point output and its factor there, per point.

        The objective's integrand has row -1.
        """
        layout, mesh = self.pointwise.layout, self.mesh
        rows = np.full((layout.outputs, mesh.points), -1)
        factors = np.ones((layout.outputs, mesh.points))
        objective, first = int(layout.has_lagrange), layout.integrands
        rows[objective:first] = self.sum_rows[:, mesh.interval]
        factors[:objective] = mesh.weights
        factors[objective:first] = -mesh.weights
        rows[first : first + layout.states] = self.defect_rows
        factors[first : first + layout.states] = -mesh.half_widths
        rows[first + layout.states :] = self.path_rows
        return rows, factors

    def unknown_index(self) -> np.ndarray:
        """Return the variable behind every unknown of the point functions, per point."""
        shared = np.repeat(self.parameter_index[:, None], self.mesh.points, axis=1)
        return np.vstack((self.point_index, shared))

    def _first_derivatives(
        self, x: ca.MX, point: list[ca.MX], ends: list[ca.MX], penalty: ca.DM
    ) -> tuple[ca.MX, ca.MX]:
        mesh = self.mesh
        triplet = self.pointwise.jacobian_sparsity.get_triplet()
        out, unknown = (np.array(part, dtype=int) for part in triplet)
        rows, factors = self.output_places()
        nonzeros = ca.vec(self.pointwise.jacobian.map(mesh.points)(*point))
        target_rows, target_columns = rows[out], self.unknown_index()[unknown]
        target_factors = factors[out]
        source = np.arange(len(out))[:, None] + len(out) * np.arange(mesh.points)[None, :]

        is_objective = target_rows < 0
        to_gradient = sp.csc_array(
            (target_factors[is_objective], (target_columns[is_objective], source[is_objective])),
            shape=(self.variables, source.size),
        )
        gradient = ca.mtimes(ca.DM(to_gradient), nonzeros) + ca.mtimes(penalty, x)
        to_ends = selection(self.end_index, self.variables)
        gradient += ca.mtimes(ca.DM(to_ends), self.endpoints.cost_gradient(*ends))

        keep = ~is_objective
        constant = self._constant_jacobian()
        assembled = assemble(
            (self.rows, self.variables),
            [
                (target_rows[keep], target_columns[keep], target_factors[keep], source[keep], source.size),
                end_jacobian_part(self.endpoints, self.boundary_rows, self.end_index),
            ],
            constant,
        )
        ends_nonzeros = stored(self.endpoints.conditions_jacobian(*ends))
        # IPOPT reads the gradient as a dense vector, whatever its sparsity says
        return ca.densify(gradient), assembled(ca.vertcat(nonzeros, ends_nonzeros))

    def _constant_jacobian(self) -> sp.coo_array:
        """Return the part of the Jacobian that is the same everywhere."""
        layout, mesh = self.pointwise.layout, self.mesh
        slope = self.differentiation.tocoo()
        rows = [self.defect_rows[j][slope.row] for j in range(layout.states)]
        columns = [self.node_index[j][slope.col] for j in range(layout.states)]
        values = [slope.data] * layout.states
        for rows_of, index in zip(self.sum_rows, self.sum_index, strict=True):
            rows += [rows_of, rows_of[1:]]
            columns += [index, index[:-1]]
            values += [np.ones(mesh.intervals), -np.ones(mesh.intervals - 1)]
        coordinates = (np.concatenate(rows), np.concatenate(columns))
        return sp.coo_array((np.concatenate(values), coordinates), shape=(self.rows, self.variables))

    def _hessian(self, point: list[ca.MX], ends: list[ca.MX], lam_f: ca.MX, lam_g: ca.MX) -> ca.MX:
        layout, mesh = self.pointwise.layout, self.mesh
        rows, factors = self.output_places()
        extended = ca.vertcat(lam_g, lam_f)
        which = np.where(rows < 0, self.rows, rows)
        weights = ca.reshape(extended[which.T.ravel().tolist()], layout.outputs, mesh.points)
        nonzeros = ca.vec(self.pointwise.hessian.map(mesh.points)(*point, weights * ca.DM(factors)))
        i, j = (np.array(part, dtype=int) for part in self.pointwise.hessian_sparsity.get_triplet())
        unknowns = self.unknown_index()
        source = np.arange(len(i))[:, None] + len(i) * np.arange(mesh.points)[None, :]
        first, second = unknowns[i], unknowns[j]
        boundary = lam_g[self.boundary_rows.tolist()] if len(self.boundary_rows) else ca.MX(0, 1)
        end_hessian = self.endpoints.hessian(*ends, lam_f, boundary)
        penalty = sp.triu(self.penalty).tocoo()
        p_rows, p_columns = penalty.coords
        assembled = assemble(
            (self.variables, self.variables),
            [
                (
                    np.minimum(first, second).ravel(),
                    np.maximum(first, second).ravel(),
                    np.ones(source.size),
                    source.ravel(),
                    source.size,
                ),
                end_hessian_part(end_hessian, self.end_index),
                (p_rows, p_columns, penalty.data, np.zeros(len(p_rows), dtype=int), 1),
            ],
            sp.coo_array((self.variables, self.variables)),
        )
        return assembled(ca.vertcat(nonzeros, stored(end_hessian), lam_f))

    def _variable_bounds(self) -> tuple[Array, Array]:
        problem, mesh = self.pointwise.problem, self.mesh
        lower, upper = np.full(self.variables, -np.inf), np.full(self.variables, np.inf)

        def bound(index: np.ndarray | np.integer, quantity: Quantity, bounds: tuple[float, float]) -> None:
            lower[index] = np.maximum(lower[index], bounds[0] / quantity.size)
            upper[index] = np.minimum(upper[index], bounds[1] / quantity.size)

        for j, state in enumerate(problem.states):
            bound(self.node_index[j], state, state.bounds)
            for values, node in ((problem.initial, 0), (problem.terminal, mesh.points)):
                if state.name in values:
                    bound(self.node_index[j, node], state, interval(values[state.name]))
        for j, control in enumerate(problem.controls):
            bound(self.point_index[len(problem.states) + j], control, control.bounds)
        for total, integral in zip(self.sum_index[:, -1], problem.integrals, strict=True):
            bound(total, integral, integral.bounds)
        for place, parameter in zip(self.parameter_index, problem.all_parameters, strict=True):
            bound(place, parameter, parameter.bounds)
        return lower, upper

    def _row_bounds(self) -> tuple[Array, Array]:
        problem = self.pointwise.problem
        lower, upper = np.zeros(self.rows), np.zeros(self.rows)
        for rows, constraint in zip(self.path_rows, problem.path, strict=True):
            lower[rows], upper[rows] = (bound / constraint.size for bound in constraint.bounds)
        for row, condition in zip(self.boundary_rows, problem.conditions, strict=True):
            lower[row], upper[row] = (bound / condition.size for bound in condition.bounds)
        return lower, upper
