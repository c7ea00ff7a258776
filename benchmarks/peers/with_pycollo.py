"""The published problems in the words of pycollo: Lobatto collocation, its own mesh and scaling."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import protocol
import pycollo
import sympy


def solve(statement: Any) -> protocol.Outcome:
    problem = stated(statement)
    problem.initialise()
    problem.solve()
    iterations = problem._backend.mesh_iterations  # the public property fails in 0.1.6
    last = iterations[-1]
    errors = last.solution.mesh_refinement.maximum_relative_mesh_errors
    return protocol.Outcome(
        objective=float(problem.solution.objective),
        points=int(last.mesh.N[0]),
        intervals=int(last.mesh.K[0]),
        meshes=len(iterations),
        error=float(np.max(errors[0])),
        converged=bool(problem.mesh_tolerance_met),
        reason="" if problem.mesh_tolerance_met else f"above tolerance after {protocol.MESHES} meshes",
    )


def stated(statement: Any) -> pycollo.OptimalControlProblem:
    """Return the problem in pycollo's form."""
    problem = pycollo.OptimalControlProblem(name=statement.name)
    # pycollo keeps a few short names for itself, t0 and tF among them
    symbols = {
        v.name: sympy.Symbol(f"{v.name}_")
        for v in (*statement.states, *statement.controls, *statement.parameters)
    }
    states = [symbols[v.name] for v in statement.states]
    controls = [symbols[v.name] for v in statement.controls]
    phase = problem.new_phase(name="A", state_variables=states, control_variables=controls)
    rates = statement.equations(sympy, SimpleNamespace(t=TIME, **symbols))
    phase.state_equations = {symbols[name]: sympy.sympify(rate) for name, rate in rates.derivatives.items()}
    free = isinstance(statement.final, tuple)
    end = statement.final_guess if free else statement.final
    phase.bounds.initial_time = 0.0
    phase.bounds.final_time = list(statement.final) if free else float(statement.final)
    phase.bounds.state_variables = {symbols[v.name]: list(v.bounds) for v in statement.states}
    phase.bounds.control_variables = {symbols[v.name]: list(v.bounds) for v in statement.controls}
    phase.bounds.initial_state_constraints = {
        symbols[v.name]: float(v.initial) for v in statement.states if v.initial is not None
    }
    phase.bounds.final_state_constraints = {
        symbols[v.name]: float(v.terminal) for v in statement.states if v.terminal is not None
    }
    fractions = np.linspace(0, 1, 50)
    phase.guess.time = fractions * end
    phase.guess.state_variables = np.array([[v.guess_at(f) for f in fractions] for v in statement.states])
    phase.guess.control_variables = np.array([[v.guess_at(f) for f in fractions] for v in statement.controls])
    if statement.path:
        phase.path_constraints = [rates.path[v.name] for v in statement.path]
        phase.bounds.path_constraints = [finite(v.bounds) for v in statement.path]
    if statement.parameters:
        problem.parameter_variables = [symbols[v.name] for v in statement.parameters]
        problem.bounds.parameter_variables = {symbols[v.name]: list(v.bounds) for v in statement.parameters}
        problem.guess.parameter_variables = [v.guess_at(0.0) for v in statement.parameters]
    if statement.gains:
        problem.endpoint_constraints = [
            phase.final_state_variables[k] - phase.initial_state_variables[k] - statement.gains[v.name]
            for k, v in enumerate(statement.states)
            if v.name in statement.gains
        ]
        problem.bounds.endpoint_constraints = [0.0] * len(statement.gains)
    set_objective(problem, phase, statement, rates, symbols)
    phase.mesh.number_mesh_sections = protocol.INTERVALS
    phase.mesh.number_mesh_section_nodes = protocol.POINTS
    settings = problem.settings
    settings.mesh_tolerance, settings.max_mesh_iterations = protocol.MESH_TOLERANCE, protocol.MESHES
    settings.nlp_tolerance, settings.max_nlp_iterations = protocol.NLP_TOLERANCE, protocol.NLP_ITERATIONS
    settings.collocation_points_min, settings.collocation_points_max = protocol.LOWEST, protocol.HIGHEST
    return problem


def set_objective(problem: Any, phase: Any, statement: Any, rates: Any, symbols: Any) -> None:
    if statement.end_cost is None:
        phase.integrand_functions = [rates.cost]
        phase.bounds.integral_variables = [[-1e6, 1e6]]
        phase.guess.integral_variables = np.array([1.0])
        problem.objective_function = phase.integral_variables[0]
        return
    name, factor = statement.end_cost
    ends = dict(zip([v.name for v in statement.states], phase.final_state_variables, strict=True))
    ends |= {v.name: symbols[v.name] for v in statement.parameters} | {"t": phase.final_time_variable}
    problem.objective_function = factor * ends[name]


def finite(bounds: tuple[float, float]) -> list[float]:
    """Return bounds with a large number for infinity, as pycollo wants them."""
    return [float(np.clip(bound, -1e6, 1e6)) for bound in bounds]


# time cannot stand in pycollo's equations: a problem that needs it fails, and says so
TIME = sympy.Symbol("time")

if __name__ == "__main__":
    protocol.answer("pycollo", ("pycollo", "casadi", "sympy", "numpy", "scipy"), solve)
