"""Scaled values and multipliers on a mesh, and how they are carried to another one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Problem, ProblemError, interval
from thesislib.ocp.quadrature import Array
from thesislib.ocp.transcription import Transcription


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers as densities, which do not depend on the mesh they came from.

    Attributes
    ----------
    costates : ndarray, shape (n_x, N)
        Scaled costates at the collocation points: minus the defect multipliers over the
        Radau weights.
    path : ndarray, shape (n_c, N)
        Path multipliers over the quadrature weights.
    bounds : ndarray, shape (n_x + n_u, N)
        Bound multipliers of states and controls over the quadrature weights.
    left_out : ndarray, shape (n_x,)
        Bound multipliers of the states at the end that the collocation points leave out; zero for a
        periodic state, whose value there is that of the other end.
    sums : ndarray, shape (n_q, K)
        Multipliers of the partial sums.
    boundary : ndarray, shape (n_b,)
        Multipliers of the boundary conditions.
    parameters : ndarray, shape (n_p,)
        Bound multipliers of the parameters.
    """

    costates: Array
    path: Array
    bounds: Array
    left_out: Array
    sums: Array
    boundary: Array
    parameters: Array


@dataclass(frozen=True, eq=False)
class Iterate:
    """Scaled values of a solution or guess, with its multipliers where there are any.

    Attributes
    ----------
    mesh : Mesh
        The mesh.
    states : ndarray, shape (n_x, N + 1)
        At the nodes.
    controls : ndarray, shape (n_u, N)
        At the collocation points.
    parameters : ndarray, shape (n_p,)
        Static parameters.
    multipliers : Multipliers or None
        None for a guess.
    """

    mesh: Mesh
    states: Array
    controls: Array
    parameters: Array
    multipliers: Multipliers | None = None

    @property
    def points(self) -> Array:
        """States and controls at the collocation points, shape (n_x + n_u, N)."""
        return np.vstack((self.states[:, self.mesh.collocated], self.controls))

    def costates_at_ends(self) -> Array:
        """Return the scaled costates at both ends of the range, shape (n_x, 2); zero without multipliers.

        At the end that is a collocation point they are its values. At the one that is not they are what
        the equation of the state there makes of the defects' multipliers.
        """
        if self.multipliers is None:
            return np.zeros((len(self.states), 2))
        costates, mesh = self.multipliers.costates, self.mesh
        first, order = (int(mesh.first[-1]), int(mesh.orders[-1]))
        if not mesh.rule.start:
            first, order = 0, int(mesh.orders[0])
        forces = costates[:, first : first + order] * mesh.rule.weights(order)
        matrix = mesh.rule.differentiation(order)
        if mesh.rule.start:
            return np.column_stack((costates[:, 0], forces @ matrix[:, -1]))
        return np.column_stack((-forces @ matrix[:, 0], costates[:, -1]))

    def on(self, mesh: Mesh) -> Iterate:
        """Return this iterate carried to another mesh.

        States and controls follow their interpolating polynomials, costates the
        polynomial through their collocation points; the other multipliers, which jump
        where constraints become active, are interpolated linearly so that no sign changes.
        """
        if mesh is self.mesh:
            return self
        states = self.mesh.interpolate_states(self.states, mesh.nodes)
        controls = self.mesh.interpolate_controls(self.controls, mesh.collocation)
        if self.multipliers is None:
            return Iterate(mesh, states, controls, self.parameters)
        old = self.multipliers
        middles = 0.5 * (mesh.boundaries[:-1] + mesh.boundaries[1:])
        inside = np.searchsorted(self.mesh.boundaries, middles) - 1
        multipliers = Multipliers(
            self.mesh.interpolate_controls(old.costates, mesh.collocation),
            _linear(self.mesh.collocation, old.path, mesh.collocation),
            _linear(self.mesh.collocation, old.bounds, mesh.collocation),
            old.left_out,
            old.sums[:, inside],
            old.boundary,
            old.parameters,
        )
        return Iterate(mesh, states, controls, self.parameters, multipliers)


