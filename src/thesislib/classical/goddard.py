"""Goddard's rocket: how high a given amount of fuel can lift it, a problem with a singular arc.

Full thrust, then the singular arc, then none. Thrust enters linearly, so that nothing along the arc
but its own second derivative says how much of it is best; the solution in three phases knows that law.
In feet, slugs and pounds, as the problem is published.
"""

from __future__ import annotations

from typing import Any, Final

import casadi as ca
import numpy as np

from thesislib import ocp
from thesislib.classical.control_problem import Array

THRUST: Final = 193.044
"""Largest thrust in lbf."""

ALTITUDE: Final = 18550.8718638
"""The greatest altitude in ft, from the three-phase solution in the examples of the package yapss."""

_GRAVITY, _DRAG, _EXHAUST, _SCALE_HEIGHT = 32.174, 5.49153484923381e-5, 1580.9425279876559, 23800.0
_STATES = (
    ocp.State("h", "ft", (0, 30000)),
    ocp.State("v", "ft/s", (0, 15000)),
    ocp.State("m", "slug", (1, 3)),
)
_START = {"h": 0.0, "v": 0.0, "m": 3.0}

GUESS: Final = {
    "h": lambda t: 300 * t,
    "v": 500.0,
    "m": lambda t: 3 - t / 30,
    "T": THRUST / 2,
    "t_final": 60.0,
}
"""A guess for the problem of one phase: a climb at constant speed."""

GUESS_OF_PHASES: Final = {
    "boost": {"h": lambda t: 25 * t**2, "v": lambda t: 60 * t, "m": lambda t: 3 - 0.1 * t, "t_final": 13.0},
    "arc": {
        "h": lambda t: 700 * t - 4000,
        "v": 800.0,
        "m": lambda t: 2 - 0.04 * t,
        "t_initial": 13.0,
        "t_final": 22.0,
    },
    "coast": {"h": 15000.0, "v": lambda t: 1460 - 30 * t, "m": 1.0, "t_initial": 22.0, "t_final": 43.0},
}
"""A guess for the problem of three phases."""


def drag(h: Any, v: Any) -> Any:
    """Return the drag in lbf at altitude `h` in ft and speed `v` in ft/s."""
    # casadi's functions turn arrays into matrices of its own
    exp = np.exp if isinstance(h, np.ndarray | float) else ca.exp
    return _DRAG * v**2 * exp(-h / _SCALE_HEIGHT)


def singular_surface(h: Any, v: Any, m: Any) -> Any:
    """Return what vanishes along the arc: weight less (1 + v/c) times the drag, in lbf."""
    return m * _GRAVITY - (1 + v / _EXHAUST) * drag(h, v)


def arc_thrust(h: Any, v: Any, m: Any) -> Any:
    """Return the thrust in lbf that keeps the rocket on the singular surface: the arc's feedback law."""
    c = _EXHAUST
    gain = m * _GRAVITY / (1 + 4 * c / v + 2 * c**2 / v**2)
    return (
        drag(h, v) + m * _GRAVITY + gain * (c**2 / (_SCALE_HEIGHT * _GRAVITY) * (1 + v / c) - 1 - 2 * c / v)
    )


def slopes(at: ocp.Point, thrust: Any) -> dict[str, Any]:
    """Return the derivatives of altitude, speed and mass under a thrust in lbf."""
    return {"h": at.v, "v": (thrust - drag(at.h, at.v)) / at.m - _GRAVITY, "m": -thrust / _EXHAUST}


def rocket(*, effort_weight: float = 0.0, rate_weight: float = 0.0) -> ocp.Problem:
    """Return the problem in one phase, as it stands or with a term that takes the singularity away.

    Parameters
    ----------
    effort_weight : float
        ε of (2.170) in ft/s: ε/2 times the integral of (T/T_max)² is added to what is minimised.
    rate_weight : float
        ε of (2.171), of the scaled thrust.

    Raises
    ------
    ValueError
        If a weight is negative.
    """
    for name, weight in (("effort_weight", effort_weight), ("rate_weight", rate_weight)):
        if weight < 0:
            raise ValueError(f"{name} = {weight} of the rocket is negative; it must be 0 or more")

    def equations(at: ocp.Point) -> ocp.Equations:
        return ocp.Equations(
            slopes(at, at.T), integrands={"effort": 0.5 * at.effort_weight * (at.T / THRUST) ** 2}
        )

    return ocp.Problem(
        "Goddard's rocket",
        ocp.Independent("t", 0.0, (20.0, 100.0)),
        _STATES,
        equations,
        controls=[ocp.Control("T", "lbf", (0, THRUST), rate_weight=rate_weight)],
        lagrange="effort",
        mayer=lambda ends: -ends.final.h,
        initial=_START,
        terminal={"m": 1.0},
        constants={"effort_weight": effort_weight},
        objective_scale=20000.0,
    )


