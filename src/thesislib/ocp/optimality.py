"""How well a solution satisfies the continuous first-order conditions of optimality.

With the Hamiltonian H = L + λ·f (2.80), an integral constraint's integrand counted as part of L with
its multiplier, μ the multipliers of the path constraints c and ν those of the bounds, an optimum has

    dλ/ds = -∂H/∂x - μ·∂c/∂x - ν_x,
        0 =  ∂H/∂u + μ·∂c/∂u + ν_u + (regulariser),
    dH/ds =  ∂H/∂s + μ·∂c/∂s,

where ∂/∂s is the explicit dependence, through the data and the independent variable. The regulariser
(2.171) is included: it adds -ε d²u/ds² to the second equation, as its first differences have it, and
subtracts ε/2 (du/ds)² from the H whose change the third one tells.

At the collocation points the second equation is what the solver has solved, and the first one all but
at the first point of an interval. Between the points none of them is: there they measure the solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal

import numpy as np

from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.iterate import Multipliers, pack
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.quadrature import Array, Rule, differentiation_matrix, interpolation_matrix
from thesislib.ocp.solution import Solution
from thesislib.ocp.transcription import Transcription

# A term below this part of the equation's largest one along the range is rounding.
NEGLIGIBLE = 1e-6

# The costate of a state that appears in no equation is constant, and its equation has no term to be
# relative to: a rate that would change the costate by less than this part of it over the whole range
# counts as that rate.
SLOW = 1e-3

# Step of the central difference that gives explicit derivatives, as a part of the range: the cube
# root of the rounding error, where its own error is about 1e-10 of the derivative.
STEP = 6e-6


@dataclass(frozen=True, eq=False)
class Optimality:
    """Residuals of the first-order conditions, relative to the largest term of their equation.

    Attributes
    ----------
    places : ndarray, shape (k,)
        Values of the independent variable.
    residuals : dict of str to ndarray, shape (k,)
        By equation: `"costate n"`, `"control delta"`, `"hamiltonian"`.
    hamiltonian : ndarray, shape (k,)
        H in units of the objective per unit of the independent variable, the regulariser's share
        included.
    """

    places: Array
    residuals: dict[str, Array]
    hamiltonian: Array

    def share(self, below: float) -> dict[str, float]:
        """Return the share of the points, by equation, at which the residual is below a threshold."""
        return {name: float(np.mean(values < below)) for name, values in self.residuals.items()}


def optimality(
    solution: Solution,
    where: Literal["between", "collocation"] = "between",
    relative_to: Literal["point", "range"] = "point",
) -> Optimality:
    """Return the residuals of the first-order conditions.

    Parameters
    ----------
    solution : Solution
        A solution with its multipliers.
    where : {"between", "collocation"}
        In the middle between neighbouring points of an interval, its end included; or at the
        at the collocation points. Values and multipliers follow the polynomials of their interval.
    relative_to : {"point", "range"}
        Whether a residual is measured by the largest term of its equation at the same point, or
        anywhere along the range. The first is the stricter one: it counts rounding and the small jumps
        of the costates at mesh points wherever nothing much happens, as on a straight.

    Returns
    -------
    Optimality

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """
    multipliers = solution.multipliers
    problem = solution.problem
    rule = solution.mesh.rule
    grid = _Grid(solution.mesh, partial(_middles, rule) if where == "between" else rule.points)
    along = _Along(solution, multipliers, grid, over_range=relative_to == "range")
    hamiltonian = _hamiltonian(solution, multipliers)
    residuals = _costate_equations(along) | _control_equations(along)
    residuals["hamiltonian"] = _hamiltonian_equation(along, hamiltonian)
    scale = problem.objective_scale / solution.span
    places = solution.places(along.grid.fractions)
    return Optimality(places, residuals, along.grid.values(hamiltonian[None, :])[0] * scale)


def _middles(rule: Rule, order: int) -> Array:
    """Return the middles between neighbouring nodes of [-1, 1], both ends included."""
    nodes = rule.support(order)
    return np.asarray(0.5 * (nodes[:-1] + nodes[1:]))


@dataclass(frozen=True, eq=False)
class _Grid:
    """As many places in every interval as it has collocation points, and polynomials there.

    Attributes
    ----------
    mesh : Mesh
        The mesh.
    rule : callable
        From a number of points to that many places in [-1, 1].
    """

    mesh: Mesh
    rule: Callable[[int], Array]

    @cached_property
    def fractions(self) -> Array:
        """The places in [0, 1], shape (N,)."""
        return self.mesh.map_points(self.rule)

    def values(self, rows: Array) -> Array:
        """Return rows given at the collocation points, or at the nodes, at the places, shape (m, N)."""
        return self._mapped(rows, derivative=False)

    def slopes(self, rows: Array) -> Array:
        """Return the derivatives of the rows' polynomials with respect to the fraction, shape (m, N)."""
        return self._mapped(rows, derivative=True)

    def _mapped(self, rows: Array, derivative: bool) -> Array:
        mesh = self.mesh
        with_end = rows.shape[1] == mesh.points + 1
        result = np.empty((rows.shape[0], mesh.points))
        for order, intervals in mesh.by_order():
            support = mesh.rule.support(order) if with_end else mesh.rule.points(order)
            matrix = interpolation_matrix(support, self.rule(order))
            if derivative:
                matrix = matrix @ differentiation_matrix(support)
            first = mesh.first[intervals][:, None]
            found = rows[:, first + np.arange(len(support))] @ matrix.T
            if derivative:
                found = found * (2.0 / mesh.widths[intervals])[:, None]
            result[:, first + np.arange(order)] = found
        return result


