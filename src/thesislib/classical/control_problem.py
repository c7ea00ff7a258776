"""An optimal control problem and its necessary conditions, as equations (2.77) to (2.101) state them.

The expressions are CasADi's, so that every derivative below is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Expression = Any
"""A CasADi expression (the package has no types)."""


class ConvergenceError(RuntimeError):
    """A method stopped before its equations held; the message names the largest residual."""


def no_terminal_cost(x: Expression, t: Expression) -> Expression:
    """Return zero: a cost (2.78) that is an integral alone."""
    return 0.0


@dataclass(frozen=True)
class ControlProblem:
    """Minimise (2.78), a terminal cost and an integral, subject to the dynamics (2.77).

    Attributes
    ----------
    name : str
        What is solved; error messages begin with it.
    dynamics : callable
        ``f(x, u)``, columns of ``n`` states and ``m`` controls to a list of ``n`` expressions.
    running_cost : callable
        ``L(x, u)``, an expression.
    initial : sequence of float, length n
        States at ``t = 0``.
    final_time : float or None
        End of the horizon; None if it is free.
    terminal_cost : callable
        ``Phi(x, t)`` at the end.
    terminal : mapping of int to float
        States, by index, that are given at the end; the others are free.
    controls : int
        Number of controls, ``m``.
    minimiser : callable, optional
        ``u*(x, lambda)`` of (2.99), a list of ``m`` expressions. By default the solution of
        (2.93) where the Hamiltonian is quadratic in the controls; others are refused.

    Raises
    ------
    ValueError
        If the final time is not positive, a terminal state does not exist, or the dynamics have
        not one entry per state.
    """

    name: str
    dynamics: Callable[[Expression, Expression], Sequence[Expression]]
    running_cost: Callable[[Expression, Expression], Expression]
    initial: Sequence[float]
    final_time: float | None
    terminal_cost: Callable[[Expression, Expression], Expression] = no_terminal_cost
    terminal: Mapping[int, float] = field(default_factory=dict)
    controls: int = 1
    minimiser: Callable[[Expression, Expression], Sequence[Expression]] | None = None

    def __post_init__(self) -> None:
        n = len(self.initial)
        if self.final_time is not None and not 0 < self.final_time < np.inf:
            raise ValueError(f"{self.name}: final time {self.final_time} s must be positive and finite")
        for index in self.terminal:
            if not 0 <= index < n:
                raise ValueError(f"{self.name}: terminal state {index} is not one of 0 .. {n - 1}")
        entries = len(self.dynamics(ca.SX.sym("x", n), ca.SX.sym("u", self.controls)))
        if entries != n:
            raise ValueError(f"{self.name}: dynamics have {entries} entries for {n} initial states")

    @property
    def states(self) -> int:
        """Number of states, n."""
        return len(self.initial)

    def horizon(self) -> float:
        """Return the fixed final time in s.

        Raises
        ------
        ValueError
            If it is free.
        """
        if self.final_time is None:
            raise ValueError(f"{self.name}: this method needs a fixed final time, and it is free")
        return self.final_time


@dataclass(frozen=True)
class Trajectory:
    """What a method found.

    Attributes
    ----------
    t, x : numpy.ndarray, shapes (N + 1,) and (n, N + 1)
        Times in s, and states there.
    t_control, u : numpy.ndarray, shapes (M,) and (m, M)
        Times at which the controls are known, and controls there.
    t_costate, costate : numpy.ndarray, shapes (K,) and (n, K)
        The same of the costates, signed as in (2.80): the derivative of the cost by the state.
    objective : float
        Cost (2.78), by the method's own quadrature.
    unknowns, iterations : int
        Size of the system or programme that was solved, and Newton's or IPOPT's steps.
    """

    t: Array
    x: Array
    t_control: Array
    u: Array
    t_costate: Array
    costate: Array
    objective: float
    unknowns: int
    iterations: int


class NecessaryConditions:
    """Functions of ``p = (x, lambda)`` that the minimum principle needs, differentiated exactly.

    Attributes
    ----------
    hamiltonian : casadi.Function
        ``(p, u) -> L + lambda^T f``, (2.80).
    canonical : casadi.Function
        ``(p, u) -> (dH/dlambda, -dH/dx)``, (2.91) and (2.92).
    stationarity : casadi.Function
        ``(p, u) -> dH/du``, (2.93).
    control : casadi.Function
        ``p -> u*``, (2.99).
    flow : casadi.Function
        ``p -> F(p)``, the canonical equations with the minimising control inserted.
    variation : casadi.Function
        ``(p, vec M) -> (F(p), vec(F'(p) M))``: the flow and its variational equations.
    accumulation : casadi.Function
        ``p -> (F(p), L)``: the flow and the cost it runs up.
    end, end_jacobian : casadi.Function
        ``(p, t_f) ->`` what must vanish at the end, (2.95) or a given state for each state, and
        (2.94) if the final time is free; and its Jacobian by ``(p, t_f)``.
    terminal_cost : casadi.Function
        ``(p, t_f) -> Phi``.
    """

    def __init__(self, problem: ControlProblem) -> None:
        n, m = problem.states, problem.controls
        self.problem = problem
        p, u, t = ca.SX.sym("p", 2 * n), ca.SX.sym("u", m), ca.SX.sym("t")
        x, costate = p[:n], p[n:]
        H = problem.running_cost(x, u) + ca.dot(costate, ca.vertcat(*problem.dynamics(x, u)))
        rates = ca.vertcat(ca.gradient(H, costate), -ca.gradient(H, x))
        best = _minimising_control(problem, H, x, costate, u)
        flow = ca.substitute(rates, u, best)

        terminal_cost = ca.SX(problem.terminal_cost(x, t))
        price = ca.gradient(terminal_cost, x)
        end = [
            x[i] - problem.terminal[i] if i in problem.terminal else costate[i] - price[i] for i in range(n)
        ]
        if problem.final_time is None:
            end.append(ca.substitute(H, u, best) + ca.gradient(terminal_cost, t))

        self.hamiltonian = ca.Function("H", [p, u], [H])
        self.canonical = ca.Function("canonical", [p, u], [rates])
        self.stationarity = ca.Function("H_u", [p, u], [ca.gradient(H, u)])
        self.control = ca.Function("control", [p], [best])
        self.flow = ca.Function("flow", [p], [flow])
        transition = ca.SX.sym("M", 2 * n, 2 * n)
        slopes = ca.vertcat(flow, ca.vec(ca.jtimes(flow, p, transition)))
        self.variation = ca.Function("variation", [ca.vertcat(p, ca.vec(transition))], [slopes])
        running_cost = ca.substitute(problem.running_cost(x, u), u, best)
        self.accumulation = ca.Function("accumulation", [p], [ca.vertcat(flow, running_cost)])
        self.end = ca.Function("end", [p, t], [ca.vertcat(*end)])
        by_end = ca.jacobian(ca.vertcat(*end), ca.vertcat(p, t))
        self.end_jacobian = ca.Function("end_jacobian", [p, t], [by_end])
        self.terminal_cost = ca.Function("Phi", [p, t], [terminal_cost])

    def end_names(self) -> list[str]:
        """Return what each component of `end` says, for error messages."""
        given = self.problem.terminal
        names = [
            f"end value of state {i}" if i in given else f"(2.95) of state {i}"
            for i in range(self.problem.states)
        ]
        return names + (["(2.94)"] if self.problem.final_time is None else [])


def _minimising_control(
    problem: ControlProblem, H: Expression, x: Expression, costate: Expression, u: Expression
) -> Expression:
    if problem.minimiser is not None:
        return ca.vertcat(*problem.minimiser(x, costate))
    curvature, slope = ca.hessian(H, u)
    if ca.depends_on(curvature, u):
        raise ValueError(
            f"{problem.name}: the Hamiltonian is not quadratic in the controls; give the minimiser of (2.99)"
        )
    # one Newton step from zero is exact for a quadratic
    return -ca.solve(curvature, ca.substitute(slope, u, ca.SX.zeros(u.shape)))
