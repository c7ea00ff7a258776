"""The published problems in the words of `thesislib.ocp`, solved and measured."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from thesislib import ocp
from thesislib.classical.benchmarks.problems import Statement, Variable


def problem_of(statement: Statement) -> ocp.Problem:
    """Return a published problem for `ocp.solve`; its scales are those of the bounds."""
    cost = "cost" if statement.end_cost is None else None

    def equations(at: ocp.Point) -> ocp.Equations:
        rates = statement.equations(ca, at)
        return ocp.Equations(rates.derivatives, rates.path, {"cost": rates.cost} if cost else {})

    def mayer(ends: ocp.Ends) -> Any:
        assert statement.end_cost is not None
        name, factor = statement.end_cost
        return factor * ends.final[name]

    turned = {name: gain for name, gain in statement.gains.items() if gain != 0}
    return ocp.Problem(
        name=statement.name,
        independent=ocp.Independent("t", 0.0, statement.final),
        states=[ocp.State(v.name, v.unit, v.bounds) for v in statement.states],
        controls=[ocp.Control(v.name, v.unit, v.bounds) for v in statement.controls],
        parameters=[ocp.Parameter(v.name, v.unit, v.bounds) for v in statement.parameters],
        equations=equations,
        lagrange=cost,
        mayer=None if cost else mayer,
        path=[ocp.Path(v.name, v.unit, v.bounds) for v in statement.path],
        boundary=[ocp.Boundary(f"gain of {name}", "-", (gain, gain)) for name, gain in turned.items()],
        boundary_equations=(
            (lambda ends: {f"gain of {name}": ends.final[name] - ends.initial[name] for name in turned})
            if turned
            else None
        ),
        initial={v.name: v.initial for v in statement.states if v.initial is not None},
        terminal={v.name: v.terminal for v in statement.states if v.terminal is not None},
        periodic=[name for name, gain in statement.gains.items() if gain == 0],
    )


def guess_of(statement: Statement) -> dict[str, Any]:
    """Return the statement's guess: functions of time for states and controls, numbers for the rest."""
    end = statement.final_guess if isinstance(statement.final, tuple) else statement.final

    def along(variable: Variable) -> Callable[[np.ndarray], np.ndarray]:
        return lambda t: np.array([variable.guess_at(float(fraction)) for fraction in t / end])

    guess: dict[str, Any] = {v.name: along(v) for v in (*statement.states, *statement.controls)}
    guess |= {v.name: v.guess_at(0.0) for v in statement.parameters}
    if isinstance(statement.final, tuple):
        guess["t_final"] = end
    return guess
