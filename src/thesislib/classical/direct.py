"""Direct single shooting, direct multiple shooting and Euler collocation: section 2.6.1 to 2.6.3.

Each turns the problem into a nonlinear programme that IPOPT solves. The programmes differ in what they
leave to an integrator. Costates come from the multipliers, with the sign of (2.127).
"""

from __future__ import annotations

from typing import Any, Final

import casadi as ca
import numpy as np

from .control_problem import Array, ControlProblem, ConvergenceError, Expression, Trajectory

_IPOPT: Final[dict[str, Any]] = {
    "print_time": False,
    "show_eval_warnings": False,  # IPOPT shortens a step whose trial is not finite; nothing is wrong then
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-11,
    "ipopt.max_iter": 300,
}


def direct_single_shooting(problem: ControlProblem, intervals: int, *, substeps: int = 4) -> Trajectory:
    """Optimise piecewise constant controls; an integrator finds everything else, (2.111) to (2.113).

    Parameters
    ----------
    problem : ControlProblem
        With a fixed final time.
    intervals : int
        Pieces of the control, N.
    substeps : int
        Steps of the fourth-order Runge–Kutta method in each.

    Returns
    -------
    Trajectory
        Costates are the derivatives of the cost by a jump of the state at each grid point.

    Raises
    ------
    ValueError
        If the final time is free or a number is below one.
    ConvergenceError
        If IPOPT does not converge.
    """
    n, m = problem.states, problem.controls
    advance = _advance(problem, intervals, substeps)
    q, jump = ca.MX.sym("q", m, intervals), ca.MX.sym("jump", n, intervals + 1)
    cost: Expression = 0.0
    x = ca.DM(problem.initial) + jump[:, 0]
    states = [x]
    for i in range(intervals):
        x, run_up = advance(x, q[:, i])
        x, cost = x + jump[:, i + 1], cost + run_up
        states.append(x)
    cost += problem.terminal_cost(x, problem.horizon())
    miss = _end_miss(problem, x)
    guess = np.zeros(m * intervals)
    found, multipliers, objective, iterations = _minimum(
        problem, "direct single shooting", ca.vec(q), ca.vec(jump), cost, miss, guess
    )
    price = ca.gradient(cost + ca.dot(ca.DM(multipliers), miss), jump)
    look = ca.Function("look", [q, jump], [ca.horzcat(*states), price])
    controls = found.reshape(intervals, m).T
    path, costate = (part.full() for part in look(controls, 0))
    return _direct(problem, path, controls, costate, objective, len(found), iterations)


def direct_multiple_shooting(problem: ControlProblem, intervals: int, *, substeps: int = 4) -> Trajectory:
    """Optimise piecewise constant controls and the states between them, (2.114) to (2.118).

    Parameters, returns and errors are those of :func:`direct_single_shooting`; the costates are the
    multipliers of (2.117) and (2.118).
    """
    advance = _advance(problem, intervals, substeps).map(intervals)
    s, q, start = _states_and_controls(problem, intervals)
    reached, run_up = advance(s[:, :-1], q)
    cost = ca.sum2(run_up) + problem.terminal_cost(s[:, -1], problem.horizon())
    continuity = s - ca.horzcat(ca.DM(problem.initial), reached)
    return _joined(problem, "direct multiple shooting", s, q, cost, continuity, start)


def euler_collocation(problem: ControlProblem, intervals: int) -> Trajectory:
    """Optimise states and controls that satisfy the forward Euler rule, (2.119) to (2.122).

    Parameters, returns and errors are those of :func:`direct_single_shooting`, without an integrator.
    The costate at grid point ``k + 1`` is the multiplier ``lambda_k`` of (2.127), and that at the start is
    the multiplier of the initial condition.
    """
    h = problem.horizon() / _at_least_one(problem, "intervals", intervals)
    f, L = _pointwise(problem)
    x, u, start = _states_and_controls(problem, intervals)
    cost = h * ca.sum2(L.map(intervals)(x[:, :-1], u))
    cost += problem.terminal_cost(x[:, -1], problem.horizon())
    step = x[:, :-1] + h * f.map(intervals)(x[:, :-1], u)
    defects = x - ca.horzcat(ca.DM(problem.initial), step)
    return _joined(problem, "Euler collocation", x, u, cost, defects, start)


def euler_conditions(problem: ControlProblem, trajectory: Trajectory) -> dict[str, float]:
    """Return the largest residual of each of the programme's conditions (2.128) to (2.131).

    They are evaluated for the Bolza form, with the Hamiltonian (2.80) in place of ``lambda^T f``.

    Parameters
    ----------
    problem : ControlProblem
    trajectory : Trajectory
        From :func:`euler_collocation`.

    Returns
    -------
    dict of str to float
        By equation number. (2.131) holds for states that are free at the end; it is NaN if there are none.
    """
    n, intervals = problem.states, trajectory.u.shape[1]
    h = problem.horizon() / intervals
    x, u, costate = ca.SX.sym("x", n), ca.SX.sym("u", problem.controls), ca.SX.sym("l", n)
    H = problem.running_cost(x, u) + ca.dot(costate, ca.vertcat(*problem.dynamics(x, u)))
    slopes = ca.Function("slopes", [x, u, costate], [ca.gradient(H, v) for v in (costate, x, u)])
    after = trajectory.costate[:, 1:]
    f, H_x, H_u = (part.full() for part in slopes.map(intervals)(trajectory.x[:, :-1], trajectory.u, after))
    end = ca.SX(problem.terminal_cost(x, problem.horizon()))
    price = ca.Function("price", [x], [ca.gradient(end, x)])(trajectory.x[:, -1]).full().ravel()
    free = [i for i in range(n) if i not in problem.terminal]
    transversality = np.abs(price - trajectory.costate[:, -1])[free]
    return {
        "(2.128)": float(np.max(np.abs(np.diff(trajectory.x) - h * f))),
        "(2.129)": float(np.max(np.abs(np.diff(trajectory.costate) + h * H_x))),
        "(2.130)": float(np.max(np.abs(h * H_u))),
        "(2.131)": float(np.max(transversality, initial=-np.inf)) if free else float("nan"),
    }


