"""The problems of this room, handed to Legendre–Gauss–Radau collocation (section 2.7)."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from thesislib import ocp

from .control_problem import ControlProblem, Trajectory

Bounds = tuple[float, float]


def radau_problem(
    problem: ControlProblem, state_bounds: Sequence[Bounds], control_bounds: Sequence[Bounds]
) -> ocp.Problem:
    """Return the problem as :class:`thesislib.ocp.Problem`, with states ``x0, ...`` and controls ``u0, ...``.

    Parameters
    ----------
    problem : ControlProblem
        With a fixed final time.
    state_bounds, control_bounds : sequence of (float, float)
        Bounds, one pair each; they also scale.

    Raises
    ------
    ValueError
        If the final time is free or the bounds are not one pair for each.
    """
    n, m, t_f = problem.states, problem.controls, problem.horizon()
    if (len(state_bounds), len(control_bounds)) != (n, m):
        raise ValueError(
            f"{problem.name}: {len(state_bounds)} and {len(control_bounds)} pairs of bounds for "
            f"{n} states and {m} controls"
        )

    def equations(at: ocp.Point) -> ocp.Equations:
        x = ca.vertcat(*(at[f"x{i}"] for i in range(n)))
        u = ca.vertcat(*(at[f"u{j}"] for j in range(m)))
        rates = {f"x{i}": rate for i, rate in enumerate(problem.dynamics(x, u))}
        return ocp.Equations(rates, integrands={"cost": problem.running_cost(x, u)})

    def end_cost(ends: ocp.Ends) -> object:
        return problem.terminal_cost(ca.vertcat(*(ends.final[f"x{i}"] for i in range(n))), t_f)

    return ocp.Problem(
        name=problem.name,
        independent=ocp.Independent("t", 0.0, t_f, unit="s"),
        states=[ocp.State(f"x{i}", "", bounds) for i, bounds in enumerate(state_bounds)],
        controls=[ocp.Control(f"u{j}", "", bounds) for j, bounds in enumerate(control_bounds)],
        equations=equations,
        lagrange="cost",
        mayer=end_cost,
        initial={f"x{i}": value for i, value in enumerate(problem.initial)},
        terminal={f"x{i}": value for i, value in problem.terminal.items()},
    )


def radau_collocation(
    problem: ControlProblem,
    intervals: int,
    order: int,
    state_bounds: Sequence[Bounds],
    control_bounds: Sequence[Bounds],
) -> Trajectory:
    """Solve on one mesh of equal intervals, without refinement, as the other methods of this room do.

    Parameters
    ----------
    problem : ControlProblem
    intervals, order : int
        Intervals of the mesh, and collocation points in each.
    state_bounds, control_bounds : sequence of (float, float)
        See :func:`radau_problem`.

    Returns
    -------
    Trajectory
        States at the nodes, controls and costates at the collocation points.

    Raises
    ------
    ValueError
        As :func:`radau_problem`.
    thesislib.ocp.SolveError
        If IPOPT does not converge; it names the largest residual.
    """
    t_f = problem.horizon()

    def line(i: int) -> object:
        first, last = problem.initial[i], problem.terminal.get(i, problem.initial[i])
        return lambda t: first + (last - first) * np.asarray(t) / t_f

    guess = {f"x{i}": line(i) for i in range(problem.states)} | {
        f"u{j}": 0.0 for j in range(problem.controls)
    }
    solution = ocp.solve(
        radau_problem(problem, state_bounds, control_bounds),
        guess,
        ocp.Mesh.uniform(intervals, order),
        tolerance=0.999,  # one mesh: its error is measured, not estimated
        optimality=1e-11,
        compile_code=False,
    )
    x = np.array([solution.at_nodes(f"x{i}") for i in range(problem.states)])
    u = np.array([solution[f"u{j}"] for j in range(problem.controls)])
    costate = np.array([solution.costate(f"x{i}") for i in range(problem.states)])
    iterations = sum(mesh.iterations for mesh in solution.history)
    return Trajectory(
        solution.nodes,
        x,
        solution.points,
        u,
        solution.points,
        costate,
        solution.objective,
        x.size + u.size,
        iterations,
    )
