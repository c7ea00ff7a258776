"""The published problems in the words of yapss: Radau collocation on a fixed mesh."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import protocol
import yapss
from yapss import math

# yapss keeps the mesh that it is given: ten intervals of ten points stand for a user's choice
INTERVALS, POINTS = 10, 10


def solve(statement: Any) -> protocol.Outcome:
    free = isinstance(statement.final, tuple)
    has_cost = statement.end_cost is None
    problem = yapss.Problem(
        name=statement.name,
        nx=[len(statement.states)],
        nu=[len(statement.controls)],
        nq=[int(has_cost)],
        nh=[len(statement.path)],
        ns=len(statement.parameters),
        nd=len(statement.gains),
    )
    register(problem, statement)
    bounds = problem.bounds.phase[0]
    bounds.initial_time.lower = bounds.initial_time.upper = 0.0
    bounds.final_time.lower, bounds.final_time.upper = statement.final if free else (statement.final,) * 2
    for k, v in enumerate(statement.states):
        bounds.state.lower[k], bounds.state.upper[k] = v.bounds
        for end, value in ((bounds.initial_state, v.initial), (bounds.final_state, v.terminal)):
            if value is not None:
                end.lower[k] = end.upper[k] = value
    for k, v in enumerate(statement.controls):
        bounds.control.lower[k], bounds.control.upper[k] = v.bounds
    for k, v in enumerate(statement.path):
        bounds.path.lower[k], bounds.path.upper[k] = v.bounds
    for k, v in enumerate(statement.parameters):
        problem.bounds.parameter.lower[k], problem.bounds.parameter.upper[k] = v.bounds
    for k, gain in enumerate(statement.gains.values()):
        problem.bounds.discrete.lower[k] = problem.bounds.discrete.upper[k] = gain
    fractions = np.linspace(0, 1, INTERVALS * POINTS)
    guess = problem.guess.phase[0]
    guess.time = fractions * (statement.final_guess if free else statement.final)
    guess.state = [[v.guess_at(f) for f in fractions] for v in statement.states]
    guess.control = [[v.guess_at(f) for f in fractions] for v in statement.controls]
    if statement.parameters:
        problem.guess.parameter = [v.guess_at(0.0) for v in statement.parameters]
    problem.mesh.phase[0].collocation_points = INTERVALS * (POINTS,)
    problem.mesh.phase[0].fraction = INTERVALS * (1.0 / INTERVALS,)
    problem.spectral_method = "lgr"
    problem.derivatives.method, problem.derivatives.order = "auto", "second"
    problem.ipopt_options.tol = protocol.NLP_TOLERANCE
    problem.ipopt_options.max_iter = protocol.NLP_ITERATIONS
    problem.ipopt_options.print_level = 0
    found = problem.solve()
    status = found.nlp_info.ipopt_status
    return protocol.Outcome(
        objective=float(found.objective),
        points=INTERVALS * POINTS,
        intervals=INTERVALS,
        meshes=1,
        converged=status == 0,
        reason="" if status == 0 else str(found.nlp_info.ipopt_status_message),
    )


def register(problem: yapss.Problem, statement: Any) -> None:
    """Give the problem's functions to yapss."""
    names = [v.name for v in statement.states]

    def continuous(arg: yapss.ContinuousArg) -> None:
        phase = arg.phase[0]
        at = dict(zip(names, phase.state, strict=True))
        at |= dict(zip([v.name for v in statement.controls], phase.control, strict=True))
        at |= dict(zip([v.name for v in statement.parameters], arg.parameter, strict=True))
        rates = statement.equations(math, SimpleNamespace(t=phase.time, **at))
        phase.dynamics[:] = tuple(rates.derivatives[name] for name in names)
        if statement.path:
            phase.path[:] = tuple(rates.path[v.name] for v in statement.path)
        if statement.end_cost is None:
            phase.integrand[0] = rates.cost

    def objective(arg: yapss.ObjectiveArg) -> None:
        if statement.end_cost is None:
            arg.objective = arg.phase[0].integral[0]
            return
        name, factor = statement.end_cost
        if name == "t":
            arg.objective = factor * arg.phase[0].final_time
        elif name in names:
            arg.objective = factor * arg.phase[0].final_state[names.index(name)]
        else:
            arg.objective = factor * arg.parameter[[v.name for v in statement.parameters].index(name)]

    def discrete(arg: yapss.DiscreteArg) -> None:
        first, last = arg.phase[0].initial_state, arg.phase[0].final_state
        arg.discrete[:] = tuple(
            last[names.index(name)] - first[names.index(name)] for name in statement.gains
        )

    problem.functions.continuous = continuous
    problem.functions.objective = objective
    if statement.gains:
        problem.functions.discrete = discrete


if __name__ == "__main__":
    protocol.answer("yapss", ("yapss", "casadi", "numpy", "scipy"), solve)
