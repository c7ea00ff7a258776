"""The first-order system of the collocated problem at a solution: its residuals and its matrix."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from thesislib.ocp.factors import Factors
from thesislib.ocp.problem import ProblemError, Quantity
from thesislib.ocp.quadrature import Array
from thesislib.ocp.system import AnySolution, Collocated, System, iterates_of, parts

# IPOPT lets every bound give way by this part of it, or by this where the bound is below one.
RELAXED = 1e-8

# A multiplier below this, scaled, holds nothing.
IDLE = 1e-14


@dataclass(frozen=True)
class Stationarity:
    """By how much the Lagrangian's derivative with respect to one quantity is not zero.

    Attributes
    ----------
    quantity : str
        A state, control, parameter or partial sum.
    place : str
        Where the residual is largest.
    amount : float
        The residual there, in units of the objective per `unit`.
    unit : str
        Unit of the quantity.
    scaled : float
        The residual as the solver sees it.
    """

    quantity: str
    place: str
    amount: float
    unit: str
    scaled: float


class FirstOrder:
    """The programme of a solution, evaluated there.

    Parameters
    ----------
    solution : Solution or PhasedSolution
        A solution with its multipliers.

    Attributes
    ----------
    collocated : Collocated
        Where everything stands.
    x, lam_x, lam_g : ndarray
        Variables, bound multipliers and multipliers of the constraints.
    gradient : ndarray, shape (n,)
        Of the objective.
    jacobian : scipy.sparse array, shape (m, n)
        Of the constraints.

    Raises
    ------
    ProblemError
        If the solution has no multipliers.
    """

    def __init__(self, solution: AnySolution) -> None:
        self.solution = solution
        iterates = iterates_of(solution)
        self.collocated: Collocated = System.solved(solution).collocated(iterates.meshes)
        x, lam_x, lam_g = self.collocated.pack(iterates)
        if lam_x is None or lam_g is None:
            raise ProblemError(f"the solution of {solution.problem.name!r} has no multipliers")
        self.x, self.lam_x, self.lam_g = x, lam_x, lam_g
        self.programme = self.collocated.programme
        self.parameters = self.collocated.parameters(iterates)
        derivatives = self.programme.derivatives
        self.gradient = np.array(derivatives["grad_f"](x, self.parameters)[1]).ravel()
        g, jacobian = derivatives["jac_g"](x, self.parameters)
        self.g, self.jacobian = np.array(g).ravel(), sp.csc_array(jacobian.sparse())

    @property
    def residual(self) -> Array:
        """Derivative of the Lagrangian, bound multipliers included, by every variable, shape (n,)."""
        return np.asarray(self.gradient + self.jacobian.T @ self.lam_g + self.lam_x)

    def stationarity(self) -> list[Stationarity]:
        """Return the largest residual of every quantity, in units of the objective per unit of it."""
        return list(self._stationarity())

    def _stationarity(self) -> Iterator[Stationarity]:
        residual = self.residual
        fixed = self.programme.lower == self.programme.upper
        residual = np.where(fixed, 0.0, residual)  # what is fixed has no derivative to vanish
        for part, transcription, first in zip(
            parts(self.solution), self.collocated.transcriptions, self.collocated.variables, strict=False
        ):
            problem = part.problem
            prefix = "" if part is self.solution else f"{problem.name}: "
            unit, name = problem.independent.unit, problem.independent.name
            groups: list[tuple[Quantity, np.ndarray, Array]] = [
                (state, index, part.nodes)
                for state, index in zip(problem.states, transcription.node_index, strict=True)
            ]
            controls = transcription.point_index[len(problem.states) :]
            groups += [
                (control, index, part.points)
                for control, index in zip(problem.controls, controls, strict=True)
            ]
            groups += [
                (parameter, np.array([index]), np.empty(0))
                for parameter, index in zip(
                    problem.all_parameters, transcription.parameter_index, strict=True
                )
            ]
            for quantity, index, places in groups:
                ours = np.abs(residual[first + index])
                at = int(ours.argmax())
                place = f"{name} = {places[at]:.4g} {unit}" if len(places) else "whole range"
                scale = problem.objective_scale / quantity.size
                scaled = float(ours[at])
                yield Stationarity(f"{prefix}{quantity.name}", place, scaled * scale, quantity.unit, scaled)

    @cached_property
    def free(self) -> np.ndarray:
        """Which variables are free: those whose bounds differ."""
        return self.programme.lower < self.programme.upper

    @cached_property
    def stiffness(self) -> Array:
        """How stiffly bounds hold the variables, Σ, shape (n,): multiplier over distance."""
        return _stiffness(self.x, self.programme.lower, self.programme.upper, self.lam_x)

    @cached_property
    def matrix(self) -> sp.csc_array:
        """Matrix of the first-order system in the free variables and all multipliers, symmetric.

        It is that of the primal-dual system of an interior point method at the solution,
        [[W + Σ, Jᵀ], [J, -D]]: Σ holds the variables that are at bounds and D frees the constraints
        that are not.
        """
        programme, free = self.programme, self.free
        hessian = programme.derivatives["hess_lag"](self.x, self.parameters, 1.0, self.lam_g)
        upper = sp.csc_array(hessian.sparse())
        whole = upper + sp.triu(upper, 1).T
        equation = programme.rows_lower == programme.rows_upper
        rows = _stiffness(self.g, programme.rows_lower, programme.rows_upper, self.lam_g)
        slack = np.where(equation, 0.0, 1.0 / np.maximum(rows, IDLE))
        block = sp.csc_array(whole)[free][:, free] + sp.diags_array(self.stiffness[free])
        jacobian = self.jacobian[:, free]
        return sp.block_array([[block, jacobian.T], [jacobian, -sp.diags_array(slack)]], format="csc")

    @cached_property
    def factors(self) -> Factors:
        """Factors of the matrix, made when they are first asked for and then kept."""
        return Factors(self.matrix, int(self.free.sum()))

    def solve(self, by_variables: Array, by_rows: Array) -> tuple[Array, Array]:
        """Return how variables and multipliers answer to a change of the first-order system.

        Parameters
        ----------
        by_variables : ndarray, shape (n,)
            Change of the Lagrangian's derivative at fixed variables and multipliers.
        by_rows : ndarray, shape (m,)
            Change of the constraints.

        Returns
        -------
        dx : ndarray, shape (n,)
        dlam : ndarray, shape (m,)

        Raises
        ------
        ProblemError
            If the system is singular.
        """
        answer = self.factors.solve(-np.concatenate((by_variables[self.free], by_rows)))
        dx = np.zeros(len(self.x))
        dx[self.free] = answer[: int(self.free.sum())]
        return dx, answer[int(self.free.sum()) :]


def _stiffness(values: Array, lower: Array, upper: Array, multipliers: Array) -> Array:
    """Return multiplier over distance of the bound that pushes: how stiffly it holds its variable."""
    relaxed_low = lower - RELAXED * np.maximum(1.0, np.abs(lower))
    relaxed_high = upper + RELAXED * np.maximum(1.0, np.abs(upper))
    distance = np.where(multipliers > 0, relaxed_high - values, values - relaxed_low)
    finite = np.isfinite(distance)
    safe = np.maximum(np.where(finite, distance, 1.0), np.finfo(float).eps)
    return np.where(finite, np.abs(multipliers) / safe, 0.0)