@dataclass(frozen=True, eq=False)
class Scales:
    """What a problem's solver takes for one, in physical units.

    Attributes
    ----------
    states, controls, parameters, path, integrals, boundary : ndarray
        One number per quantity.
    objective : float
        Size of the objective.
    """

    states: Array
    controls: Array
    parameters: Array
    path: Array
    integrals: Array
    boundary: Array
    objective: float

    @classmethod
    def of(cls, pointwise: Pointwise) -> Scales:
        """Return the scales of a problem."""
        problem = pointwise.problem
        return cls(
            pointwise.state_scale,
            pointwise.control_scale,
            pointwise.parameter_scale,
            pointwise.path_scale,
            pointwise.integral_scale,
            np.array([condition.size for condition in problem.conditions]),
            problem.objective_scale,
        )


def rescaled(iterate: Iterate, theirs: Scales, ours: Scales) -> Iterate:
    """Return an iterate in other scales: values shrink as their unit grows, multipliers grow.

    Parameters
    ----------
    iterate : Iterate
        Values and multipliers in the scales `theirs`.
    theirs, ours : Scales
        Scales of two problems with the same names.

    Returns
    -------
    Iterate
    """
    x, u = theirs.states / ours.states, theirs.controls / ours.controls
    p = theirs.parameters / ours.parameters
    old, multipliers = iterate.multipliers, None
    if old is not None:
        f = theirs.objective / ours.objective
        multipliers = Multipliers(
            old.costates * (f / x)[:, None],
            old.path * (f * ours.path / theirs.path)[:, None],
            old.bounds * (f / np.concatenate((x, u)))[:, None],
            old.left_out * (f / x),
            old.sums * (f * ours.integrals / theirs.integrals)[:, None],
            old.boundary * (f * ours.boundary / theirs.boundary),
            old.parameters * (f / p),
        )
    states, controls = iterate.states * x[:, None], iterate.controls * u[:, None]
    return Iterate(iterate.mesh, states, controls, iterate.parameters * p, multipliers)


def pack(iterate: Iterate, transcription: Transcription) -> tuple[Array, Array | None, Array | None]:
    """Return variables, bound multipliers and constraint multipliers of an iterate.

    Parameters
    ----------
    iterate : Iterate
        On the transcription's mesh.
    transcription : Transcription
        Where everything stands.

    Returns
    -------
    x : ndarray, shape (variables,)
    lam_x, lam_g : ndarray or None
        None for an iterate without multipliers.
    """
    mesh = transcription.mesh
    states = transcription.pointwise.layout.states
    x = np.zeros(transcription.variables)
    x[transcription.node_index] = iterate.states
    x[transcription.point_index[states:]] = iterate.controls
    x[transcription.parameter_index] = iterate.parameters
    x[transcription.sum_index] = _partial_sums(iterate, transcription)
    old = iterate.multipliers
    if old is None:
        return x, None, None
    lam_x, lam_g = np.zeros(transcription.variables), np.zeros(transcription.rows)
    lam_x[transcription.left_out] = old.left_out
    lam_x[transcription.point_index] = old.bounds * mesh.weights
    lam_x[transcription.parameter_index] = old.parameters
    if transcription.sum_index.size:
        # the last partial sum is the integral: what its equation is worth, its bounds hold
        lam_x[transcription.sum_index[:, -1]] = -old.sums[:, -1]
    lam_g[transcription.defect_rows] = -old.costates * mesh.rule_weights
    lam_g[transcription.path_rows] = old.path * mesh.weights
    lam_g[transcription.sum_rows] = old.sums
    lam_g[transcription.boundary_rows] = old.boundary
    return x, lam_x, lam_g


def unpack(x: Array, lam_x: Array, lam_g: Array, transcription: Transcription) -> Iterate:
    """Return the iterate that the solver's vectors stand for; the inverse of `pack`."""
    mesh = transcription.mesh
    states = transcription.pointwise.layout.states
    multipliers = Multipliers(
        -lam_g[transcription.defect_rows] / mesh.rule_weights,
        lam_g[transcription.path_rows] / mesh.weights,
        lam_x[transcription.point_index] / mesh.weights,
        np.where(transcription.wrapped, 0.0, lam_x[transcription.left_out]),
        lam_g[transcription.sum_rows],
        lam_g[transcription.boundary_rows],
        lam_x[transcription.parameter_index],
    )
    return Iterate(
        mesh,
        x[transcription.node_index],
        x[transcription.point_index[states:]],
        x[transcription.parameter_index],
        multipliers,
    )


