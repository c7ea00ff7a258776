"""The published problems in the words of pockit: Radau collocation, its own refinement, Numba derivatives."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import protocol
import sympy
from pockit.optimizer import ipopt
from pockit.radau import System, constant_guess

LIMITS = {
    "absolute_tolerance_continuous": protocol.MESH_TOLERANCE,
    "relative_tolerance_continuous": protocol.MESH_TOLERANCE,
}
# no shorter interval is refined; pockit's own 1e-3 is a whole layer of the hypersensitive problem
SHORTEST = 1e-6


def solve(statement: Any) -> protocol.Outcome:
    system, phase = stated(statement)
    guess = constant_guess(phase, 0.0)
    for k, v in enumerate(statement.states):
        guess.x[k] = [v.guess_at(f) for f in guess._t_x]
    for k, v in enumerate(statement.controls):
        guess.u[k] = [v.guess_at(f) for f in guess._t_u]
    free = isinstance(statement.final, tuple)
    guess.t_0, guess.t_f = 0.0, statement.final_guess if free else statement.final
    values = static_guess(statement)
    start = [guess, np.array(list(values.values()))] if values else guess
    options = {"tol": protocol.NLP_TOLERANCE, "max_iter": protocol.NLP_ITERATIONS, "print_level": 0}
    for meshes in range(1, protocol.MESHES + 1):
        found, info = ipopt.solve(system, start, options)
        converged = info["status"] == 0 and bool(system.check(found, tolerance_mesh=SHORTEST, **LIMITS))
        if converged or info["status"] not in (0, 1) or meshes == protocol.MESHES:
            break
        start = system.refine(
            found,
            num_point_min=protocol.LOWEST,
            num_point_max=protocol.HIGHEST,
            mesh_length_min=SHORTEST,
            **LIMITS,
        )
    said = info["status_msg"].decode() if info["status"] else f"above tolerance after {meshes} meshes"
    return protocol.Outcome(
        objective=float(info["obj_val"]),
        points=int(np.sum(phase._num_point)),
        intervals=len(phase._num_point),
        meshes=meshes,
        converged=converged,
        reason="" if converged else said,
    )


def static_guess(statement: Any) -> dict[str, float]:
    """Return a guess for every static parameter: the statement's own, and those that tie the ends."""
    values = {v.name: v.guess_at(0.0) for v in statement.parameters}
    states = {v.name: v for v in statement.states}
    values |= {f"{name} at the start": states[name].guess_at(0.0) for name in statement.gains}
    if statement.end_cost is not None and statement.end_cost[0] not in values:
        name = statement.end_cost[0]
        values["cost"] = statement.final_guess if name == "t" else states[name].guess_at(1.0)
    return values


def stated(statement: Any) -> tuple[Any, Any]:
    """Return the problem as a pockit system of one phase."""
    values = static_guess(statement)
    system = System(list(values))
    static = dict(zip(values, system.s, strict=True))
    phase = system.new_phase([v.name for v in statement.states], [v.name for v in statement.controls])
    names = [v.name for v in (*statement.states, *statement.controls)]
    symbols = dict(zip(names, (*phase.x, *phase.u), strict=True))
    own = {v.name: static[v.name] for v in statement.parameters}
    rates = statement.equations(sympy, SimpleNamespace(t=phase.t, **symbols, **own))
    phase.set_dynamics([rates.derivatives[v.name] for v in statement.states])
    if statement.end_cost is None:
        phase.set_integral([rates.cost])
    bounded = [(symbols[v.name], v.bounds) for v in (*statement.states, *statement.controls)]
    bounded += [(own[v.name], v.bounds) for v in statement.parameters]
    bounded += [(rates.path[v.name], v.bounds) for v in statement.path]
    if isinstance(statement.final, tuple):
        bounded.append((phase.t, (0.0, statement.final[1])))
    phase.set_phase_constraint(
        [expression for expression, _ in bounded],
        [float(bounds[0]) for _, bounds in bounded],
        [float(bounds[1]) for _, bounds in bounded],
    )
    first, last = ends(statement, static)
    name, factor = statement.end_cost or ("", 1.0)
    final = None if isinstance(statement.final, tuple) else float(statement.final)
    phase.set_boundary_condition(first, last, 0.0, static["cost"] if name == "t" else final)
    phase.set_discretization(protocol.INTERVALS, protocol.POINTS)
    system.set_phase([phase])
    system.set_objective(factor * static[name if name in own else "cost"] if name else phase.I[0])
    return system, phase


def ends(statement: Any, static: dict[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the states' values at both ends; what is linked or costs is a static parameter."""
    first, last = [], []
    for v in statement.states:
        initial = None if v.initial is None else float(v.initial)
        terminal = None if v.terminal is None else float(v.terminal)
        if v.name in statement.gains:
            initial = static[f"{v.name} at the start"]
            terminal = initial + statement.gains[v.name]
        if statement.end_cost is not None and statement.end_cost[0] == v.name:
            terminal = static["cost"]
        first.append(initial)
        last.append(terminal)
    return first, last


if __name__ == "__main__":
    names = ("pockit-optimal-control", "numba", "sympy", "cyipopt-wheels", "numpy", "scipy")
    protocol.answer("pockit", names, solve)
