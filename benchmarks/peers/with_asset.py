"""The published problems in the words of ASSET: Lobatto collocation, its own mesh and solver."""

from __future__ import annotations

from math import isfinite
from types import SimpleNamespace
from typing import Any

import asset_asrl
import numpy as np
import protocol

vf, oc = asset_asrl.VectorFunctions, asset_asrl.OptimalControl
NODES = 3  # of a segment of "LGL5", the last of which is the next one's first


def solve(statement: Any) -> protocol.Outcome:
    phase = stated(statement)
    phase.setAdaptiveMesh(True)
    phase.setMeshTol(protocol.MESH_TOLERANCE)
    phase.setMaxMeshIters(protocol.MESHES)
    phase.PrintMeshInfo = False
    phase.setThreads(1, 1)
    optimizer = phase.optimizer
    optimizer.QPThreads = 1
    optimizer.set_PrintLevel(3)
    optimizer.set_MaxIters(protocol.NLP_ITERATIONS)
    # without a line search it diverges from these guesses, or gives no answer, more often
    optimizer.set_OptLSMode("L1")
    optimizer.set_MaxLSIters(2)
    optimizer.set_tols(*[protocol.NLP_TOLERANCE] * 4)
    flag = phase.optimize()
    if not phase.getMeshIters():
        return protocol.Outcome(reason=f"{flag} on the first mesh")
    last = phase.getMeshIters()[-1]
    # its "acceptable" is a step that has become short near the optimum, and counts
    converged = bool(phase.MeshConverged) and str(flag).endswith((".CONVERGED", ".ACCEPTABLE"))
    return protocol.Outcome(
        objective=float(optimizer.LastObjVal),
        points=(NODES - 1) * int(last.numsegs) + 1,
        intervals=int(last.numsegs),
        meshes=len(phase.getMeshIters()),
        error=float(last.max_error),
        converged=converged,
        reason="" if converged else f"{flag}, mesh converged: {phase.MeshConverged}",
    )


def stated(statement: Any) -> Any:
    """Return the problem as a phase with its guess."""
    states, controls = [v.name for v in statement.states], [v.name for v in statement.controls]
    place = {name: k for k, name in enumerate((*states, "t", *controls))}
    own = [v.name for v in statement.parameters]

    def arguments(args: Any) -> SimpleNamespace:
        """Name the elements of the vector [states, t, controls, parameters]."""
        return SimpleNamespace(**{name: args[k] for k, name in enumerate((*place, *own))})

    args = vf.Arguments(len(place) + len(own))
    rates = statement.equations(vf, arguments(args))
    ode = oc.ODEBase(
        vf.stack([rates.derivatives[name] for name in states]), len(states), len(controls), len(own)
    )
    phase = ode.phase("LGL5")
    free = isinstance(statement.final, tuple)
    end = statement.final_guess if free else statement.final
    fractions = np.linspace(0, 1, 50)
    along = [*statement.states, None, *statement.controls, *statement.parameters]
    values = [[f * end if v is None else v.guess_at(f) for v in along] for f in fractions]
    phase.setTraj([np.array(row, dtype=float) for row in values], protocol.INTERVALS)
    for v in (*statement.states, *statement.controls):
        phase.addLUVarBound("Path", place[v.name], *v.bounds)
    for k, v in enumerate(statement.parameters):
        phase.addLUVarBound("ODEParams", k, *v.bounds)
    for v in statement.states:
        for where, value in (("First", v.initial), ("Last", v.terminal)):
            if value is not None:
                phase.addBoundaryValue(where, place[v.name], float(value))
    phase.addBoundaryValue("First", place["t"], 0.0)
    if free:
        phase.addLUVarBound("Last", place["t"], *statement.final)
    else:
        phase.addBoundaryValue("Last", place["t"], float(statement.final))
    for name, gain in statement.gains.items():
        phase.addDeltaVarEqualCon(place[name], float(gain))
    everything = list(range(len(place)))
    for v in statement.path:
        limit(phase, rates.path[v.name], v.bounds, everything)
    if statement.end_cost is None:
        phase.addIntegralObjective(rates.cost, everything)
    elif statement.end_cost[0] in own:
        phase.addValueObjective("ODEParams", own.index(statement.end_cost[0]), statement.end_cost[1])
    else:
        phase.addValueObjective("Last", place[statement.end_cost[0]], statement.end_cost[1])
    return phase


def limit(phase: Any, expression: Any, bounds: tuple[float, float], variables: list[int]) -> None:
    """Keep an expression within bounds along the phase."""
    low, high = bounds
    inputs = (variables, list(range(expression.IRows() - len(variables))), [])
    if isfinite(low):
        phase.addLowerFuncBound("Path", expression, *inputs, low)
    if isfinite(high):
        phase.addUpperFuncBound("Path", expression, *inputs, high)


if __name__ == "__main__":
    protocol.answer("ASSET", ("asset-asrl", "numpy"), solve)
