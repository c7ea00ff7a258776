"""A solved problem in physical units: values, costates, multipliers and how it was found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from thesislib.ocp.iterate import Iterate, Multipliers
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Problem, ProblemError
from thesislib.ocp.quadrature import Array
from thesislib.ocp.refinement import ErrorEstimate

if TYPE_CHECKING:
    from thesislib.ocp.simulation import Simulation


@dataclass(frozen=True)
class MeshRecord:
    """What one solve on one mesh was like.

    Attributes
    ----------
    intervals, points : int
        Size of the mesh.
    objective : float
        The objective without the regulariser.
    error : float
        Largest relative state error (2.162).
    iterations : int
        Iterations of the solver.
    seconds : float
        User CPU time.
    status : str
        What the solver returned.
    change : str
        What refinement did to make the next mesh, or why there was none.
    """

    intervals: int
    points: int
    objective: float
    error: float
    iterations: int
    seconds: float
    status: str
    change: str = ""


@dataclass(frozen=True, eq=False)
class Solution:
    """A solution on its last mesh.

    `solution["v"]` gives a state, control or parameter by name, at the collocation points.

    Attributes
    ----------
    pointwise : Pointwise
        The point functions it was solved with.
    iterate : Iterate
        Scaled values and multipliers, from which other solves can start.
    objective : float
        The objective without the regulariser.
    regularisation : float
        The regulariser (2.171), in units of the objective.
    estimate : ErrorEstimate
        Relative state errors on this mesh.
    tolerance : float
        The error that was asked for.
    history : tuple of MeshRecord
        One entry per mesh.
    converged : bool
        False for a best iterate that the caller asked for though the solve failed.
    compiled : bool
        Whether the derivatives ran as compiled code.
    stopped : str
        Why the refinement ended.
    """

    pointwise: Pointwise
    iterate: Iterate
    objective: float
    regularisation: float
    estimate: ErrorEstimate
    tolerance: float
    history: tuple[MeshRecord, ...]
    converged: bool
    compiled: bool
    stopped: str = ""

    @property
    def problem(self) -> Problem:
        """The problem."""
        return self.pointwise.problem

    @property
    def mesh(self) -> Mesh:
        """The last mesh, on [0, 1]."""
        return self.iterate.mesh

    @property
    def error(self) -> float:
        """Largest relative state error (2.162)."""
        return self.estimate.largest

    @property
    def multipliers(self) -> Multipliers:
        """The scaled multipliers.

        Raises
        ------
        ProblemError
            If there are none.
        """
        if self.iterate.multipliers is None:
            raise ProblemError(f"the solution of {self.problem.name!r} has no multipliers")
        return self.iterate.multipliers

    @property
    def status(self) -> str:
        """What the solver returned on the last mesh."""
        return self.history[-1].status

    def places(self, fractions: Array) -> Array:
        """Return values of the independent variable at fractions of its range."""
        start, span = self.pointwise.range(self.iterate.parameters)
        return np.asarray(start + span * fractions)

    @property
    def span(self) -> float:
        """Length of the range of the independent variable."""
        return float(self.pointwise.range(self.iterate.parameters)[1])

    @property
    def points(self) -> Array:
        """The independent variable at the collocation points, shape (N,)."""
        return self.places(self.mesh.collocation)

    @property
    def nodes(self) -> Array:
        """The independent variable at the collocation points and the end they leave out, shape (N + 1,)."""
        return self.places(self.mesh.nodes)

    @property
    def mesh_points(self) -> Array:
        """The independent variable at the mesh points, shape (K + 1,)."""
        return self.places(self.mesh.boundaries)

    @property
    def weights(self) -> Array:
        """Quadrature weights in units of the independent variable, shape (N,)."""
        return self.mesh.weights * self.span

    def __getitem__(self, name: str) -> Array:
        kind, index, quantity = self.find(name)
        if kind == "state":
            return np.asarray(self.iterate.states[index, self.mesh.collocated] * quantity.size)
        if kind == "control":
            return np.asarray(self.iterate.controls[index] * quantity.size)
        return np.asarray(self.iterate.parameters[index] * quantity.size)

    def parameter(self, name: str) -> float:
        """Return the optimal value of a static parameter."""
        kind, index, quantity = self.find(name)
        if kind != "parameter":
            raise ProblemError(f"{name!r} is a {kind}, not a parameter")
        return float(self.iterate.parameters[index] * quantity.size)

    def at_nodes(self, name: str) -> Array:
        """Return a state at the collocation points and the end they leave out, shape (N + 1,)."""
        kind, index, quantity = self.find(name)
        if kind != "state":
            raise ProblemError(f"{name!r} is a {kind}; only states live at the nodes")
        return np.asarray(self.iterate.states[index] * quantity.size)

    def interpolate(self, name: str, places: Array) -> Array:
        """Return a state or control anywhere, from its interpolating polynomial."""
        kind, index, quantity = self.find(name)
        start, span = self.pointwise.range(self.iterate.parameters)
        fractions = (np.atleast_1d(places) - start) / span
        if kind == "state":
            rows = self.mesh.interpolate_states(self.iterate.states[index][None], fractions)
        elif kind == "control":
            rows = self.mesh.interpolate_controls(self.iterate.controls[index][None], fractions)
        else:
            raise ProblemError(f"{name!r} is a parameter: it has one value")
        return np.asarray(rows[0] * quantity.size)

    def costate(self, name: str) -> Array:
        """Return the costate of a state at the collocation points.

        The sign is that of H = L + λ·f: λ is the derivative of the optimal cost to go with
        respect to the state.

        Parameters
        ----------
        name : str
            A state.

        Returns
        -------
        ndarray, shape (N,)
            In units of the objective per unit of the state.
        """
        kind, index, quantity = self.find(name)
        if kind != "state" or self.iterate.multipliers is None:
            raise ProblemError(f"{name!r} has no costate: it is a {kind}")
        scale = self.problem.objective_scale / quantity.size
        return np.asarray(self.iterate.multipliers.costates[index] * scale)

    def costate_at_ends(self, name: str) -> tuple[float, float]:
        """Return the costate of a state where the range begins and where it ends; see `costate`."""
        kind, index, quantity = self.find(name)
        if kind != "state" or self.iterate.multipliers is None:
            raise ProblemError(f"{name!r} has no costate: it is a {kind}")
        first, last = self.iterate.costates_at_ends()[index] * self.problem.objective_scale / quantity.size
        return float(first), float(last)

    def path_multiplier(self, name: str) -> Array:
        """Return the multiplier density of a path constraint.

        The Lagrangian density is H + μ·c; μ is positive at an upper bound.

        Parameters
        ----------
        name : str
            A path constraint.

        Returns
        -------
        ndarray, shape (N,)
            In units of the objective per unit of the constraint and of the independent
            variable.
        """
        names = [constraint.name for constraint in self.problem.path]
        if name not in names or self.iterate.multipliers is None:
            raise ProblemError(f"no path constraint is named {name!r}; known: {', '.join(names)}")
        index = names.index(name)
        scale = self.problem.objective_scale / self.problem.path[index].size / self.span
        return np.asarray(self.iterate.multipliers.path[index] * scale)

    def bound_multiplier(self, name: str) -> Array:
        """Return the multiplier density of the bounds of a state or control, shape (N,)."""
        kind, index, quantity = self.find(name)
        if kind == "parameter" or self.iterate.multipliers is None:
            raise ProblemError(f"{name!r} is a parameter: its bound has no density")
        row = index + (len(self.problem.states) if kind == "control" else 0)
        scale = self.problem.objective_scale / quantity.size / self.span
        return np.asarray(self.iterate.multipliers.bounds[row] * scale)

    def path_multiplier_at_ends(self, name: str) -> tuple[float, float]:
        """Return a path constraint's multiplier density where the range begins and ends.

        At the end that is no collocation point, where the constraint is not imposed, the straight line
        through the two nearest points is followed, at most to zero.
        """
        values, places = self.path_multiplier(name), self.points
        ends = []
        for end, at, (a, b) in (
            (self.places(np.array(0.0)), 0, (0, 1)),
            (self.places(np.array(1.0)), -1, (-1, -2)),
        ):
            if len(values) < 2 or places[at] == end:
                ends.append(float(values[at]))
                continue
            line = values[a] + (values[b] - values[a]) * (end - places[a]) / (places[b] - places[a])
            ends.append(float(line) if line * values[a] > 0 else 0.0)
        return ends[0], ends[1]

    # These read a solution and belong to modules that build on this one.

    def integral(self, name: str) -> float:
        """Return an integral (2.155) by name; see `evaluation.integral`."""
        from thesislib.ocp.evaluation import integral

        return integral(self, name)

    def defects(self) -> dict[str, Array]:
        """Return the largest defect of every state in every interval; see `evaluation.defects`."""
        from thesislib.ocp.evaluation import defects

        return defects(self)

    def resample(self, mesh: Mesh) -> Solution:
        """Return the solution, multipliers and all, on another mesh; see `evaluation.resampled`."""
        from thesislib.ocp.evaluation import resampled

        return resampled(self, mesh)

    def simulate(self, segments: int | None = None, **options: Any) -> Simulation:
        """Re-integrate the solution with its own controls; see `simulation.simulate`."""
        from thesislib.ocp.simulation import simulate

        return simulate(self, segments, **options)

    def summary(self) -> dict[str, Any]:
        """Return how the solution was found, as plain numbers and strings."""
        return summarised(self)

    def find(self, name: str) -> tuple[str, int, Any]:
        """Return whether a name is a state, control or parameter, its row, and the quantity."""
        for kind, quantities in (
            ("state", self.problem.states),
            ("control", self.problem.controls),
            ("parameter", self.problem.all_parameters),
        ):
            for index, quantity in enumerate(quantities):
                if quantity.name == name:
                    return kind, index, quantity
        known = [q.name for q in (*self.problem.states, *self.problem.controls, *self.problem.all_parameters)]
        raise ProblemError(f"the solution has no {name!r}; known: {', '.join(known)}")


def summarised(solution: Any) -> dict[str, Any]:
    """Return how a solution of one or several phases was found, as plain numbers and strings."""
    last, history = solution.history[-1], solution.history
    return {
        "status": last.status,
        "converged": solution.converged,
        "objective": solution.objective,
        "regularisation": solution.regularisation,
        "error_estimate": solution.error,
        "tolerance": solution.tolerance,
        "points": last.points,
        "intervals": last.intervals,
        "meshes": len(history),
        "iterations": sum(record.iterations for record in history),
        "seconds": sum(record.seconds for record in history),
        "compiled": solution.compiled,
    }
