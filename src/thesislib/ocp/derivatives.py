"""How a solution changes with the numbers, functions and bounds of its problem.

The first-order system of the collocated problem is differentiated: one solve with its matrix for each
change, no further optimisation. Between changes of what is active the solution is differentiable; where a
change moves a switch along the mesh, this is the derivative on the mesh as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from thesislib.ocp.evaluation import end_values
from thesislib.ocp.kkt import FirstOrder
from thesislib.ocp.lagrangian import explicit_gradients, joint_arguments, joint_gradient
from thesislib.ocp.problem import ProblemError, unknown
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import Solution
from thesislib.ocp.system import AnySolution, Iterates, parts
from thesislib.ocp.transcription import Transcription


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


class Derivatives:
    """Derivatives of one solution; its first-order system is factorised once for all of them.

    Parameters
    ----------
    solution : Solution or PhasedSolution
        An optimum with its multipliers, solved tightly (`optimality` 1e-7 or below).

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """

    def __init__(self, solution: AnySolution) -> None:
        self.solution = solution
        self.first_order = FirstOrder(solution)

    def by(self, name: str, change: Array | Callable[[Array], Array] | None = None) -> Derivative:
        """Return the derivative with respect to a constant, or to data in a direction.

        Parameters
        ----------
        name : str
            A constant, or data of a problem of one phase.
        change : ndarray, shape (N,), or callable, optional
            The direction at the collocation points, or as a function of the independent variable; by default
            one everywhere. Of data: the change δw. Of a constant: how much of its change acts where; then
            end costs and boundary conditions see none of it.

        Raises
        ------
        ProblemError
            If nothing has that name, or the first-order system is singular.
        """
        known = {
            key for part in parts(self.solution) for key in (*part.problem.constants, *part.problem.data)
        }
        if name not in known:
            raise ProblemError(unknown("constant or data", name, sorted(known)))
        return self._answered(name, *self._mixed(name, change))

    def by_bounds(self, name: str, lower: float = 0.0, upper: float = 0.0) -> Derivative:
        """Return the derivative with respect to the bounds of a state, control or path constraint.

        Parameters
        ----------
        name : str
            The state, control or path constraint, of a problem of one phase.
        lower, upper : float
            By how much either bound moves per unit of the change, in the unit of what is bounded.

        Raises
        ------
        ProblemError
            If nothing has that name or the problem has several phases.
        """
        solution = self.solution
        if not isinstance(solution, Solution):
            raise ProblemError(f"bounds of {solution.problem.name!r} move in problems of one phase only")
        transcription = self.first_order.collocated.transcriptions[0]
        by_variables, by_rows = np.zeros(len(self.first_order.x)), np.zeros(len(self.first_order.g))
        constraints = [constraint.name for constraint in solution.problem.path]
        if name in constraints:
            place = constraints.index(name)
            index, size = transcription.path_rows[place], solution.problem.path[place].size
            held = self.first_order.lam_g[index]
            moved = np.where(held > 0, upper, lower) / size
            by_rows[index] -= moved
        else:
            kind, place, quantity = solution.find(name)
            if kind == "parameter":
                raise ProblemError(f"{name!r} is a parameter: its bounds do not act along the range")
            place += len(solution.problem.states) if kind == "control" else 0
            index = transcription.point_index[place]
            held = self.first_order.lam_x[index]
            moved = np.where(held > 0, upper, lower) / quantity.size
            by_variables[index] -= self.first_order.stiffness[index] * moved
        return self._answered(name, by_variables, by_rows, -float(held @ moved))

    def _answered(self, name: str, by_variables: Array, by_rows: Array, explicit: float) -> Derivative:
        """Return the derivative that a change of the first-order system causes; `explicit` as of `_mixed`."""
        solution, first_order = self.solution, self.first_order
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

    def _mixed(
        self, name: str, change: Array | Callable[[Array], Array] | None
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
        solution, first_order = self.solution, self.first_order
        collocated = first_order.collocated
        by_variables, by_rows = np.zeros(len(first_order.x)), np.zeros(len(first_order.g))
        explicit = 0.0
        for place, (part, transcription, a, c) in enumerate(
            zip(
                parts(solution),
                collocated.transcriptions,
                collocated.variables,
                collocated.rows,
                strict=False,
            )
        ):
            multipliers = first_order.lam_g[c : c + transcription.rows]
            direction = _direction(part, name, change)
            if direction is None:
                continue
            explicit += float(np.sum(explicit_gradients(part, transcription, multipliers) * direction))
            count = part.pointwise.layout.outputs
            moved = np.einsum("hnw,wn->hn", self._blocks[place], direction)
            rows, factors = transcription.output_places()
            real = rows >= 0
            np.add.at(by_rows, c + rows[real], (factors * moved[:count])[real])
            np.add.at(by_variables, a + transcription.unknown_index(), moved[count:])
            names = list(part.problem.constants)
            if name in names and change is None:
                ends = transcription.endpoints
                boundary = multipliers[transcription.boundary_rows]
                arguments = (end_values(part.iterate), part.pointwise.constants, 1.0, boundary)
                column = np.array(ends.mixed(*arguments))[:, names.index(name)]
                by_rows[c + transcription.boundary_rows] += column[: ends.count]
                np.add.at(by_variables, a + transcription.end_index, column[ends.count :])
                explicit += float(np.array(ends.constants_gradient(*arguments)).ravel()[names.index(name)])
        if change is None:
            _add_joint(solution, first_order, name, by_variables, by_rows)
            gradient = joint_gradient(solution, collocated.system)
            explicit += float(gradient[_joint_places(solution, name)].sum())
        return by_variables, by_rows, explicit

    @cached_property
    def _blocks(self) -> list[Array]:
        """What constants and data add to outputs and weighted gradients, phase by phase."""
        found = []
        for part, transcription, c in zip(
            parts(self.solution),
            self.first_order.collocated.transcriptions,
            self.first_order.collocated.rows,
            strict=False,
        ):
            multipliers = self.first_order.lam_g[c : c + transcription.rows]
            found.append(_point_blocks(part, transcription, multipliers))
        return found


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


def _direction(
    solution: Solution, name: str, change: Array | Callable[[Array], Array] | None
) -> Array | None:
    """Return the change of (constants, data) at every point, or None where the name is not known."""
    constants, data = list(solution.problem.constants), list(solution.problem.data)
    direction = np.zeros((len(constants) + len(data), solution.mesh.points))
    names = [*constants, *data]
    if name not in names:
        return None
    values = change(solution.points) if callable(change) else change
    direction[names.index(name)] = 1.0 if values is None else values
    return direction


def _point_blocks(solution: Solution, transcription: Transcription, multipliers: Array) -> Array:
    """Return what constants and data add to outputs and weighted gradients, (n_out + n_unknowns, N, n)."""
    pointwise, mesh, iterate = solution.pointwise, solution.mesh, solution.iterate
    height, width = pointwise.mixed.size_out(0)
    blocks = np.array(
        pointwise.mixed.map(mesh.points)(
            *pointwise.arguments(iterate.points, iterate.parameters, mesh.collocation),
            transcription.output_weights(multipliers),
        )
    )
    return blocks.reshape(height, mesh.points, width)


def _joint_places(solution: AnySolution, name: str) -> np.ndarray:
    """Return where a constant stands among those of all phases, one after another."""
    names = [key for part in parts(solution) for key in part.problem.constants]
    return np.flatnonzero(np.array([key == name for key in names], dtype=bool))


def _add_joint(
    solution: AnySolution, first_order: FirstOrder, name: str, by_variables: Array, by_rows: Array
) -> None:
    """Add what links and common cost contribute to the derivatives of the first-order system."""
    if isinstance(solution, Solution):
        return
    collocated = first_order.collocated
    functions = collocated.system.joint[0]
    blocks = np.array(functions.mixed(*joint_arguments(solution)))
    column = blocks[:, _joint_places(solution, name)].sum(axis=1)
    by_rows[collocated.rows[-1] :] += column[: functions.count]
    np.add.at(by_variables, collocated.end_index, column[functions.count :])
