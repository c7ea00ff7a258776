"""A problem of one or several phases as the solver sees it: one programme, one vector each way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from thesislib.ocp.endpoints import EndFunctions, Endpoints, symbolic_ends
from thesislib.ocp.iterate import Iterate, Scales, guessed, pack, rescaled, unpack
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.phased import PhasedSolution
from thesislib.ocp.phases import Phases, ends_by_phase
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Problem, ProblemError, unknown
from thesislib.ocp.programme import Joint, Programme, joined, recombined
from thesislib.ocp.quadrature import Array
from thesislib.ocp.related import Related, taken_over
from thesislib.ocp.solution import Solution
from thesislib.ocp.transcription import Transcription

Statement = Problem | Phases
AnySolution = Solution | PhasedSolution


@dataclass(frozen=True, eq=False)
class Iterates:
    """Values and multipliers of every phase, and the multipliers of the links between them.

    Attributes
    ----------
    phases : tuple of Iterate
        One per phase.
    links : ndarray, shape (n_l,)
        Scaled multipliers of the links.
    """

    phases: tuple[Iterate, ...]
    links: Array

    @property
    def meshes(self) -> tuple[Mesh, ...]:
        """The meshes of the phases."""
        return tuple(iterate.mesh for iterate in self.phases)

    def on(self, meshes: Sequence[Mesh]) -> Iterates:
        """Return the iterates carried to other meshes, one for each phase."""
        carried = tuple(iterate.on(mesh) for iterate, mesh in zip(self.phases, meshes, strict=True))
        return Iterates(carried, self.links)


class System:
    """The compiled statement of a problem.

    Parameters
    ----------
    statement : Problem or Phases
        What is to be solved.
    pointwise : sequence of Pointwise
        The point functions of its phases.

    Raises
    ------
    ProblemError
        If there is nothing to minimise, or the boundary equations do not fit the problem.
    """

    def __init__(self, statement: Statement, pointwise: Sequence[Pointwise]) -> None:
        if isinstance(statement, Problem) and not statement.has_objective:
            raise ProblemError(f"problem {statement.name!r} has no objective: give lagrange or mayer")
        self.statement = statement
        self.pointwise = tuple(pointwise)
        self.endpoints = tuple(Endpoints(functions) for functions in pointwise)

    @classmethod
    def of(
        cls, statement: Statement, compile_code: bool | None = None, similar: AnySolution | None = None
    ) -> System:
        """Return the system of a statement; a solution of the very same problem brings its functions."""
        known = {} if similar is None else {id(s.problem): s.pointwise for s in parts(similar)}
        functions = []
        for problem in _phases(statement):
            found = known.get(id(problem))
            keep = found is not None and compile_code in (None, found.compiled)
            functions.append(found if found is not None and keep else Pointwise(problem, compile_code))
        return cls(statement, functions)

    @classmethod
    def solved(cls, solution: AnySolution) -> System:
        """Return the system that a solution solves."""
        return cls(solution.problem, [part.pointwise for part in parts(solution)])

    def started(self, guess: Any, mesh: Mesh | Mapping[str, Mesh] | None) -> Iterates:
        """Return where a solve begins.

        Parameters
        ----------
        guess : mapping, Solution, Related, PhasedSolution or None
            As in `solve`.
        mesh : Mesh, mapping or None
            First mesh, of all phases or by phase.

        Raises
        ------
        ProblemError
            If the guess or the meshes do not fit the problem.
        """
        problems = _phases(self.statement)
        if isinstance(guess, Related):
            if isinstance(self.statement, Phases):
                raise ProblemError(f"{self.statement.name!r} has phases: give each a related solution")
            start = taken_over(guess, self.pointwise[0], self._mesh(problems[0], mesh))
            return Iterates((start,), np.zeros(0))
        if isinstance(guess, Solution | PhasedSolution):
            theirs = parts(guess)
            if len(theirs) != len(problems):
                raise ProblemError(
                    f"{guess.problem.name!r} cannot start {self.statement.name!r}: "
                    f"it has {len(theirs)} phases, not {len(problems)}"
                )
            carried = [
                _rescaled(part, pointwise) for part, pointwise in zip(theirs, self.pointwise, strict=True)
            ]
            meshes = [
                self._mesh(problem, mesh) or part.mesh for problem, part in zip(problems, theirs, strict=True)
            ]
            links = np.zeros(len(self._links))
            if isinstance(guess, PhasedSolution) and isinstance(self.statement, Phases):
                links = _carried_links(guess, self.statement)
            return Iterates(tuple(carried), links).on(meshes)
        guesses = self._guesses(guess or {})
        iterates = [
            guessed(pointwise, self._mesh(problem, mesh) or Mesh.uniform(10, 4), given)
            if not isinstance(given, Solution)
            else _rescaled(given, pointwise).on(self._mesh(problem, mesh) or given.mesh)
            for problem, pointwise, given in zip(problems, self.pointwise, guesses, strict=True)
        ]
        return Iterates(tuple(iterates), np.zeros(len(self._links)))

    def collocated(self, meshes: Sequence[Mesh], form: str = "differential") -> Collocated:
        """Return the programme of the system on meshes of its phases."""
        return Collocated(self, meshes, form)

    @property
    def _links(self) -> Sequence[Any]:
        return self.statement.links if isinstance(self.statement, Phases) else ()

    def _mesh(self, problem: Problem, mesh: Mesh | Mapping[str, Mesh] | None) -> Mesh | None:
        if not isinstance(mesh, Mapping | Mesh | None):
            raise ProblemError(f"the mesh of {self.statement.name!r} is {mesh!r}, not an ocp.Mesh")
        if not isinstance(mesh, Mapping):
            return mesh
        names = [phase.name for phase in _phases(self.statement)]
        for name in mesh:
            if name not in names:
                raise ProblemError(unknown("phase", name, names))
        return mesh.get(problem.name)

    def _guesses(self, guess: Mapping[str, Any]) -> list[Any]:
        if isinstance(self.statement, Problem):
            return [guess]
        names = [phase.name for phase in self.statement.phases]
        for name in guess:
            if name not in names:
                raise ProblemError(f"the guess: {unknown('phase', name, names)}")
        return [guess.get(name, {}) for name in names]

    @cached_property
    def joint(self) -> tuple[EndFunctions, Array, Array]:
        """End functions of the links and of the common cost, and the links' scaled bounds."""
        assert isinstance(self.statement, Phases)
        symbols, constants, ends = zip(*map(symbolic_ends, self.pointwise), strict=True)
        at = ends_by_phase(self.statement.phases, ends)
        scale = self.statement.objective_scale
        cost = ca.SX(0) if self.statement.cost is None else ca.SX(self.statement.cost(at)) / scale
        rows = [link.expression(at) / link.size for link in self.statement.links if link.expression]
        functions = EndFunctions(
            ca.vertcat(*symbols), ca.vertcat(*constants), cost, ca.vertcat(*rows) if rows else ca.SX(0, 1)
        )
        sizes = np.array([link.size for link in self.statement.links])
        bounds = np.array([link.bounds for link in self.statement.links]).reshape(-1, 2)
        return functions, bounds[:, 0] / sizes, bounds[:, 1] / sizes


