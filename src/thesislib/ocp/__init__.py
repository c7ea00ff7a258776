"""Numerical optimal control by multi-interval Legendre–Gauss–Radau collocation."""

from thesislib.ocp import kkt, optimality, quadrature, sensitivity, storage, transversality
from thesislib.ocp.failure import SolveError
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.phased import PhasedSolution
from thesislib.ocp.phases import Link, Phases, continuous, divided
from thesislib.ocp.problem import (
    Boundary,
    Control,
    Ends,
    Equations,
    Independent,
    Integral,
    Parameter,
    Path,
    Point,
    Problem,
    ProblemError,
    State,
)
from thesislib.ocp.refinement import coarsened, refined
from thesislib.ocp.related import Related
from thesislib.ocp.settings import Progress, Settings
from thesislib.ocp.simulation import Simulation, simulate
from thesislib.ocp.solution import MeshRecord, Solution
from thesislib.ocp.solver import solve

__all__ = [
    "Boundary",
    "Control",
    "Ends",
    "Equations",
    "Independent",
    "Integral",
    "Link",
    "Mesh",
    "MeshRecord",
    "Parameter",
    "Path",
    "PhasedSolution",
    "Phases",
    "Point",
    "Problem",
    "ProblemError",
    "Progress",
    "Related",
    "Settings",
    "Simulation",
    "Solution",
    "SolveError",
    "State",
    "coarsened",
    "continuous",
    "divided",
    "kkt",
    "optimality",
    "quadrature",
    "refined",
    "sensitivity",
    "simulate",
    "solve",
    "storage",
    "transversality",
]
