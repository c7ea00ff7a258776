"""Numerical optimal control by multi-interval Legendre–Gauss–Radau collocation."""

from thesislib.ocp import optimality, quadrature, sensitivity, storage
from thesislib.ocp.mesh import Mesh
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
from thesislib.ocp.refinement import refined
from thesislib.ocp.simulation import Simulation, simulate
from thesislib.ocp.solution import MeshRecord, Solution
from thesislib.ocp.solver import Settings, SolveError, solve

__all__ = [
    "Boundary",
    "Control",
    "Ends",
    "Equations",
    "Independent",
    "Integral",
    "Mesh",
    "MeshRecord",
    "Parameter",
    "Path",
    "Point",
    "Problem",
    "ProblemError",
    "Settings",
    "Simulation",
    "Solution",
    "SolveError",
    "State",
    "optimality",
    "quadrature",
    "refined",
    "sensitivity",
    "simulate",
    "solve",
    "storage",
]
