"""The equations at one point as scaled functions with exact first and second derivatives.

Everything that is nonlinear in a collocated problem happens point by point. One symbolic
function of a point's variables therefore carries all derivatives; `transcription` only
scatters its nonzeros into the sparse matrices of the nonlinear programme.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from thesislib.ocp.compilation import compiled
from thesislib.ocp.problem import Point, Problem, Quantity
from thesislib.ocp.quadrature import Array


@dataclass(frozen=True)
class Layout:
    """How many variables and outputs a point has; outputs are ordered
    [objective integrand, integral integrands, derivatives, path expressions]."""

    states: int
    controls: int
    parameters: int
    integrands: int
    path: int
    has_lagrange: bool

    @property
    def variables(self) -> int:
        """States and controls at one point."""
        return self.states + self.controls

    @property
    def outputs(self) -> int:
        """Length of a point's output vector."""
        return self.integrands + self.states + self.path


class Pointwise:
    """Scaled point functions of a problem.

    Parameters
    ----------
    problem : Problem
        The problem; its equations are called once, with CasADi symbols.
    compile_code : bool, optional
        Whether to use compiled C; by default where a compiler is found.

    Attributes
    ----------
    values, jacobian, hessian, gradients : casadi.Function
        Output vector; nonzeros of its Jacobian with respect to (point variables,
        parameters); upper-triangular nonzeros of the Hessian of a weighted sum of the
        outputs; gradients of that sum with respect to the constants and the data.
        Arguments: scaled point variables, scaled parameters, constants, data, fraction
        in [0, 1] (and the weights).
    """

    def __init__(self, problem: Problem, compile_code: bool | None = None) -> None:
        self.problem = problem
        states, controls, parameters = problem.states, problem.controls, problem.all_parameters
        self.state_scale = np.array([state.size for state in states])
        self.control_scale = np.array([control.size for control in controls])
        self.parameter_scale = np.array([parameter.size for parameter in parameters])
        self.path_scale = np.array([constraint.size for constraint in problem.path])
        self.integral_scale = np.array([integral.size for integral in problem.integrals])
        has_lagrange = problem.lagrange is not None
        self.layout = Layout(
            len(states),
            len(controls),
            len(parameters),
            has_lagrange + len(problem.integrals),
            len(problem.path),
            has_lagrange,
        )
        z, p, c, w, fraction = self._symbols()
        outputs = self._outputs(z, p, c, w, fraction)
        mu = ca.SX.sym("mu", self.layout.outputs)
        unknowns = ca.vertcat(z, p)
        weighted = ca.dot(mu, outputs)
        jacobian = ca.jacobian(outputs, unknowns)
        hessian = ca.triu(ca.hessian(weighted, unknowns)[0])
        self.jacobian_sparsity = jacobian.sparsity()
        self.hessian_sparsity = hessian.sparsity()
        point = [z, p, c, w, fraction]
        gradients = ca.vertcat(ca.gradient(weighted, c), ca.gradient(weighted, w))
        functions = [
            ca.Function("values", point, [ca.densify(outputs)]),
            ca.Function("jacobian", point, [_nonzeros(jacobian)]),
            ca.Function("hessian", [*point, mu], [_nonzeros(hessian)]),
            ca.Function("gradients", [*point, mu], [ca.densify(gradients)]),
        ]
        self.values, self.jacobian, self.hessian, self.gradients = compiled(functions, compile_code)
        self.compiled = self.values is not functions[0]

    def _outputs(self, z: ca.SX, p: ca.SX, c: ca.SX, w: ca.SX, fraction: ca.SX) -> ca.SX:
        problem = self.problem
        start, span = self.range(p)
        values = _named((*problem.states, *problem.controls), z) | _named(problem.all_parameters, p)
        values |= dict(zip(problem.constants, ca.vertsplit(c), strict=True)) if c.numel() else {}
        values |= dict(zip(problem.data, ca.vertsplit(w), strict=True)) if w.numel() else {}
        values[problem.independent.name] = start + span * fraction
        equations = problem.equations(Point(values))
        problem.check(equations)
        rows = []
        if problem.lagrange is not None:
            rows.append(span * equations.integrands[problem.lagrange] / problem.objective_scale)
        for integral in problem.integrals:
            rows.append(span * equations.integrands[integral.name] / integral.size)
        for state in problem.states:
            rows.append(span * equations.derivatives[state.name] / state.size)
        for constraint in problem.path:
            rows.append(equations.path[constraint.name] / constraint.size)
        return ca.vertcat(*rows)

    def range(self, p: Any) -> tuple[Any, Any]:
        """Return where the independent variable starts and how far it runs.

        Numbers where the ends are fixed, else of the kind of the scaled parameters `p`: symbols or
        an array's elements.
        """
        independent = self.problem.independent
        ends: dict[str, Any] = {"initial": independent.initial, "final": independent.final}
        first = len(self.problem.parameters)
        for place, end in enumerate(independent.free, start=first):
            ends[end] = p[place] * self.parameter_scale[place]
        return ends["initial"], ends["final"] - ends["initial"]

    @cached_property
    def output_names(self) -> list[str]:
        """What the rows of an output vector are."""
        problem = self.problem
        names = [f"integrand {problem.lagrange}"] if self.layout.has_lagrange else []
        names += [f"integrand {integral.name}" for integral in problem.integrals]
        names += [f"derivative of {state.name}" for state in problem.states]
        return names + [f"path expression {constraint.name}" for constraint in problem.path]

    @cached_property
    def constants(self) -> Array:
        """Values of the problem's constants, shape (n_c,)."""
        return np.array([float(value) for value in self.problem.constants.values()])

    def data(self, fractions: Array, parameters: Array) -> Array:
        """Evaluate the problem's data at fractions of the range.

        Parameters
        ----------
        fractions : ndarray, shape (k,)
            Places in [0, 1].
        parameters : ndarray, shape (n_p,)
            Scaled parameters, of which a free final value is the last.

        Returns
        -------
        ndarray, shape (n_w, k)
        """
        start, span = self.range(parameters)
        places = start + span * fractions
        rows = [np.broadcast_to(function(places), fractions.shape) for function in self.problem.data.values()]
        return np.array(rows, dtype=float).reshape(len(rows), len(fractions))

    def arguments(self, z: Array, parameters: Array, fractions: Array) -> list[Array]:
        """Return what the point functions, mapped over many points, take.

        Parameters
        ----------
        z : ndarray, shape (n_z, k)
            Scaled states and controls.
        parameters : ndarray, shape (n_p,)
            Scaled parameters.
        fractions : ndarray, shape (k,)
            Places in [0, 1].

        Returns
        -------
        list of ndarray, each with k columns
        """
        return [
            z,
            _repeated(parameters, len(fractions)),
            _repeated(self.constants, len(fractions)),
            self.data(fractions, parameters),
            fractions[None, :],
        ]

    def evaluate(self, z: Array, parameters: Array, fractions: Array) -> Array:
        """Return the output vectors at many points, shape (n_outputs, k); see `arguments`."""
        return np.array(self.values.map(len(fractions))(*self.arguments(z, parameters, fractions)))

    @cached_property
    def mixed(self) -> ca.Function:
        """What constants and data add to a point's outputs and to the gradient of their weighted sum.

        Jacobian of (outputs, gradient of the weighted outputs by the unknowns) by (constants, data);
        arguments as of `hessian`. Made when it is first asked for, and not compiled: one evaluation
        is all that a sensitivity needs.
        """
        z, p, c, w, fraction = self._symbols()
        mu = ca.SX.sym("mu", self.layout.outputs)
        outputs = self._outputs(z, p, c, w, fraction)
        gradient = ca.gradient(ca.dot(mu, outputs), ca.vertcat(z, p))
        jacobian = ca.jacobian(ca.vertcat(outputs, gradient), ca.vertcat(c, w))
        return ca.Function("mixed", [z, p, c, w, fraction, mu], [ca.densify(jacobian)])

    def _symbols(self) -> list[ca.SX]:
        """Return symbols of a point: variables, parameters, constants, data, fraction."""
        problem = self.problem
        return [
            ca.SX.sym("z", self.layout.variables),
            ca.SX.sym("p", self.layout.parameters),
            ca.SX.sym("c", len(problem.constants)),
            ca.SX.sym("w", len(problem.data)),
            ca.SX.sym("fraction"),
        ]

    def derivatives(self, outputs: Array) -> Array:
        """Return the rows of an output matrix that are the scaled state derivatives."""
        first = self.layout.integrands
        return outputs[first : first + self.layout.states]

    def path_values(self, outputs: Array) -> Array:
        """Return the rows of an output matrix that are the scaled path expressions."""
        return outputs[self.layout.integrands + self.layout.states :]


def _named(quantities: Sequence[Quantity], values: ca.SX) -> dict[str, ca.SX]:
    """Pair quantities with the elements of a column of scaled values, in physical units."""
    return {quantity.name: values[i] * quantity.size for i, quantity in enumerate(quantities)}


def _nonzeros(matrix: ca.SX) -> ca.SX:
    """Return the structural nonzeros of a sparse matrix as a dense column."""
    return ca.SX(matrix.nz[:]) if matrix.nnz() else ca.SX(0, 1)


def _repeated(column: Array, times: int) -> Array:
    """Return a column repeated side by side."""
    return np.repeat(np.asarray(column, dtype=float)[:, None], times, axis=1)