class Collocated:
    """A system on meshes: its programme, and the way from iterates to the programme's vectors and back.

    Parameters
    ----------
    system : System
        The system.
    meshes : sequence of Mesh
        One for each phase.
    form : {"differential", "integral"}
        As in `Settings`.
    """

    def __init__(self, system: System, meshes: Sequence[Mesh], form: str = "differential") -> None:
        if form not in ("differential", "integral"):
            raise ProblemError(f"form {form!r} is neither 'differential' nor 'integral'")
        self.system, self.form = system, form
        self.transcriptions = tuple(
            Transcription(pointwise, endpoints, mesh)
            for pointwise, endpoints, mesh in zip(system.pointwise, system.endpoints, meshes, strict=True)
        )
        sizes = [transcription.variables for transcription in self.transcriptions]
        self.variables = np.concatenate(([0], np.cumsum(sizes)))
        self.rows = np.concatenate(([0], np.cumsum([t.rows for t in self.transcriptions])))

    @cached_property
    def programme(self) -> Programme:
        """The nonlinear programme of all phases."""
        if self.form == "integral":
            return recombined(self.differential, self._integration)
        return self.differential

    @cached_property
    def differential(self) -> Programme:
        """The programme in the differential form (2.147)."""
        programmes = [transcription.programme() for transcription in self.transcriptions]
        if isinstance(self.system.statement, Problem):
            return programmes[0]
        functions, lower, upper = self.system.joint
        constants, parameters = [], 0
        for transcription, programme in zip(self.transcriptions, programmes, strict=True):
            constants.append(parameters + np.arange(len(transcription.pointwise.constants)))
            parameters += programme.derivatives["grad_f"].size1_in(1)
        joint = Joint(functions, self.end_index, np.concatenate(constants), lower, upper)
        return joined(programmes, joint)

    @property
    def end_index(self) -> np.ndarray:
        """Variables that the end functions of all phases read, phase by phase."""
        starts = self.variables[:-1]
        return np.concatenate(
            [start + part.end_index for start, part in zip(starts, self.transcriptions, strict=True)]
        )

    @cached_property
    def _integration(self) -> sp.csc_array:
        """Matrix from the rows of the differential form to those of the integral form (2.149)."""
        total = self.rows[-1] + len(self.system._links)
        matrix = sp.lil_array((total, total))
        matrix.setdiag(1.0)
        for transcription, first in zip(self.transcriptions, self.rows, strict=False):
            mesh = transcription.mesh
            for order, intervals in mesh.by_order():
                integration = mesh.rule.integration(order)
                for k in intervals:
                    for rows in transcription.defect_rows:
                        places = first + rows[mesh.first[k] : mesh.first[k] + order]
                        matrix[np.ix_(places, places)] = integration
        return sp.csc_array(matrix)

    def parameters(self, iterates: Iterates) -> Array:
        """Return the programme's parameters."""
        return np.concatenate(
            [
                transcription.parameter_vector(iterate.parameters)
                for transcription, iterate in zip(self.transcriptions, iterates.phases, strict=True)
            ]
        )

    def pack(self, iterates: Iterates) -> tuple[Array, Array | None, Array | None]:
        """Return variables, bound multipliers and constraint multipliers; see `iterate.pack`."""
        packed = [
            pack(iterate, transcription)
            for iterate, transcription in zip(iterates.phases, self.transcriptions, strict=True)
        ]
        x = np.concatenate([part[0] for part in packed])
        if any(part[1] is None for part in packed):
            return x, None, None
        lam_x = np.concatenate([part[1] for part in packed if part[1] is not None])
        lam_g = np.concatenate([*(part[2] for part in packed if part[2] is not None), iterates.links])
        if self.form == "integral":
            lam_g = spsolve(sp.csc_array(self._integration.T), lam_g)
        return x, lam_x, lam_g

    def unpack(self, x: Array, lam_x: Array, lam_g: Array) -> Iterates:
        """Return the iterates that the solver's vectors stand for; the inverse of `pack`."""
        if self.form == "integral":
            lam_g = self._integration.T @ lam_g
        iterates = [
            unpack(x[a:b], lam_x[a:b], lam_g[c:d], transcription)
            for transcription, a, b, c, d in zip(
                self.transcriptions,
                self.variables[:-1],
                self.variables[1:],
                self.rows[:-1],
                self.rows[1:],
                strict=True,
            )
        ]
        return Iterates(tuple(iterates), lam_g[self.rows[-1] :])