class _Along:
    """A solution, its multipliers and the Lagrangian's derivatives at the places of a grid."""

    def __init__(self, solution: Solution, multipliers: Multipliers, grid: _Grid, over_range: bool) -> None:
        iterate = solution.iterate
        self.over_range = over_range
        self.solution, self.multipliers, self.grid = solution, multipliers, grid
        self.z = np.vstack((grid.values(iterate.states), grid.values(iterate.controls)))
        self.slopes = np.vstack((grid.slopes(iterate.states), grid.slopes(iterate.controls)))
        self.costate_slopes = grid.slopes(multipliers.costates)
        bounds = multipliers.bounds.copy()
        # what holds an end value is a single force there, not a density along the range
        ends = solution.problem.initial if grid.mesh.rule.start else solution.problem.terminal
        held = [state.name in ends for state in solution.problem.states]
        bounds[: len(held), 0 if grid.mesh.rule.start else -1][held] = 0.0
        self.bounds = grid.values(bounds)
        self.weights = _output_weights(solution, multipliers, grid)

    @cached_property
    def terms(self) -> list[list[Array]]:
        """Terms of the Lagrangian's derivative by every state and control, each of shape (N,)."""
        pointwise, iterate = self.solution.pointwise, self.solution.iterate
        arguments = pointwise.arguments(self.z, iterate.parameters, self.grid.fractions)
        nonzeros = np.array(pointwise.jacobian.map(self.z.shape[1])(*arguments))
        terms: list[list[Array]] = [[] for _ in range(pointwise.layout.variables)]
        outputs, unknowns = pointwise.jacobian_sparsity.get_triplet()
        for output, unknown, derivative in zip(outputs, unknowns, nonzeros, strict=True):
            if unknown < len(terms):
                terms[unknown].append(self.weights[output] * derivative)
        return terms

    @cached_property
    def explicit(self) -> Array:
        """Derivative of the weighted outputs by the fraction with states and controls held, shape (N,)."""
        pointwise, parameters = self.solution.pointwise, self.solution.iterate.parameters
        low = np.maximum(self.grid.fractions - STEP, 0.0)
        high = np.minimum(self.grid.fractions + STEP, 1.0)
        change = pointwise.evaluate(self.z, parameters, high) - pointwise.evaluate(self.z, parameters, low)
        return np.asarray((self.weights * change).sum(axis=0) / (high - low))

    def relative(self, residual: Array, parts: Array, least: float = 0.0) -> Array:
        """Return a residual relative to the largest of its equation's parts, shape (N,).

        Where that is the largest at the point, it counts at least as `least`, and as `NEGLIGIBLE`
        times the largest along the range.
        """
        largest = np.abs(parts).max(axis=0)
        anywhere = max(float(largest.max()), float(np.finfo(float).tiny))
        floor = anywhere if self.over_range else NEGLIGIBLE * anywhere
        return np.asarray(np.abs(residual) / np.maximum(largest, max(floor, least)))


