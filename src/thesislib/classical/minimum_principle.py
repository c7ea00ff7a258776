"""A bang-bang control by the minimum principle, section 2.4.1: a mass brought to rest in the least time.

The double integrator ``dx/dt = v``, ``dv/dt = u`` with ``|u| <= u_max`` is the smallest problem whose
control lies on its bound all the time.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from .control_problem import Array, ControlProblem, Expression, NecessaryConditions


@dataclass(frozen=True)
class FastestStop:
    """Time-optimal transfer from a position and speed to rest at the origin, by hand.

    Attributes
    ----------
    position, speed, limit : float
        Start in m and m/s, and largest acceleration in m/s².
    first : float
        Sign of the control until the switch; afterwards it is the opposite.
    switch_time, final_time : float
        In s.
    costate : (float, float)
        Costates of position (s/m) and of speed (s²/m) at the start, with (2.94) for ``Phi = t_f``.
    """

    position: float
    speed: float
    limit: float
    first: float
    switch_time: float
    final_time: float
    costate: tuple[float, float]

    @classmethod
    def by_hand(cls, position: float, speed: float, limit: float) -> FastestStop:
        """Return the transfer; from below the switching curve it is the mirror image of that from above.

        Raises
        ------
        ValueError
            If the limit is not positive or the mass is already at rest at the origin.
        """
        if not limit > 0:
            raise ValueError(f"largest acceleration {limit} m/s² must be positive")
        if position == speed == 0:
            raise ValueError("position 0 m and speed 0 m/s are the end already")
        side = position + speed * abs(speed) / (2 * limit)
        mirror = np.sign(side) if side else np.sign(position)
        x, v = mirror * position, mirror * speed
        lowest = -np.sqrt(max(limit * x + v**2 / 2, 0.0))
        switch = (v - lowest) / limit
        price = -1 / lowest
        return cls(
            position,
            speed,
            limit,
            -float(mirror),
            float(switch),
            float(switch - lowest / limit),
            (float(mirror * price), float(mirror * price * switch)),
        )

    def problem(self) -> ControlProblem:
        """Return the problem, its control given by (2.99): full force against the costate of speed."""

        def against_costate(_: Expression, costate: Expression) -> list[Expression]:
            return [ca.sign(costate[1]) * -self.limit]

        return ControlProblem(
            "fastest stop",
            dynamics=lambda x, u: [x[1], u[0]],
            running_cost=lambda x, u: 0.0 * u[0],
            initial=[self.position, self.speed],
            final_time=None,
            terminal_cost=lambda x, t: t,
            terminal={0: 0.0, 1: 0.0},
            minimiser=against_costate,
        )

    def integrated(self, times: ArrayLike) -> tuple[Array, Array]:
        """Integrate (2.91) and (2.92) under the law (2.99) from the start and the costates by hand.

        The switch is not told to the integrator: it finds the zero of the costate of speed.

        Parameters
        ----------
        times : array_like, shape (N,)
            Where the solution is wanted, s, increasing from zero.

        Returns
        -------
        p : numpy.ndarray, shape (4, N)
            Position, speed and their costates.
        u : numpy.ndarray, shape (N,)
            Control, m/s².
        """
        conditions = NecessaryConditions(self.problem())
        times = np.asarray(times, float)
        start, now, pieces = np.array([self.position, self.speed, *self.costate]), 0.0, []

        def switch(_: float, p: Array) -> float:
            return float(p[3])

        switch.terminal = True  # type: ignore[attr-defined]  # how scipy is told to stop there
        while True:
            # the control is held between two switches, so that the integrator sees smooth equations
            ahead = _sign_ahead(start)
            held = -self.limit * ahead
            switch.direction = -ahead  # type: ignore[attr-defined]  # not the crossing it starts from

            def rates(_: float, p: Array, held: float = held) -> Array:
                return conditions.canonical(p, held).full().ravel()

            run = solve_ivp(
                rates,
                (now, times[-1]),
                start,
                "DOP853",
                events=switch,
                dense_output=True,
                rtol=1e-12,
                atol=1e-13,
            )
            end = run.t[-1] if run.status == 1 else np.inf
            within = times[(times >= now) & (times < end)]
            pieces.append((run.sol(within), np.full(len(within), held)))
            if run.status != 1:
                break
            start, now = run.y[:, -1].copy(), run.t[-1]
            start[3] = 0.0  # on the switch; what comes next is read from its derivative
        states, controls = zip(*pieces, strict=True)
        return np.concatenate(states, axis=1), np.concatenate(controls)


def _sign_ahead(p: Array) -> float:
    """Return the sign the costate of speed is about to have; its derivative is minus that of position."""
    return float(np.sign(p[3]) if p[3] else -np.sign(p[2]))
