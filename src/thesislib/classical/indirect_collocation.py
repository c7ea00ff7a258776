"""Indirect collocation by the midpoint rule, and constraints as penalties: section 2.5.2."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np

from .control_problem import Array, ControlProblem, Expression, NecessaryConditions, Trajectory
from .newton import newton


def wall(s: Expression, h: float, n: int = 10) -> Expression:
    """Return the penalty (2.109), ``(1 + s/h)^n`` where ``s > -h`` and zero elsewhere.

    It is one at ``s = 0`` and rises with `s`: it holds a quantity *below* zero.

    Parameters
    ----------
    s : float, numpy.ndarray or casadi expression
        The constrained quantity, any shape.
    h : float
        Depth, in the unit of `s`, to which the penalty reaches into the admissible side.
    n : int
        Exponent, at least 2.

    Raises
    ------
    ValueError
        If `h` is not positive or `n` below 2, where the penalty has no continuous slope.
    """
    if not h > 0:
        raise ValueError(f"depth h = {h} of the penalty (2.109) must be positive")
    if n < 2:
        raise ValueError(f"exponent n = {n} of the penalty (2.109) must be at least 2")
    inside = 1 + s / h
    if isinstance(s, ca.SX | ca.MX):
        return ca.fmax(inside, 0) ** n
    return np.maximum(inside, 0.0) ** n


def with_wall(
    problem: ControlProblem, excess: Callable[[Expression], Expression], h: float, n: int = 10
) -> ControlProblem:
    """Return the problem with the constraint ``excess(x) <= 0`` as a penalty (2.109) in its running cost."""

    def running_cost(x: Expression, u: Expression) -> Expression:
        return problem.running_cost(x, u) + wall(excess(x), h, n)

    wall(0.0, h, n)  # refuses a wrong depth or exponent here, where it was given
    return replace(problem, running_cost=running_cost)


def midpoint_collocation(
    problem: ControlProblem, intervals: int, guess: Trajectory | None = None, *, tolerance: float = 1e-10
) -> Trajectory:
    """Solve the necessary conditions on a uniform grid, (2.106) to (2.108), by Newton's method.

    Parameters
    ----------
    problem : ControlProblem
        With a fixed final time.
    intervals : int
        N, at least 2.
    guess : Trajectory, optional
        Where to begin; by default states on straight lines, costates and controls zero.
    tolerance : float
        Relative size of the last Newton step.

    Returns
    -------
    Trajectory
        States and costates at the N + 1 grid points, controls at the N midpoints.

    Raises
    ------
    ValueError
        If the final time is free or there are fewer than two intervals.
    ConvergenceError
        If Newton's method does not reach a root.
    """
    n, m, t_f = problem.states, problem.controls, problem.horizon()
    if intervals < 2:
        raise ValueError(f"{problem.name}: {intervals} intervals; the midpoint rule needs at least 2")
    conditions = NecessaryConditions(problem)
    t = np.linspace(0.0, t_f, intervals + 1)
    h = t_f / intervals

    p, u = ca.MX.sym("p", 2 * n, intervals + 1), ca.MX.sym("u", m, intervals)
    middle = (p[:, :-1] + p[:, 1:]) / 2
    defects = conditions.canonical.map(intervals)(middle, u) - (p[:, 1:] - p[:, :-1]) / h
    stationarity = conditions.stationarity.map(intervals)(middle, u)
    ends = ca.vertcat(p[:n, 0] - ca.DM(problem.initial), conditions.end(p[:, -1], t_f))
    unknowns = ca.veccat(p, u)
    equations = ca.veccat(defects, stationarity, ends)
    zeta = ca.Function("zeta", [unknowns], [equations])
    slope = ca.Function("slope", [unknowns], [ca.jacobian(equations, unknowns)])

    names = [f"(2.106) of component {j} in interval {i}" for i in range(intervals) for j in range(2 * n)]
    names += [f"(2.107) of control {j} in interval {i}" for i in range(intervals) for j in range(m)]
    names += [f"initial value of state {j}" for j in range(n)] + conditions.end_names()
    root = newton(
        lambda v: zeta(v).full().ravel(),
        lambda v: slope(v).tocsc(),
        _first(problem, t, guess),
        names,
        what=f"{problem.name}, midpoint collocation",
        tolerance=tolerance,
    )
    found = root.x[: 2 * n * (intervals + 1)].reshape(intervals + 1, 2 * n).T
    controls = root.x[found.size :].reshape(intervals, m).T
    between = (found[:, :-1] + found[:, 1:]) / 2
    running = ca.Function("L", [x := ca.SX.sym("x", n), w := ca.SX.sym("u", m)], [problem.running_cost(x, w)])
    cost = h * float(np.sum(running.map(intervals)(between[:n], controls).full()))
    cost += float(conditions.terminal_cost(found[:, -1], t_f))
    halves = (t[:-1] + t[1:]) / 2
    return Trajectory(t, found[:n], halves, controls, t, found[n:], cost, len(root.x), root.iterations)


def _first(problem: ControlProblem, t: Array, guess: Trajectory | None) -> Array:
    n, halves = problem.states, (t[:-1] + t[1:]) / 2
    if guess is None:
        ends = np.array([[x0, problem.terminal.get(i, x0)] for i, x0 in enumerate(problem.initial)])
        x = ends[:, :1] + np.outer(ends[:, 1] - ends[:, 0], t / t[-1])
        return np.concatenate(
            (np.vstack((x, np.zeros((n, len(t))))).T.ravel(), np.zeros(problem.controls * len(halves)))
        )
    states = [np.interp(t, guess.t, row) for row in guess.x]
    costate = [np.interp(t, guess.t_costate, row) for row in guess.costate]
    u = [np.interp(halves, guess.t_control, row) for row in guess.u]
    return np.concatenate((np.array(states + costate).T.ravel(), np.array(u).T.ravel()))