def _output_weights(solution: Solution, multipliers: Multipliers, grid: _Grid) -> Array:
    """Return the density with which every point output enters the Lagrangian, shape (n_outputs, N)."""
    parts = [np.ones((1, grid.mesh.points))] if solution.pointwise.layout.has_lagrange else []
    parts.append(-multipliers.sums[:, grid.mesh.interval])
    parts += [grid.values(multipliers.costates), grid.values(multipliers.path)]
    return np.vstack(parts)


def _costate_equations(along: _Along) -> dict[str, Array]:
    """Return the relative residuals of dλ/ds = -∂H/∂x - μ·∂c/∂x - ν_x by state."""
    residuals = {}
    for j, state in enumerate(along.solution.problem.states):
        parts = np.vstack((along.costate_slopes[j], along.bounds[j], *along.terms[j]))
        residuals[f"costate {state.name}"] = along.relative(
            parts.sum(axis=0), parts, SLOW * float(np.abs(along.multipliers.costates[j]).max())
        )
    return residuals


def _control_equations(along: _Along) -> dict[str, Array]:
    """Return the relative residuals of 0 = ∂H/∂u + μ·∂c/∂u + ν_u + regulariser by control."""
    solution, mesh = along.solution, along.solution.mesh
    transcription = Transcription(solution.pointwise, Endpoints(solution.pointwise), mesh)
    pull = transcription.penalty @ pack(solution.iterate, transcription)[0]
    first = solution.pointwise.layout.states
    shares = along.grid.values(pull[transcription.point_index[first:]] / mesh.weights)
    residuals = {}
    for j, control in enumerate(solution.problem.controls):
        parts = np.vstack((shares[j], along.bounds[first + j], *along.terms[first + j]))
        residuals[f"control {control.name}"] = along.relative(parts.sum(axis=0), parts)
    return residuals


def _hamiltonian(solution: Solution, multipliers: Multipliers) -> Array:
    """Return the scaled H less the regulariser's share at the collocation points, shape (N,)."""
    pointwise, problem, iterate = solution.pointwise, solution.problem, solution.iterate
    grid = _Grid(solution.mesh, solution.mesh.rule.points)
    outputs = pointwise.evaluate(iterate.points, iterate.parameters, solution.mesh.collocation)
    path = pointwise.layout.integrands + pointwise.layout.states
    hamiltonian = (_output_weights(solution, multipliers, grid) * outputs)[:path].sum(axis=0)
    length = 1.0 if problem.independent.is_free else solution.span / problem.independent.scale
    for control, rate in zip(problem.controls, grid.slopes(iterate.controls), strict=True):
        hamiltonian = hamiltonian - 0.5 * control.rate_weight / length * rate**2
    return np.asarray(hamiltonian)


def _hamiltonian_equation(along: _Along, hamiltonian: Array) -> Array:
    """Return the relative residuals of dH/ds = ∂H/∂s + μ·∂c/∂s.

    The terms they are relative to are those of the chain rule: ∂H/∂x·dx/ds, ∂H/∂u·du/ds, f·dλ/ds and
    the explicit derivative.
    """
    pointwise, iterate = along.solution.pointwise, along.solution.iterate
    outputs = pointwise.evaluate(along.z, iterate.parameters, along.grid.fractions)
    by_variables = [
        term * slope for terms, slope in zip(along.terms, along.slopes, strict=True) for term in terms
    ]
    by_costates = along.costate_slopes * pointwise.derivatives(outputs)
    parts = np.vstack((*by_variables, by_costates, along.explicit))
    return along.relative(along.grid.slopes(hamiltonian[None, :])[0] - along.explicit, parts)
