"""The published problems in the words of maptor: Radau collocation with its own adaptive mesh."""

from __future__ import annotations

from math import isfinite
from types import SimpleNamespace
from typing import Any

import casadi as ca
import maptor
import numpy as np
import protocol
from numpy.polynomial import legendre


def solve(statement: Any) -> protocol.Outcome:
    problem = maptor.Problem(statement.name)
    phase = problem.set_phase(1)
    time = phase.time(initial=0.0, final=statement.final)
    states = {
        v.name: phase.state(v.name, initial=v.initial, final=v.terminal, boundary=v.bounds)
        for v in statement.states
    }
    controls = {v.name: phase.control(v.name, boundary=v.bounds) for v in statement.controls}
    parameters = {v.name: problem.parameter(v.name, boundary=v.bounds) for v in statement.parameters}
    rates = statement.equations(ca, SimpleNamespace(t=time, **states, **controls, **parameters))
    phase.dynamics({states[name]: rate for name, rate in rates.derivatives.items()})
    limits = [side for v in statement.path for side in sides(rates.path[v.name], v.bounds)]
    if limits:
        phase.path_constraints(*limits)
    gains = [states[name].final - states[name].initial == gain for name, gain in statement.gains.items()]
    if gains:
        phase.event_constraints(*gains)
    problem.minimize(objective(statement, phase, rates, time, states, parameters))
    phase.mesh([protocol.POINTS] * protocol.INTERVALS, np.linspace(-1, 1, protocol.INTERVALS + 1))
    guess(statement, phase, problem)
    found = maptor.solve_adaptive(
        problem,
        error_tolerance=protocol.MESH_TOLERANCE,
        max_iterations=protocol.MESHES,
        min_polynomial_degree=protocol.LOWEST,
        max_polynomial_degree=protocol.HIGHEST,
        nlp_options={
            "ipopt.print_level": 0,
            "ipopt.tol": protocol.NLP_TOLERANCE,
            "ipopt.max_iter": protocol.NLP_ITERATIONS,
        },
        show_summary=False,
    )
    history = found.adaptive["benchmark"]
    return protocol.Outcome(
        objective=float(found.status["objective"]),
        points=history["collocation_points"][-1],
        intervals=history["mesh_intervals"][-1],
        meshes=len(history["mesh_iteration"]),
        error=float(history["estimated_error"][-1]),
        converged=bool(found.adaptive["converged"] and found.status["success"]),
        reason="" if found.adaptive["converged"] else str(found.status["message"]),
    )


def sides(expression: ca.MX, bounds: tuple[float, float]) -> list[ca.MX]:
    low = [expression >= bounds[0]] if isfinite(bounds[0]) else []
    return low + ([expression <= bounds[1]] if isfinite(bounds[1]) else [])


def objective(statement: Any, phase: Any, rates: Any, time: Any, states: Any, parameters: Any) -> ca.MX:
    if statement.end_cost is None:
        return phase.add_integral(rates.cost)
    name, factor = statement.end_cost
    if name == "t":
        return factor * time.final
    return factor * (states[name].final if name in states else parameters[name])


def guess(statement: Any, phase: Any, problem: Any) -> None:
    """Give the guess at the nodes of the first mesh, interval by interval."""
    n = protocol.POINTS
    collocation = np.sort(legendre.legroots([0.0] * (n - 1) + [1.0, 1.0]))
    starts = np.arange(protocol.INTERVALS) / protocol.INTERVALS

    def along(variables: Any, points: np.ndarray) -> list[np.ndarray]:
        fractions = 0.5 * (1 + points) / protocol.INTERVALS
        return [np.array([[v.guess_at(start + f) for f in fractions] for v in variables]) for start in starts]

    phase.guess(
        states=along(statement.states, np.append(collocation, 1.0)),
        controls=along(statement.controls, collocation),
        initial_time=0.0,
        terminal_time=statement.final_guess if isinstance(statement.final, tuple) else statement.final,
        integrals=1.0 if statement.end_cost is None else None,
    )
    problem.parameter_guess(**{v.name: v.guess_at(0.0) for v in statement.parameters})


if __name__ == "__main__":
    protocol.answer("maptor", ("maptor", "casadi", "numpy", "scipy"), solve)