def parts(solution: AnySolution) -> tuple[Solution, ...]:
    """Return the solutions of the phases; a solution of one phase is its own part."""
    return solution.phases if isinstance(solution, PhasedSolution) else (solution,)


def iterates_of(solution: AnySolution) -> Iterates:
    """Return what a solution found, multipliers included."""
    links = solution.links if isinstance(solution, PhasedSolution) else np.empty(0)
    return Iterates(tuple(part.iterate for part in parts(solution)), links)


def _phases(statement: Statement) -> Sequence[Problem]:
    return statement.phases if isinstance(statement, Phases) else (statement,)


def _rescaled(guess: Solution, pointwise: Pointwise) -> Iterate:
    """Return a solution's iterate in the scales of another problem of the same names."""
    if guess.pointwise is pointwise:
        return guess.iterate
    ours, theirs = pointwise.problem, guess.problem
    for kind, names in ours.names.items():
        if theirs.names[kind] != names:
            raise ProblemError(f"{theirs.name!r} cannot start {ours.name!r}: their {kind} differ")
    for name, unit in ours.units.items():
        if theirs.units[name] != unit:
            raise ProblemError(
                f"{theirs.name!r} cannot start {ours.name!r}: {name} is in {theirs.units[name]} there "
                f"and in {unit} here"
            )
    return rescaled(guess.iterate, Scales.of(guess.pointwise), Scales.of(pointwise))


def _carried_links(guess: PhasedSolution, statement: Phases) -> Array:
    """Return the multipliers of the links in the scales of another problem with the same links."""
    theirs = {link.name: (link, value) for link, value in zip(guess.problem.links, guess.links, strict=True)}
    scale = guess.problem.objective_scale / statement.objective_scale
    carried = []
    for link in statement.links:
        if link.name not in theirs:
            carried.append(0.0)
            continue
        other, value = theirs[link.name]
        carried.append(value * scale * link.size / other.size)
    return np.array(carried)
