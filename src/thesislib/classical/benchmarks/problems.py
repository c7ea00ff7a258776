"""Eight published optimal control problems, stated once for every package that is to solve them.

A statement is plain Python: its equations take the mathematics they need (`sin`, `cos`, `exp`) as an
argument, so that one and the same text is evaluated with CasADi's, SymPy's or NumPy's functions. The file
imports nothing beyond the standard library: packages that live in environments of their own read it too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import cos, inf, pi, radians, sin
from typing import Any

Bounds = tuple[float, float]
Guess = float | tuple[float, float] | Callable[[float], float]


@dataclass(frozen=True)
class Variable:
    """A state, control, parameter or path constraint.

    Parameters
    ----------
    name, unit : str
        Name and unit.
    bounds : (float, float)
        Smallest and largest admissible value.
    guess : float, (float, float) or callable
        Where a solver starts: a constant, a straight line from the first to the last value, or a function
        of the fraction of the range that has passed.
    initial, terminal : float, optional
        Value at either end, for a state that has one there.
    """

    name: str
    unit: str
    bounds: Bounds
    guess: Guess = 0.0
    initial: float | None = None
    terminal: float | None = None

    def guess_at(self, fraction: float) -> float:
        """Return the guess at a fraction, 0 to 1, of the range."""
        if callable(self.guess):
            return self.guess(fraction)
        if isinstance(self.guess, tuple):
            return self.guess[0] + (self.guess[1] - self.guess[0]) * fraction
        return self.guess


@dataclass(frozen=True)
class Rates:
    """What the equations give at one point: derivatives, path expressions, the integrand of the cost."""

    derivatives: Mapping[str, Any]
    path: Mapping[str, Any] = field(default_factory=dict)
    cost: Any = None


@dataclass(frozen=True)
class Statement:
    """An optimal control problem from t = 0 with its published optimum.

    Parameters
    ----------
    name : str
        Its usual name.
    states, controls : tuple of Variable
        What the optimiser chooses along the way.
    equations : callable
        From (mathematics, point) to `Rates`; the point has states, controls, parameters and `t`.
    final : float or (float, float)
        Final time, or its bounds if it is free.
    published : float
        The optimum in the literature, in the problem's own sense (a maximum is positive).
    agreement : float
        Relative distance to it that a mesh tolerance of 1e-6 should reach: 1e-6 where the optimum is
        smooth, 1e-4 where controls switch or arcs begin between mesh points.
    source : str
        Where the optimum and the statement are from.
    final_guess : float
        Guess of a free final time.
    parameters, path : tuple of Variable
        Static parameters; path constraints.
    gains : mapping
        Final minus initial value of a state whose ends are linked.
    end_cost : (str, float), optional
        The state at the end, the final time `t` or the parameter that is minimised, with its factor; without
        one, the integral of the cost is.
    """

    name: str
    states: tuple[Variable, ...]
    controls: tuple[Variable, ...]
    equations: Callable[[Any, Any], Rates]
    final: float | Bounds
    published: float
    agreement: float
    source: str
    final_guess: float = 1.0
    parameters: tuple[Variable, ...] = ()
    path: tuple[Variable, ...] = ()
    gains: Mapping[str, float] = field(default_factory=dict)
    end_cost: tuple[str, float] | None = None

    @property
    def is_maximum(self) -> bool:
        """Whether the published optimum is a maximum, of which the solvers minimise the negative."""
        return self.end_cost is not None and self.end_cost[1] < 0


def _brachistochrone() -> Statement:
    g = 9.81

    def equations(m: Any, at: Any) -> Rates:
        return Rates({"x": at.v * m.sin(at.u), "y": at.v * m.cos(at.u), "v": g * m.cos(at.u)})

    return Statement(
        "brachistochrone",
        (
            Variable("x", "m", (0, 10), (0, 2), 0, 2),
            Variable("y", "m", (0, 10), (0, 2), 0, 2),
            Variable("v", "m/s", (0, 50), (0, 6), 0),
        ),
        (Variable("u", "rad", (-pi / 2, pi / 2), 0.5),),
        equations,
        final=(0.1, 10.0),
        final_guess=1.0,
        end_cost=("t", 1.0),
        published=0.8243386694,
        agreement=1e-6,
        source="cycloid through (2, 2) m",
    )


def _hypersensitive() -> Statement:
    def equations(m: Any, at: Any) -> Rates:
        return Rates({"x": -(at.x**3) + at.u}, cost=0.5 * (at.x**2 + at.u**2))

    return Statement(
        "hypersensitive",
        (Variable("x", "-", (-50, 50), (1.5, 1), 1.5, 1),),
        (Variable("u", "-", (-50, 50), 0.0),),
        equations,
        final=10_000.0,
        published=1.3308069049,
        agreement=1e-6,
        source="Hamilton-Jacobi equation of either end layer; Rao and Mease, Automatica 35 (1999)",
    )


def _bryson_denham() -> Statement:
    def equations(m: Any, at: Any) -> Rates:
        return Rates({"x": at.v, "v": at.u}, cost=0.5 * at.u**2)

    return Statement(
        "Bryson-Denham",
        (
            Variable("x", "-", (-10, 1 / 9), 0.0, 0, 0),
            Variable("v", "-", (-10, 10), (1, -1), 1, -1),
        ),
        (Variable("u", "-", (-50, 50), 0.0),),
        equations,
        final=1.0,
        published=4.0,
        agreement=1e-4,
        source="closed form, 4/(9 l) with l = 1/9; Bryson and Ho, Applied Optimal Control (1975)",
    )


def _goddard() -> Statement:
    g, sigma, c, h0, thrust = 32.174, 5.49153484923381e-5, 1580.9425279876559, 23_800.0, 193.044

    def equations(m: Any, at: Any) -> Rates:
        drag = sigma * at.v**2 * m.exp(-at.h / h0)
        return Rates({"h": at.v, "v": (at.T - drag) / at.m - g, "m": -at.T / c})

    return Statement(
        "Goddard",
        (
            Variable("h", "ft", (0, 30_000), (0, 18_000), 0),
            Variable("v", "ft/s", (0, 15_000), 0.0, 0),
            Variable("m", "slug", (1, 3), (3, 1), 3, 1),
        ),
        (Variable("T", "lbf", (0, thrust), thrust / 2),),
        equations,
        final=(20.0, 100.0),
        final_guess=60.0,
        end_cost=("h", -1.0),
        published=18_550.8718638,
        agreement=1e-4,
        source="Bryson, Dynamic Optimization (1999), solved with the arcs' ends on the mesh",
    )


def _reentry() -> Statement:
    radius, area, scale_height = 6_371_203.92, 249.9091776, 7254.24
    rho0, mu, mass = 1.225570827014494, 3.986031954093051e14, 92_079.2525560557
    start, end = radius + 79_248.0, radius + 24_384.0

    def equations(m: Any, at: Any) -> Rates:
        pressure = 0.5 * rho0 * m.exp(-(at.r - radius) / scale_height) * at.v**2
        drag = pressure * area * (0.0785 - 0.3529 * at.alpha + 2.04 * at.alpha**2) / mass
        lift = pressure * area * (-0.2070 + 1.6756 * at.alpha) / mass
        gravity = mu / at.r**2
        cos_gamma, sin_gamma = m.cos(at.gamma), m.sin(at.gamma)
        cos_lat, sin_lat = m.cos(at.lat), m.sin(at.lat)
        turn = at.v * cos_gamma * m.sin(at.psi) * sin_lat / (at.r * cos_lat)
        return Rates(
            {
                "r": at.v * sin_gamma,
                "lon": at.v * cos_gamma * m.sin(at.psi) / (at.r * cos_lat),
                "lat": at.v * cos_gamma * m.cos(at.psi) / at.r,
                "v": -drag - gravity * sin_gamma,
                "gamma": (lift * m.cos(at.sigma) - cos_gamma * (gravity - at.v**2 / at.r)) / at.v,
                "psi": lift * m.sin(at.sigma) / (at.v * cos_gamma) + turn,
            }
        )

    return Statement(
        "re-entry",
        (
            Variable("r", "m", (radius, start), (start, end), start, end),
            Variable("lon", "rad", (-pi, pi), 0.0, 0),
            Variable("lat", "rad", (-radians(70), radians(70)), 0.0, 0),
            Variable("v", "m/s", (10, 45_000), (7802.88, 762), 7802.88, 762),
            Variable(
                "gamma",
                "rad",
                (-radians(80), radians(80)),
                (-radians(1), -radians(5)),
                -radians(1),
                -radians(5),
            ),
            Variable("psi", "rad", (-pi, pi), pi / 2, pi / 2),
        ),
        (
            Variable("alpha", "rad", (-pi / 2, pi / 2), 0.0),
            Variable("sigma", "rad", (-pi / 2, radians(1)), 0.0),
        ),
        equations,
        final=(0.0, 3000.0),
        final_guess=1000.0,
        end_cost=("lat", -1.0),
        published=0.5962764,
        agreement=1e-6,
        source="Betts, Practical Methods for Optimal Control (2010), constants in SI",
    )


def _robot() -> Statement:
    def equations(m: Any, at: Any) -> Rates:
        first, second = at.u1 - at.u2, at.u3 - at.u4
        return Rates(
            {
                "x": at.vx,
                "y": at.vy,
                "theta": at.omega,
                "vx": (first + second) * m.cos(at.theta),
                "vy": (first + second) * m.sin(at.theta),
                "omega": 0.2 * first - 0.2 * second,
            },
            {"left": at.u1 + at.u2, "right": at.u3 + at.u4},
            cost=at.u1 + at.u2 + at.u3 + at.u4,
        )

    return Statement(
        "free-flying robot",
        (
            Variable("x", "-", (-10, 10), (-10, 0), -10, 0),
            Variable("y", "-", (-10, 10), (-10, 0), -10, 0),
            Variable("theta", "rad", (-pi, pi), (pi / 2, 0), pi / 2, 0),
            Variable("vx", "-", (-2, 2), 0.0, 0, 0),
            Variable("vy", "-", (-2, 2), 0.0, 0, 0),
            Variable("omega", "-", (-1, 1), 0.0, 0, 0),
        ),
        tuple(Variable(name, "-", (0, 1), 0.0) for name in ("u1", "u2", "u3", "u4")),
        equations,
        final=12.0,
        path=(Variable("left", "-", (-inf, 1)), Variable("right", "-", (-inf, 1))),
        published=7.910154646,
        agreement=1e-4,
        source="Sakawa (1999); Betts, Practical Methods for Optimal Control (2010), example 6.14",
    )


def _soaring() -> Statement:
    rho, cd0, induced, g, mass, area = 0.002378, 0.00873, 0.045, 32.2, 5.6, 45.09703
    k = rho * area / (2 * mass)

    def equations(m: Any, at: Any) -> Rates:
        cos_gamma, sin_gamma = m.cos(at.gamma), m.sin(at.gamma)
        cos_psi, sin_psi = m.cos(at.psi), m.sin(at.psi)
        gust = at.beta * at.v * sin_gamma
        return Rates(
            {
                "x": at.v * cos_gamma * sin_psi + at.beta * at.z,
                "y": at.v * cos_gamma * cos_psi,
                "z": at.v * sin_gamma,
                "v": -k * (cd0 + induced * at.CL**2) * at.v**2 - g * sin_gamma - gust * sin_psi * cos_gamma,
                "gamma": k * at.CL * at.v * m.cos(at.phi)
                - (g * cos_gamma - gust * sin_psi * sin_gamma) / at.v,
                "psi": (k * at.CL * at.v * m.sin(at.phi) - gust * cos_psi / at.v) / cos_gamma,
            },
            {"load": k * at.CL * at.v**2 / g},
        )

    return Statement(
        "dynamic soaring",
        (
            Variable("x", "ft", (-1000, 1000), lambda tau: 500 * (cos(2 * pi * tau) - 1), 0, 0),
            Variable("y", "ft", (-1000, 1000), lambda tau: 300 * sin(2 * pi * tau), 0, 0),
            Variable("z", "ft", (0, 1000), lambda tau: 400 * (1 - cos(2 * pi * tau)), 0, 0),
            Variable("v", "ft/s", (10, 350), 150.0),
            Variable("gamma", "rad", (-radians(75), radians(75)), 0.0),
            Variable("psi", "rad", (-3 * pi, pi / 2), (-1, -1 - 2 * pi)),
        ),
        (
            Variable("CL", "-", (-0.5, 1.5), 0.5),
            Variable("phi", "rad", (-radians(75), radians(75)), -1.0),
        ),
        equations,
        final=(1.0, 30.0),
        final_guess=24.0,
        parameters=(Variable("beta", "1/s", (0.005, 0.15), 0.08),),
        path=(Variable("load", "-", (-2, 5)),),
        gains={"v": 0.0, "gamma": 0.0, "psi": -2 * pi},
        end_cost=("beta", 7.0),
        published=0.446084,
        agreement=1e-4,
        source="Zhao, Optimal Control Applications and Methods 25 (2004)",
    )


def _alp_rider() -> Statement:
    # height, time and sharpness of the four peaks
    peaks = ((3, 3, 12), (3, 6, 10), (3, 10, 6), (8, 15, 4))

    def equations(m: Any, at: Any) -> Rates:
        squares = at.x1**2 + at.x2**2 + at.x3**2 + at.x4**2
        terrain = sum(height * m.exp(-sharpness * (at.t - time) ** 2) for height, time, sharpness in peaks)
        return Rates(
            {
                "x1": -10 * at.x1 + at.u1 + at.u2,
                "x2": -2 * at.x2 + at.u1 + 2 * at.u2,
                "x3": -3 * at.x3 + 5 * at.x4 + at.u1 - at.u2,
                "x4": 5 * at.x3 - 3 * at.x4 + at.u1 + 3 * at.u2,
            },
            {"clearance": squares - terrain},
            cost=100 * squares + 0.01 * (at.u1**2 + at.u2**2),
        )

    ends = {"x1": (2, 2), "x2": (1, 3), "x3": (2, 1), "x4": (1, -2)}
    return Statement(
        "alp rider",
        tuple(Variable(name, "-", (-20, 20), (a, b), a, b) for name, (a, b) in ends.items()),
        (Variable("u1", "-", (-5000, 5000), 0.0), Variable("u2", "-", (-5000, 5000), 0.0)),
        equations,
        final=20.0,
        path=(Variable("clearance", "-", (0.01, inf)),),
        published=2030.85609,
        agreement=1e-4,
        source="Betts, Practical Methods for Optimal Control (2010), section 4.11",
    )


STATEMENTS: Mapping[str, Statement] = {
    statement.name: statement
    for statement in (
        _brachistochrone(),
        _hypersensitive(),
        _bryson_denham(),
        _goddard(),
        _reentry(),
        _robot(),
        _soaring(),
        _alp_rider(),
    )
}
