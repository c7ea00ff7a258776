"""How the optimum changes with the numbers and functions of a problem, from one solve.

At an optimum the first change of the objective is the explicit derivative of the Lagrangian: what
the variables would change cancels, because the Lagrangian is stationary in them. The multipliers of
one solve therefore give the derivative with respect to everything the equations read. What the
variables do change is one further solve of linear equations: `derivative`.

The objective that is differentiated is the one that was minimised: the regulariser (2.171) is part
of it. `derivative` tells its share.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from thesislib.ocp.evaluation import end_values
from thesislib.ocp.iterate import pack
from thesislib.ocp.kkt import FirstOrder
from thesislib.ocp.problem import ProblemError, unknown
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution
from thesislib.ocp.system import AnySolution, Iterates, System, iterates_of, parts
from thesislib.ocp.transcription import Transcription


def sensitivity(solution: AnySolution) -> dict[str, float]:
    """Return the derivative of the minimised objective with respect to every constant.

    Parameters
    ----------
    solution : Solution or PhasedSolution
        An optimum with its multipliers.

    Returns
    -------
    dict
        By name of the constant, in units of the objective per unit of the constant. The regulariser
        is part of the objective. A constant of several phases changes in all of them.

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """
    system = System.solved(solution)
    collocated = system.collocated(iterates_of(solution).meshes)
    totals: dict[str, float] = {}
    at_joint = _joint_gradient(solution, system)
    for part, transcription in zip(parts(solution), collocated.transcriptions, strict=True):
        multipliers = _multipliers(part, transcription)
        names = list(part.problem.constants)
        along = _gradients(part, transcription, multipliers)[: len(names)].sum(axis=1)
        at_ends = transcription.endpoints.constants_gradient(
            end_values(part.iterate), part.pointwise.constants, 1.0, multipliers[transcription.boundary_rows]
        )
        mine, at_joint = at_joint[: len(names)], at_joint[len(names) :]
        total = (along + np.array(at_ends).ravel() + mine) * part.problem.objective_scale
        for name, value in zip(names, total, strict=True):
            totals[name] = totals.get(name, 0.0) + float(value)
    return totals


def density(solution: Solution, name: str) -> Array:
    """Return the derivative of the minimised objective with respect to a data function.

    A small change δw(s) of the data changes the objective by ∫ density(s) δw(s) ds, which the
    solution's own quadrature gives as `solution.weights @ (density * change)`.

    Parameters
    ----------
    solution : Solution
        An optimum with its multipliers.
    name : str
        A data function of the problem.

    Returns
    -------
    ndarray, shape (N,)
        At the collocation points, in units of the objective per unit of the data and of the
        independent variable. The regulariser is part of the objective.

    Raises
    ------
    ProblemError
        If the problem has no such data or the solution has no multipliers.
    """
    return _density(solution, len(solution.problem.constants) + _data_index(solution, name))


def constant_density(solution: Solution, name: str) -> Array:
    """Return where along the range a constant acts on the minimised objective.

    Parameters
    ----------
    solution : Solution
        An optimum with its multipliers.
    name : str
        A constant of the problem.

    Returns
    -------
    ndarray, shape (N,)
        At the collocation points; its integral, `solution.weights @ density`, is the derivative that
        `sensitivity` returns, but for what the constant does in end costs and boundary conditions.

    Raises
    ------
    ProblemError
        If the problem has no such constant or the solution has no multipliers.
    """
    names = list(solution.problem.constants)
    if name not in names:
        raise ProblemError(unknown("constant", name, names))
    return _density(solution, names.index(name))


def _density(solution: Solution, row: int) -> Array:
    """Return the derivative of the minimised objective by one of (constants, data), as a density."""
    transcription = System.solved(solution).collocated([solution.mesh]).transcriptions[0]
    gradient = _gradients(solution, transcription, _multipliers(solution, transcription))[row]
    return np.asarray(gradient * solution.problem.objective_scale / solution.weights)


@dataclass(frozen=True, eq=False)
class Derivative:
    """How a solution changes with a constant or with data, per unit of the change.

    `derivative["v"]` is the change of a state, control or parameter; `of("boost")` picks a phase.

    Attributes
    ----------
    name : str
        What changes.
    objective : float
        Derivative of the objective without the regulariser.
    regularisation : float
        Derivative of the regulariser's share of what is minimised.
    phases : tuple of Solution
        The solutions that change, one per phase.
    states, controls, parameters : tuple of ndarray
        Derivatives in physical units: (n_x, N + 1) at the nodes, (n_u, N), (n_p,), one of each per phase.
    """

    name: str
    objective: float
    regularisation: float
    phases: tuple[Solution, ...]
    states: tuple[Array, ...]
    controls: tuple[Array, ...]
    parameters: tuple[Array, ...]
    phase: int = 0

    def of(self, phase: str) -> Derivative:
        """Return the derivative seen from another phase."""
        names = [part.problem.name for part in self.phases]
        if phase not in names:
            raise ProblemError(unknown("phase", phase, names))
        return replace(self, phase=names.index(phase))

    def __getitem__(self, name: str) -> Array:
        kind, index, _ = self.phases[self.phase].find(name)
        rows = {"state": self.states, "control": self.controls, "parameter": self.parameters}[kind]
        found = rows[self.phase][index]
        if kind == "state":
            return np.asarray(found[self.phases[self.phase].mesh.collocated])
        return np.asarray(found)


def derivative(
    solution: AnySolution, name: str, change: Array | Callable[[Array], Array] | None = None
) -> Derivative:
    """Return the derivative of a solution with respect to a constant, or to data in a direction.

    The first-order system of the collocated problem is differentiated: one solve with its matrix, no
    further optimisation. Between changes of what is active the solution is differentiable; where a
    change moves a switch along the mesh, this is the derivative on the mesh as it is.

    Parameters
    ----------
    solution : Solution or PhasedSolution
        An optimum with its multipliers, solved tightly (`optimality` 1e-8 or below).
    name : str
        A constant, or data of a problem of one phase.
    change : ndarray, shape (N,), or callable, optional
        Of data: the direction δw at the collocation points, or as a function of the independent
        variable; by default one everywhere.

    Returns
    -------
    Derivative

    Raises
    ------
    ProblemError
        If nothing has that name or the solution has no multipliers.
    """
    known = {key for part in parts(solution) for key in (*part.problem.constants, *part.problem.data)}
    if name not in known:
        raise ProblemError(unknown("constant or data", name, sorted(known)))
    first_order = FirstOrder(solution)
    by_variables, by_rows, explicit = _mixed(solution, first_order, name, change)
    dx, dlam = first_order.solve(by_variables, by_rows)
    collocated = first_order.collocated
    scale = parts(solution)[0].problem.objective_scale
    moved = collocated.unpack(dx, np.zeros_like(dx), dlam)
    penalty = 0.0
    for transcription, a, b in zip(
        collocated.transcriptions, collocated.variables[:-1], collocated.variables[1:], strict=True
    ):
        penalty += float(first_order.x[a:b] @ (transcription.penalty @ dx[a:b]))
    states, controls, parameters = _physical(solution, moved)
    return Derivative(
        name,
        (explicit - penalty) * scale,
        penalty * scale,
        parts(solution),
        states,
        controls,
        parameters,
    )


def _physical(
    solution: AnySolution, moved: Iterates
) -> tuple[tuple[Array, ...], tuple[Array, ...], tuple[Array, ...]]:
    """Return scaled changes in physical units, phase by phase."""
    states, controls, parameters = [], [], []
    for part, iterate in zip(parts(solution), moved.phases, strict=True):
        states.append(iterate.states * part.pointwise.state_scale[:, None])
        controls.append(iterate.controls * part.pointwise.control_scale[:, None])
        parameters.append(iterate.parameters * part.pointwise.parameter_scale)
    return tuple(states), tuple(controls), tuple(parameters)


def _mixed(
    solution: AnySolution,
    first_order: FirstOrder,
    name: str,
    change: Array | Callable[[Array], Array] | None,
) -> tuple[Array, Array, float]:
    """Return the explicit derivatives of the first-order system and of the Lagrangian.

    Returns
    -------
    by_variables : ndarray, shape (n,)
        Of the Lagrangian's derivative.
    by_rows : ndarray, shape (m,)
        Of the constraints.
    explicit : float
        Of the Lagrangian: the derivative of the minimised objective.
    """
    collocated = first_order.collocated
    by_variables, by_rows = np.zeros(len(first_order.x)), np.zeros(len(first_order.g))
    explicit = 0.0
    for part, transcription, a, c in zip(
        parts(solution), collocated.transcriptions, collocated.variables, collocated.rows, strict=False
    ):
        multipliers = first_order.lam_g[c : c + transcription.rows]
        direction = _direction(part, name, change)
        if direction is None:
            continue
        explicit += float(np.sum(_gradients(part, transcription, multipliers) * direction))
        count = part.pointwise.layout.outputs
        moved = _point_changes(part, transcription, multipliers, direction)
        rows, factors = transcription.output_places()
        real = rows >= 0
        np.add.at(by_rows, c + rows[real], (factors * moved[:count])[real])
        np.add.at(by_variables, a + transcription.unknown_index(), moved[count:])
        names = list(part.problem.constants)
        if name in names:
            ends = transcription.endpoints
            boundary = multipliers[transcription.boundary_rows]
            arguments = (end_values(part.iterate), part.pointwise.constants, 1.0, boundary)
            column = np.array(ends.mixed(*arguments))[:, names.index(name)]
            by_rows[c + transcription.boundary_rows] += column[: ends.count]
            np.add.at(by_variables, a + transcription.end_index, column[ends.count :])
            explicit += float(np.array(ends.constants_gradient(*arguments)).ravel()[names.index(name)])
    _add_joint(solution, first_order, name, by_variables, by_rows)
    system = collocated.system
    places = _joint_places(solution, name)
    explicit += float(_joint_gradient(solution, system)[places].sum())
    return by_variables, by_rows, explicit


def _direction(
    solution: Solution, name: str, change: Array | Callable[[Array], Array] | None
) -> Array | None:
    """Return the change of (constants, data) at every point, or None where the name is not known."""
    constants, data = list(solution.problem.constants), list(solution.problem.data)
    direction = np.zeros((len(constants) + len(data), solution.mesh.points))
    if name in constants:
        direction[constants.index(name)] = 1.0
        return direction
    if name not in data:
        return None
    values = change(solution.points) if callable(change) else change
    direction[len(constants) + data.index(name)] = 1.0 if values is None else values
    return direction


def _point_changes(
    solution: Solution, transcription: Transcription, multipliers: Array, direction: Array
) -> Array:
    """Return what a direction adds to outputs and weighted gradients, shape (n_out + n_unknowns, N)."""
    pointwise, mesh, iterate = solution.pointwise, solution.mesh, solution.iterate
    height, width = pointwise.mixed.size_out(0)
    blocks = np.array(
        pointwise.mixed.map(mesh.points)(
            *pointwise.arguments(iterate.points, iterate.parameters, mesh.collocation),
            transcription.output_weights(multipliers),
        )
    ).reshape(height, mesh.points, width)
    return np.asarray(np.einsum("hnw,wn->hn", blocks, direction))


def _joint_places(solution: AnySolution, name: str) -> np.ndarray:
    """Return where a constant stands among those of all phases, one after another."""
    names = [key for part in parts(solution) for key in part.problem.constants]
    return np.flatnonzero(np.array([key == name for key in names], dtype=bool))


def _joint_arguments(solution: AnySolution) -> tuple[Array, Array, float, Array]:
    ends = np.concatenate([end_values(part.iterate) for part in parts(solution)])
    constants = np.concatenate([part.pointwise.constants for part in parts(solution)])
    return ends, constants, 1.0, iterates_of(solution).links


def _joint_gradient(solution: AnySolution, system: System) -> Array:
    """Return the derivative of links and common cost by the constants of all phases, scaled."""
    if isinstance(solution, Solution):
        return np.zeros(len(solution.problem.constants))
    functions = system.joint[0]
    return np.array(functions.constants_gradient(*_joint_arguments(solution))).ravel()


def _add_joint(
    solution: AnySolution, first_order: FirstOrder, name: str, by_variables: Array, by_rows: Array
) -> None:
    """Add what links and common cost contribute to the derivatives of the first-order system."""
    if isinstance(solution, Solution):
        return
    collocated = first_order.collocated
    functions = collocated.system.joint[0]
    blocks = np.array(functions.mixed(*_joint_arguments(solution)))
    column = blocks[:, _joint_places(solution, name)].sum(axis=1)
    by_rows[collocated.rows[-1] :] += column[: functions.count]
    np.add.at(by_variables, collocated.end_index, column[functions.count :])


def _data_index(solution: Solution, name: str) -> int:
    data = list(solution.problem.data)
    if name not in data:
        known = ", ".join(data) or "none"
        raise ProblemError(f"{solution.problem.name!r} reads no data named {name!r}; known: {known}")
    return data.index(name)


def _multipliers(solution: Solution, transcription: Transcription) -> Array:
    """Return the multipliers of the constraints in the solver's sign."""
    multipliers = pack(solution.iterate, transcription)[2]
    if multipliers is None:
        raise ProblemError(f"the solution of {solution.problem.name!r} has no multipliers")
    return multipliers


def _gradients(solution: Solution, transcription: Transcription, multipliers: Array) -> Array:
    """Return the Lagrangian's explicit derivatives, a row per constant and data function.

    Shape (n_constants + n_data, N): the share of every collocation point, in the scaled objective.
    """
    pointwise, mesh, iterate = solution.pointwise, solution.mesh, solution.iterate
    gradients = pointwise.gradients.map(mesh.points)(
        *pointwise.arguments(iterate.points, iterate.parameters, mesh.collocation),
        transcription.output_weights(multipliers),
    )
    return np.array(gradients)