def rocket_in_phases() -> ocp.Phases:
    """Return the problem as boost, arc and coast; the arc's thrust is :func:`arc_thrust`."""

    def on_the_arc(at: ocp.Point) -> ocp.Equations:
        thrust = arc_thrust(at.h, at.v, at.m)
        return ocp.Equations(slopes(at, thrust), {"thrust": thrust})

    early, late = (5.0, 25.0), (10.0, 40.0)
    boost = ocp.Problem(
        "boost",
        ocp.Independent("t", 0.0, early),
        _STATES,
        lambda at: ocp.Equations(slopes(at, THRUST)),
        initial=_START,
        objective_scale=20000.0,
    )
    arc = ocp.Problem(
        "arc",
        ocp.Independent("t", early, late),
        _STATES,
        on_the_arc,
        path=[ocp.Path("thrust", "lbf", (0, THRUST))],
        objective_scale=20000.0,
    )
    coast = ocp.Problem(
        "coast",
        ocp.Independent("t", late, (20.0, 100.0)),
        _STATES,
        lambda at: ocp.Equations(slopes(at, 0.0)),
        terminal={"m": 1.0},
        mayer=lambda ends: -ends.final.h,
        objective_scale=20000.0,
    )
    surface = ocp.Link(
        "singular surface",
        "lbf",
        scale=10.0,
        expression=lambda at: singular_surface(*(at.arc.initial[name] for name in "hvm")),
    )
    links = [*ocp.continuous(boost, arc), *ocp.continuous(arc, coast), surface]
    return ocp.Phases("Goddard's rocket", [boost, arc, coast], links)


def thrusts(flown: ocp.PhasedSolution) -> list[tuple[Array, Array]]:
    """Return times in s and thrusts in lbf at the nodes of every phase."""
    boost, arc, coast = flown.phases
    on_arc = arc_thrust(*(arc.at_nodes(name) for name in "hvm"))
    return [
        (boost.nodes, np.full(len(boost.nodes), THRUST)),
        (arc.nodes, on_arc),
        (coast.nodes, np.zeros(len(coast.nodes))),
    ]


def from_the_hamiltonian(arc: ocp.Solution) -> tuple[Array, Array]:
    """Return what the second derivative of the switching function by time says along the arc.

    The law :func:`arc_thrust` has no costates, which were eliminated by hand; this one has those of a
    solution, and shares only the equations of motion with it.

    Parameters
    ----------
    arc : ocp.Solution
        The phase between boost and coast, with its multipliers.

    Returns
    -------
    thrust : ndarray, shape (N,)
        Thrust in lbf at the collocation points for which the second derivative of (2.168) is zero.
    clebsch : ndarray, shape (N,)
        Left-hand side of the generalised Legendre–Clebsch condition (2.169) with k = 1, in ft/(lbf² s³).
    """
    x, costate, thrust = ca.SX.sym("x", 3), ca.SX.sym("costate", 3), ca.SX.sym("thrust")
    f = ca.vertcat(*slopes(ocp.Point(dict(zip("hvm", ca.vertsplit(x), strict=True))), thrust).values())
    hamiltonian = ca.dot(costate, f)

    def rate(expression: Any) -> Any:
        along = ca.jacobian(expression, x) @ f
        return along - ca.jacobian(expression, costate) @ ca.gradient(hamiltonian, x)

    second = ca.Function("second", [x, costate, thrust], [rate(rate(ca.jacobian(hamiltonian, thrust)))])
    states = np.array([arc[name] for name in "hvm"])
    costates = np.array([arc.costate(name) for name in "hvm"])
    # linear in the thrust, which the first derivative does not contain
    without, with_all = (
        second(states, costates, np.full((1, arc.mesh.points), value)).full().ravel()
        for value in (0.0, THRUST)
    )
    by_thrust = (with_all - without) / THRUST
    return -without / by_thrust, -by_thrust