def _pointwise(problem: ControlProblem) -> tuple[ca.Function, ca.Function]:
    x, u = ca.SX.sym("x", problem.states), ca.SX.sym("u", problem.controls)
    f = ca.Function("f", [x, u], [ca.vertcat(*problem.dynamics(x, u))])
    return f, ca.Function("L", [x, u], [problem.running_cost(x, u)])


def _advance(problem: ControlProblem, intervals: int, substeps: int) -> ca.Function:
    """Return ``(x, q) -> (x at the end of the interval, cost of the interval (2.115))``."""
    h = problem.horizon() / _at_least_one(problem, "intervals", intervals)
    h /= _at_least_one(problem, "substeps", substeps)
    f, L = _pointwise(problem)
    start, q = ca.SX.sym("x", problem.states), ca.SX.sym("q", problem.controls)
    x, cost = start, ca.SX(0)
    for _ in range(substeps):
        k1, l1 = f(x, q), L(x, q)
        k2, l2 = f(x + h / 2 * k1, q), L(x + h / 2 * k1, q)
        k3, l3 = f(x + h / 2 * k2, q), L(x + h / 2 * k2, q)
        k4, l4 = f(x + h * k3, q), L(x + h * k3, q)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        cost = cost + h / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
    return ca.Function("advance", [start, q], [x, cost])


def _states_and_controls(problem: ControlProblem, intervals: int) -> tuple[Expression, Expression, Array]:
    """Return symbols for both, and a first guess: straight lines, and zero."""
    t = np.linspace(0.0, 1.0, intervals + 1)
    lines = [x0 + (problem.terminal.get(i, x0) - x0) * t for i, x0 in enumerate(problem.initial)]
    guess = np.concatenate((np.array(lines).T.ravel(), np.zeros(problem.controls * intervals)))
    return ca.MX.sym("x", problem.states, intervals + 1), ca.MX.sym("u", problem.controls, intervals), guess


def _end_miss(problem: ControlProblem, x: Expression) -> Expression:
    return ca.vertcat(ca.MX(0, 1), *(x[i] - value for i, value in problem.terminal.items()))


def _joined(
    problem: ControlProblem,
    method: str,
    x: Expression,
    u: Expression,
    cost: Expression,
    joints: Expression,
    guess: Array,
) -> Trajectory:
    """Solve for states and controls at once; `joints`, shape (n, N + 1), has the initial condition first."""
    equations = ca.vertcat(ca.vec(joints), _end_miss(problem, x[:, -1]))
    found, multipliers, objective, iterations = _minimum(
        problem, method, ca.veccat(x, u), ca.MX(0, 1), cost, equations, guess
    )
    path = found[: x.numel()].reshape(x.shape, order="F")
    controls = found[x.numel() :].reshape(u.shape, order="F")
    # IPOPT adds multiplier times constraint, (2.127) subtracts it
    costate = -multipliers[: x.numel()].reshape(x.shape, order="F")
    return _direct(problem, path, controls, costate, objective, len(found), iterations)


def _minimum(
    problem: ControlProblem,
    method: str,
    unknowns: Expression,
    parameters: Expression,
    cost: Expression,
    equations: Expression,
    guess: Array,
) -> tuple[Array, Array, float, int]:
    programme: Any = {"x": unknowns, "p": parameters, "f": cost, "g": equations}
    solver = ca.nlpsol("programme", "ipopt", programme, _IPOPT)
    run = solver(x0=guess, p=0, lbg=0, ubg=0)
    stats = solver.stats()
    if stats["return_status"] != "Solve_Succeeded":
        residual = np.abs(run["g"].full().ravel())
        worst = (
            f"equation {np.argmax(residual)}, {residual.max():.3g}" if residual.size else "none: no equations"
        )
        raise ConvergenceError(
            f"{problem.name}, {method}: IPOPT says {stats['return_status']}; the largest residual is {worst}"
        )
    return run["x"].full().ravel(), run["lam_g"].full().ravel(), float(run["f"]), stats["iter_count"]


def _direct(
    problem: ControlProblem,
    x: Array,
    u: Array,
    costate: Array,
    objective: float,
    unknowns: int,
    iterations: int,
) -> Trajectory:
    t = np.linspace(0.0, problem.horizon(), x.shape[1])
    return Trajectory(t, x, t[:-1], u, t, costate, objective, unknowns, iterations)


def _at_least_one(problem: ControlProblem, what: str, number: int) -> int:
    if number < 1:
        raise ValueError(f"{problem.name}: {what} = {number} must be at least 1")
    return number
