"""Solutions of problems of several phases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from thesislib.ocp.phases import Phases
from thesislib.ocp.problem import ProblemError, unknown
from thesislib.ocp.quadrature import Array
from thesislib.ocp.solution import MeshRecord, Solution, summarised


@dataclass(frozen=True, eq=False)
class PhasedSolution:
    """A solution of several phases; `solution["boost"]["v"]` is a state in one of them.

    Attributes
    ----------
    problem : Phases
        The problem.
    phases : tuple of Solution
        The solutions of the phases, in order. The objective of each is its own share.
    links : ndarray, shape (n_l,)
        Scaled multipliers of the links.
    objective : float
        The objective without the regulariser.
    history : tuple of MeshRecord
        One entry per mesh, the points of all phases together.
    converged : bool
        False for a best iterate that the caller asked for though the solve failed.
    stopped : str
        Why the refinement ended.
    """

    problem: Phases
    phases: tuple[Solution, ...]
    links: Array
    objective: float
    history: tuple[MeshRecord, ...]
    converged: bool
    stopped: str = ""

    def __getitem__(self, name: str) -> Solution:
        names = [phase.name for phase in self.problem.phases]
        if name not in names:
            raise ProblemError(unknown("phase", name, names))
        return self.phases[names.index(name)]

    @property
    def regularisation(self) -> float:
        """The regulariser (2.171) of all phases, in units of the objective."""
        return sum(phase.regularisation for phase in self.phases)

    @property
    def error(self) -> float:
        """Largest relative state error (2.162) of all phases."""
        return max(phase.error for phase in self.phases)

    @property
    def tolerance(self) -> float:
        """The error that was asked for."""
        return self.phases[0].tolerance

    @property
    def status(self) -> str:
        """What the solver returned on the last mesh."""
        return self.history[-1].status

    @property
    def compiled(self) -> bool:
        """Whether the derivatives of every phase ran as compiled code."""
        return all(phase.compiled for phase in self.phases)

    def link_multiplier(self, name: str) -> float:
        """Return the multiplier of a link, in units of the objective per unit of the link.

        The objective falls by it where the link's upper bound rises by one.
        """
        names = [link.name for link in self.problem.links]
        if name not in names:
            raise ProblemError(unknown("link", name, names))
        index = names.index(name)
        return float(self.links[index] * self.problem.objective_scale / self.problem.links[index].size)

    def along(self, name: str) -> tuple[Array, Array]:
        """Return the independent variable and a state or control through all phases, one after another.

        Parameters
        ----------
        name : str
            A state or control that every phase has.

        Returns
        -------
        places, values : ndarray
            A state at the nodes, a control at the collocation points.
        """
        places, values = [], []
        for phase in self.phases:
            is_state = any(state.name == name for state in phase.problem.states)
            places.append(phase.nodes if is_state else phase.points)
            values.append(phase.at_nodes(name) if is_state else phase[name])
        return np.concatenate(places), np.concatenate(values)

    def summary(self) -> dict[str, Any]:
        """Return how the solution was found, as plain numbers and strings."""
        return summarised(self)
