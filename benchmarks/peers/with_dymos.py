"""The published problems in the words of dymos: Radau collocation, hp refinement, SLSQP of SciPy.

Its interface to IPOPT, pyoptsparse, is not on PyPI; SLSQP is what its users have without it.
"""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import dymos
import numpy as np
import openmdao.api as om
import protocol
from dymos.grid_refinement.error_estimation import check_error
from dymos.load_case import find_phases


class Dynamics(om.ExplicitComponent):
    """A statement's equations at many points, with derivatives by complex steps."""

    def initialize(self) -> None:
        self.options.declare("num_nodes", types=int)
        self.options.declare("statement")

    def setup(self) -> None:
        statement, shape = self.options["statement"], (self.options["num_nodes"],)
        for v in (*statement.states, *statement.controls, *statement.parameters):
            self.add_input(v.name, np.ones(shape))
        self.add_input("t", np.ones(shape))
        for name in outputs(statement):
            self.add_output(name, np.ones(shape))
        self.declare_partials("*", "*", method="cs")
        self.declare_coloring(wrt="*", method="cs", show_summary=False)

    def compute(self, inputs: Any, results: Any) -> None:
        statement = self.options["statement"]
        rates = statement.equations(np, SimpleNamespace(**{name: inputs[name] for name in inputs}))
        values = [*rates.derivatives.values(), *rates.path.values()]
        for name, value in zip(outputs(statement), [*values, rates.cost], strict=False):
            results[name] = value


def outputs(statement: Any) -> list[str]:
    names = [f"{v.name}_rate" for v in statement.states] + [f"{v.name}_path" for v in statement.path]
    return [*names, "cost_rate"] if statement.end_cost is None else names


def solve(statement: Any) -> protocol.Outcome:
    if any(statement.gains.values()):
        return protocol.Outcome(reason="a state that ends at a distance from its start is not linked here")
    free = isinstance(statement.final, tuple)
    end = statement.final_guess if free else statement.final
    phase = dymos.Phase(
        ode_class=Dynamics,
        ode_init_kwargs={"statement": statement},
        transcription=dymos.Radau(num_segments=protocol.INTERVALS, order=protocol.POINTS),
    )
    problem = om.Problem(reports=False)
    trajectory = problem.model.add_subsystem("trajectory", dymos.Trajectory())
    trajectory.add_phase("phase", phase)
    limits = {"duration_bounds": statement.final} if free else {"fix_duration": True}
    phase.set_time_options(fix_initial=True, targets=["t"], units=None, **limits)
    state(phase, statement)
    for v in statement.controls:
        jumps = {"continuity": False, "rate_continuity": False}
        phase.add_control(v.name, lower=v.bounds[0], upper=v.bounds[1], targets=[v.name], **jumps)
    for v in statement.path:
        sides = {k: b for k, b in zip(("lower", "upper"), v.bounds, strict=True) if isfinite(b)}
        phase.add_path_constraint(f"{v.name}_path", **sides)
    name, factor = statement.end_cost or ("cost", 1.0)
    phase.add_objective("time" if name == "t" else name, loc="final", ref=1 / factor)
    phase.set_refine_options(
        refine=True, tol=protocol.MESH_TOLERANCE, min_order=protocol.LOWEST, max_order=protocol.HIGHEST
    )
    problem.driver = om.ScipyOptimizeDriver(
        optimizer="SLSQP", tol=protocol.NLP_TOLERANCE, maxiter=protocol.NLP_ITERATIONS, disp=False
    )
    problem.driver.declare_coloring(show_summary=False)
    problem.setup()
    phase.set_time_val(initial=0.0, duration=end)
    fractions = np.linspace(0, 1, 50)
    for v in statement.states:
        phase.set_state_val(v.name, [v.guess_at(f) for f in fractions], time_vals=fractions * end)
    for v in statement.controls:
        phase.set_control_val(v.name, [v.guess_at(f) for f in fractions], time_vals=fractions * end)
    ended = dymos.run_problem(problem, refine_method="hp", refine_iteration_limit=protocol.MESHES)
    grid = phase.options["transcription"].grid_data
    found = float(problem.get_val(f"trajectory.phase.timeseries.{'time' if name == 't' else name}")[-1, 0])
    (checked,) = check_error(find_phases(problem.model)).values()
    refined = bool(ended.success) and not np.any(checked["need_refinement"])
    # dymos tells its meshes in this file of the working folder only; the last heading finds nothing to refine
    meshes = Path("grid_refinement.out").read_text(encoding="utf-8").count("Grid Refinement - Iteration")
    return protocol.Outcome(
        objective=factor * found,
        points=int(grid.subset_num_nodes["col"]),
        intervals=int(grid.num_segments),
        meshes=meshes,
        error=float(np.max(checked["max_rel_error"])),
        converged=refined,
        reason="" if refined else f"above tolerance; {ended.exit_status}",
    )


def state(phase: dymos.Phase, statement: Any) -> None:
    for v in statement.states:
        phase.add_state(
            v.name,
            fix_initial=v.initial is not None,
            fix_final=v.terminal is not None,
            lower=v.bounds[0],
            upper=v.bounds[1],
            rate_source=f"{v.name}_rate",
            targets=[v.name],
        )
    if statement.end_cost is None:
        phase.add_state("cost", fix_initial=True, rate_source="cost_rate")


if __name__ == "__main__":
    protocol.answer("dymos", ("dymos", "openmdao", "numpy", "scipy"), solve)
