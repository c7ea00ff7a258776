"""Problems with known answers, and one that uses every feature there is."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Control, Ends, Equations, Independent, Point, Problem, State

Factory = Callable[..., Problem]


@pytest.fixture(scope="session")
def brachistochrone() -> Factory:
    """Fastest slide from rest to (2, 2) m; 0.82433866944 s for g = 9.81."""

    def equations(point: Point) -> Equations:
        return Equations(
            {
                "x": point.v * ca.sin(point.theta),
                "y": point.v * ca.cos(point.theta),
                "v": point.g * ca.cos(point.theta),
            }
        )

    def problem(g: float = 9.81, **changes: object) -> Problem:
        return Problem(
            **{
                "name": "brachistochrone",
                "independent": Independent("t", 0.0, (0.1, 10.0)),
                "states": [State("x", "m", (-1, 10)), State("y", "m", (-1, 10)), State("v", "m/s", (-5, 50))],
                "controls": [Control("theta", "rad", (-np.pi, np.pi))],
                "equations": equations,
                "mayer": lambda ends: ends.final.t,
                "initial": {"x": 0, "y": 0, "v": 0},
                "terminal": {"x": 2, "y": 2},
                "constants": {"g": g},
                **changes,
            }
        )

    return problem


@pytest.fixture(scope="session")
def bryson_denham() -> Factory:
    """Double integrator under a ceiling; for the ceiling l <= 1/6 the cost is 4/(9 l)."""

    def equations(point: Point) -> Equations:
        return Equations(
            {"x": point.v, "v": point.u}, {"clearance": point.ceiling - point.x}, {"effort": 0.5 * point.u**2}
        )

    def problem(ceiling: float = 1 / 9) -> Problem:
        return Problem(
            "Bryson–Denham",
            Independent("t", 0.0, 1.0),
            [State("x", "m", (-1, 1)), State("v", "m/s", (-10, 10))],
            equations,
            controls=[Control("u", "m/s²", (-50, 50), scale=10.0)],
            lagrange="effort",
            path=[ocp.Path("clearance", "m", (0, np.inf), scale=0.1)],
            initial={"x": 0, "v": 1},
            terminal={"x": 0, "v": -1},
            constants={"ceiling": ceiling},
        )

    return problem


@pytest.fixture(scope="session")
def hypersensitive() -> Factory:
    """Stiff at both ends, still between them; 1.3308069049 for ten thousand seconds."""

    def equations(point: Point) -> Equations:
        return Equations({"x": -(point.x**3) + point.u}, integrands={"cost": 0.5 * (point.x**2 + point.u**2)})

    def problem(final: float = 1e4) -> Problem:
        return Problem(
            "hypersensitive",
            Independent("t", 0.0, final),
            [State("x", "-", (-50, 50), scale=1.0)],
            equations,
            controls=[Control("u", "-", (-50, 50), scale=1.0)],
            lagrange="cost",
            initial={"x": 1.5},
            terminal={"x": 1.0},
        )

    return problem


@pytest.fixture(scope="session")
def following() -> Factory:
    """Follow a wave w(t) periodically at little effort; linear, with a solution by hand."""

    def equations(point: Point) -> Equations:
        miss = point.x - point.wave
        return Equations({"x": point.u}, integrands={"cost": 0.5 * (point.u**2 + miss**2)})

    def problem(wave: Callable[[np.ndarray], np.ndarray] = lambda t: np.cos(2 * np.pi * t)) -> Problem:
        return Problem(
            "following",
            Independent("t", 0.0, 1.0),
            [State("x")],
            equations,
            controls=[Control("u")],
            lagrange="cost",
            periodic=["x"],
            data={"wave": wave},
        )

    return problem


@pytest.fixture(scope="session")
def everything() -> Factory:
    """All features in one: what the derivatives and the sensitivities must get right together.

    With `free_end` the final time is the optimiser's choice and the data, which do not go with it,
    are a constant.
    """

    def equations(point: Point) -> Equations:
        x, v, u, w = point.x, point.v, point.u, point.w
        return Equations(
            {"x": v + 0.1 * w * x, "v": u - point.k * x - point.drag * v**3 + 0.2 * ca.sin(point.t)},
            {"power": u * v + point.drag * w, "reach": x * x + 0.5 * w},
            {
                "cost": 0.5 * u**2 + 0.5 * w**2 + 0.5 * (x - point.target) ** 2 + 0.1,
                "work": u**2 + 0.1 * point.k * x**2,
            },
        )

    def mayer(ends: Ends) -> ca.SX:
        return ends.final.v**2 + 0.2 * ends.initial.x * ends.final.v + 0.1 * ends.final.k**2 * ends.final.drag

    def boundary(ends: Ends) -> dict[str, ca.SX]:
        product = ends.initial.x * ends.final.x
        return {
            "ends": ends.initial.v + 0.3 * product - ends.final.offset,
            "sum": ends.final.v + ends.initial.v,
        }

    def problem(free_end: bool = False, **constants: float) -> Problem:
        values = {"drag": 0.3, "offset": 0.4, **({"target": 0.5} if free_end else {}), **constants}
        return Problem(
            "everything",
            Independent("t", 0.0, (1.0, 3.0) if free_end else 2.0, scale=0.5),
            [State("x", "m", (-4, 4), scale=0.7), State("v", "m/s", (-4, 4), scale=1.3)],
            equations,
            controls=[Control("u", "N", (-5, 5), 2.0, rate_weight=3e-3), Control("w", "-", (-1, 1))],
            parameters=[ocp.Parameter("k", "N/m", (0.5, 3))],
            lagrange="cost",
            mayer=mayer,
            path=[ocp.Path("power", "W", (-0.5, 0.6)), ocp.Path("reach", "m²", (-np.inf, 2.0))],
            integrals=[ocp.Integral("work", "J", (0.3, 0.45), scale=0.5)],
            boundary=[ocp.Boundary("ends", "m/s", (0, 0), scale=2.0), ocp.Boundary("sum", "m/s", (-1, 1))],
            boundary_equations=boundary,
            periodic=["x"],
            constants=values,
            data={} if free_end else {"target": lambda t: np.sin(3 * t)},
            objective_scale=2.0,
        )

    return problem
