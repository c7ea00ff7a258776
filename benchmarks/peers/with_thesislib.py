"""The published problems in the words of this library."""

from __future__ import annotations

from typing import Any

import protocol

from thesislib import ocp
from thesislib.classical.benchmarks.solves import guess_of, problem_of


def solve(statement: Any) -> protocol.Outcome:
    try:
        found = ocp.solve(
            problem_of(statement),
            guess_of(statement),
            ocp.Mesh.uniform(protocol.INTERVALS, protocol.POINTS),
            tolerance=protocol.MESH_TOLERANCE,
            optimality=protocol.NLP_TOLERANCE,
            iterations=protocol.NLP_ITERATIONS,
            lowest=protocol.LOWEST,
            highest=protocol.HIGHEST,
            meshes=protocol.MESHES,
        )
        reason = ""
    except ocp.SolveError as failure:
        found, reason = failure.solution, str(failure)
    return protocol.Outcome(
        objective=found.objective,
        points=found.mesh.points,
        intervals=found.mesh.intervals,
        meshes=len(found.history),
        error=found.error,
        converged=found.converged,
        reason=reason,
    )


if __name__ == "__main__":
    protocol.answer("thesislib", ("thesislib", "casadi", "numpy", "scipy"), solve)
