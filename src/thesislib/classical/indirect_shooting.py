"""Indirect single and multiple shooting, section 2.5.1.

The canonical equations are integrated together with their variational equations, whose solution, the
transition matrix, is the exact Jacobian that Newton's method needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from .control_problem import Array, ControlProblem, ConvergenceError, NecessaryConditions, Trajectory
from .newton import newton

ESCAPE: Final = 1e3
"""Size at which a trajectory is given up: it is on its way to infinity in finite time."""


@dataclass(frozen=True)
class Propagation:
    """States and costates along the canonical equations, and their transition matrix.

    Attributes
    ----------
    t : numpy.ndarray, shape (N,)
        Times reached, s; they end early if the trajectory escaped.
    p : numpy.ndarray, shape (2n, N)
        States above costates.
    transition : numpy.ndarray, shape (2n, 2n, N)
        Derivative of `p` by the initial `p`.
    escaped : bool
        Whether the trajectory left the range of `ESCAPE`.
    """

    t: Array
    p: Array
    transition: Array
    escaped: bool


def propagate(
    conditions: NecessaryConditions, p_start: ArrayLike, times: ArrayLike, *, rtol: float = 1e-10
) -> Propagation:
    """Integrate (2.91) and (2.92), with (2.99) inserted, and the transition matrix.

    Parameters
    ----------
    conditions : NecessaryConditions
    p_start : array_like, shape (2n,)
        States and costates at ``times[0]``.
    times : array_like, shape (N,)
        Where the solution is wanted, s, in increasing order.
    rtol : float
        Relative tolerance of the Runge–Kutta method of order eight.
    """
    start, times = np.asarray(p_start, float), np.asarray(times, float)
    size = len(start)

    def rates(_: float, y: Array) -> Array:
        return conditions.variation(y).full().ravel()

    def escape(_: float, y: Array) -> float:
        return ESCAPE - float(np.max(np.abs(y[:size])))

    escape.terminal = True  # type: ignore[attr-defined]  # how scipy is told to stop there
    run = solve_ivp(
        rates,
        (times[0], times[-1]),
        np.concatenate((start, np.eye(size).ravel())),
        method="DOP853",
        t_eval=times,
        events=escape,
        rtol=rtol,
        atol=1e-13,
    )
    return Propagation(run.t, run.y[:size], run.y[size:].reshape(size, size, -1, order="F"), run.status != 0)


def single_shooting(
    problem: ControlProblem,
    costate_guess: ArrayLike,
    final_time_guess: float | None = None,
    *,
    tolerance: float = 1e-9,
    rtol: float = 1e-10,
    points: int = 101,
) -> Trajectory:
    """Find the initial costates, and the final time if it is free, that meet the end conditions.

    Parameters
    ----------
    problem : ControlProblem
    costate_guess : array_like, shape (n,)
        First guess of the costates at ``t = 0``.
    final_time_guess : float, optional
        First guess of a free final time, s.
    tolerance : float
        Relative size of the last Newton step.
    rtol : float
        Relative tolerance of the integrator while Newton's method searches.
    points : int
        Points at which the trajectory is returned.

    Returns
    -------
    Trajectory

    Raises
    ------
    ValueError
        If a guess is missing or has another shape.
    ConvergenceError
        If Newton's method does not reach a root, or the trajectory of the guess escapes.
    """
    costate = _checked(costate_guess, (problem.states,), f"{problem.name}: costate guess")
    return multiple_shooting(
        problem,
        np.concatenate((np.asarray(problem.initial, float), costate))[:, None],
        final_time_guess,
        tolerance=tolerance,
        rtol=rtol,
        points=points,
    )


def multiple_shooting(
    problem: ControlProblem,
    guess: ArrayLike,
    final_time_guess: float | None = None,
    *,
    tolerance: float = 1e-9,
    rtol: float = 1e-10,
    points: int = 101,
) -> Trajectory:
    """Shoot over each of K equal intervals and join the pieces by the continuity conditions (2.102).

    With one interval, whose initial states are known, this is single shooting.

    Parameters
    ----------
    problem : ControlProblem
    guess : array_like, shape (2n, K)
        States above costates at the left end of each interval.
    final_time_guess, tolerance, rtol, points
        As for :func:`single_shooting`.

    Returns
    -------
    Trajectory

    Raises
    ------
    ValueError
        If a guess is missing or has another shape.
    ConvergenceError
        If Newton's method does not reach a root, or a piece of the guess escapes.
    """
    n, name = problem.states, problem.name
    intervals = np.shape(guess)[-1]
    nodes = _checked(guess, (2 * n, intervals), f"{name}: guess of states and costates")
    free_time = problem.final_time is None
    if free_time and final_time_guess is None:
        raise ValueError(f"{name}: the final time is free and needs a guess")
    conditions = NecessaryConditions(problem)
    initial = np.asarray(problem.initial, float)

    def unpacked(v: Array) -> tuple[Array, float]:
        t_f = v[-1] if free_time else problem.horizon()
        p = v[: -1 if free_time else None]
        return np.concatenate((initial, p)).reshape(intervals, 2 * n), t_f

    last: dict[bytes, tuple[Array, Array]] = {}

    def shot(v: Array) -> tuple[Array, Array]:
        if v.tobytes() not in last:
            last.clear()  # the Jacobian is asked for where the residual was found last
            starts, t_f = unpacked(v)
            last[v.tobytes()] = _pieces(conditions, starts, t_f / intervals, rtol)
        return last[v.tobytes()]

    def residual(v: Array) -> Array:
        starts, t_f = unpacked(v)
        if t_f <= 0:
            return np.full(len(v), np.inf)
        ends, _ = shot(v)
        gaps = (ends[:-1] - starts[1:]).ravel()
        return np.concatenate((gaps, conditions.end(ends[-1], t_f).full().ravel()))

    def jacobian(v: Array) -> Array:
        t_f = unpacked(v)[1]
        ends, transitions = shot(v)
        by_end = conditions.end_jacobian(ends[-1], t_f).full()
        by_time = conditions.flow.map(intervals)(ends.T).full() / intervals
        matrix = np.zeros((len(v), 2 * n * intervals + 1))
        for i in range(intervals - 1):
            rows = slice(2 * n * i, 2 * n * (i + 1))
            matrix[rows, rows] = transitions[i]
            matrix[rows, 2 * n * (i + 1) : 2 * n * (i + 2)] = -np.eye(2 * n)
            matrix[rows, -1] = by_time[:, i]
        last_rows = slice(2 * n * (intervals - 1), None)
        matrix[last_rows, -2 * n - 1 : -1] = by_end[:, :-1] @ transitions[-1]
        matrix[last_rows, -1] = by_end[:, :-1] @ by_time[:, -1] + by_end[:, -1]
        # the initial states are no unknowns, and the final time is one only where it is free
        return matrix[:, n : None if free_time else -1]

    first = nodes.T.ravel()[n:]
    if final_time_guess is not None and free_time:
        first = np.append(first, final_time_guess)
    gap_names = [
        f"gap of component {j} after interval {i}" for i in range(intervals - 1) for j in range(2 * n)
    ]
    root = newton(
        residual,
        jacobian,
        first,
        gap_names + conditions.end_names(),
        what=f"{name}, {'single' if intervals == 1 else 'multiple'} shooting",
        tolerance=tolerance,
    )
    starts, t_f = unpacked(root.x)
    return _trajectory(conditions, starts, t_f, points, len(root.x), root.iterations)


def _pieces(
    conditions: NecessaryConditions, starts: Array, duration: float, rtol: float
) -> tuple[Array, Array]:
    """Return the ends, shape (K, 2n), and transition matrices, shape (K, 2n, 2n), of all pieces.

    The pieces are as long as each other and are integrated side by side, as one system. If one escapes, all
    ends are infinite.
    """
    K, size = starts.shape
    together = conditions.variation.map(K)

    def rates(_: float, y: Array) -> Array:
        return together(y.reshape(K, -1).T).full().T.ravel()

    def escape(_: float, y: Array) -> float:
        return ESCAPE - float(np.max(np.abs(y.reshape(K, -1)[:, :size])))

    escape.terminal = True  # type: ignore[attr-defined]  # how scipy is told to stop there
    first = np.hstack((starts, np.tile(np.eye(size).ravel(), (K, 1))))
    run = solve_ivp(rates, (0.0, duration), first.ravel(), "DOP853", events=escape, rtol=rtol, atol=1e-13)
    last = run.y[:, -1].reshape(K, -1)
    ends = last[:, :size] if run.status == 0 else np.full((K, size), np.inf)
    return ends, last[:, size:].reshape(K, size, size).transpose(0, 2, 1)


def largest_offset(
    problem: ControlProblem, costate: ArrayLike, largest: float = 1.0, *, per_decade: int = 4
) -> float:
    """Return how far the guess may be from the right costates for single shooting still to converge.

    Parameters
    ----------
    problem : ControlProblem
        With a fixed final time.
    costate : array_like, shape (n,)
        The right costates at ``t = 0``.
    largest : float
        First offset that is tried, added to and subtracted from every costate.
    per_decade : int
        Offsets tried in each decade, downwards, until both signs converge.

    Raises
    ------
    ConvergenceError
        If no offset above 1e-14 converges.
    """
    right, offset = np.asarray(costate, float), largest
    while offset > 1e-14:
        if all(_converges(problem, right + sign * offset) for sign in (1, -1)):
            return offset
        offset *= 10 ** (-1 / per_decade)
    raise ConvergenceError(f"{problem.name}: single shooting converges from no guess 1e-14 away or farther")


def _converges(problem: ControlProblem, guess: Array) -> bool:
    try:
        # whether it converges shows at a coarser tolerance too, in a third of the time
        single_shooting(problem, guess, tolerance=1e-6, rtol=1e-8, points=2)
    except ConvergenceError:
        return False
    return True


def _trajectory(
    conditions: NecessaryConditions, starts: Array, t_f: float, points: int, unknowns: int, iterations: int
) -> Trajectory:
    n, intervals = conditions.problem.states, len(starts)
    edges = np.linspace(0.0, t_f, intervals + 1)
    t = np.unique(np.concatenate((np.linspace(0.0, t_f, points), edges)))

    def rates(_: float, y: Array) -> Array:
        return conditions.accumulation(y[:-1]).full().ravel()

    pieces, cost = [], 0.0
    for start, left, right in zip(starts, edges[:-1], edges[1:], strict=True):
        within = t[(t >= left) & (t <= right)]
        run = solve_ivp(
            rates, (left, right), np.append(start, cost), "DOP853", within, rtol=1e-11, atol=1e-13
        )
        cost = run.y[-1, -1]
        pieces.append(run.y[:-1, :-1] if right < t_f else run.y[:-1])
    p = np.concatenate(pieces, axis=1)
    u = conditions.control.map(p.shape[1])(p).full()
    objective = cost + float(conditions.terminal_cost(p[:, -1], t_f))
    return Trajectory(t, p[:n], t, u, t, p[n:], objective, unknowns, iterations)


def _checked(values: ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    array = np.asarray(values, float)
    if array.shape != shape:
        raise ValueError(f"{what} has shape {array.shape}, and {shape} is needed")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{what} has entries that are not finite")
    return array