def guessed(pointwise: Pointwise, mesh: Mesh, guess: Mapping[str, Any]) -> Iterate:
    """Return an iterate from what the caller knows, the rest from bounds and end values.

    Parameters
    ----------
    pointwise : Pointwise
        Brings the problem and its scales.
    mesh : Mesh
        Where to put the guess.
    guess : mapping
        For any state, control or parameter: a number, or (states and controls) a function
        of the independent variable's values.

    Returns
    -------
    Iterate

    Raises
    ------
    ProblemError
        If a name is unknown or a value is not finite.
    """
    problem = pointwise.problem
    known = [q.name for q in (*problem.states, *problem.controls, *problem.all_parameters)]
    for name in guess:
        if name not in known:
            raise ProblemError(f"the guess names {name!r}, which is none of: {', '.join(known)}")
    parameters = np.array([float(guess.get(q.name, _middle(q.bounds))) for q in problem.all_parameters])
    parameters = parameters / pointwise.parameter_scale
    start, span = pointwise.range(parameters)

    def sampled(name: str, default: Array, fractions: Array) -> Array:
        value = guess.get(name, default)
        values = value(start + span * fractions) if callable(value) else value
        return np.broadcast_to(np.asarray(values, dtype=float), fractions.shape)

    states = [
        sampled(state.name, _default(problem, state.name, mesh), mesh.nodes) for state in problem.states
    ]
    controls = [
        sampled(control.name, np.full(mesh.points, _middle(control.bounds)), mesh.collocation)
        for control in problem.controls
    ]
    iterate = Iterate(
        mesh,
        np.array(states) / pointwise.state_scale[:, None],
        np.array(controls).reshape(len(controls), mesh.points) / pointwise.control_scale[:, None],
        parameters,
    )
    for values in (iterate.states, iterate.controls, iterate.parameters):
        if not np.all(np.isfinite(values)):
            raise ProblemError(f"the guess for problem {problem.name!r} has values that are not finite")
    return iterate


def _default(problem: Problem, name: str, mesh: Mesh) -> Array:
    """Return the straight line between a state's end values, or the middle of its bounds."""
    bounds = next(state.bounds for state in problem.states if state.name == name)
    ends = [
        _middle(interval(values[name])) if name in values else None
        for values in (problem.initial, problem.terminal)
    ]
    first = ends[0] if ends[0] is not None else ends[1]
    last = ends[1] if ends[1] is not None else ends[0]
    if first is None or last is None:
        return np.full(mesh.points + 1, _middle(bounds))
    return first + (last - first) * mesh.nodes


def _middle(bounds: tuple[float, float]) -> float:
    """Return the middle of bounds, or the value nearest zero where one side is open."""
    low, high = bounds
    if np.isfinite(low) and np.isfinite(high):
        return 0.5 * (low + high)
    return float(np.clip(0.0, low, high))


def _partial_sums(iterate: Iterate, transcription: Transcription) -> Array:
    """Return the partial sums of the integrals that an iterate's values have."""
    if not transcription.sum_index.size:
        return np.zeros(transcription.sum_index.shape)
    mesh, pointwise = transcription.mesh, transcription.pointwise
    outputs = pointwise.evaluate(iterate.points, iterate.parameters, mesh.collocation)
    integrands = outputs[int(pointwise.layout.has_lagrange) : pointwise.layout.integrands]
    return np.cumsum(np.add.reduceat(integrands * mesh.weights, mesh.first, axis=1), axis=1)


def _linear(old: Array, values: Array, new: Array) -> Array:
    """Interpolate every row linearly."""
    return np.array([np.interp(new, old, row) for row in values]).reshape(values.shape[0], len(new))
