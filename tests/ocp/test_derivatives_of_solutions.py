"""How solutions change with bounds, and with constants on a part of the range."""

import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Control, Equations, Independent, Mesh, Problem, State
from thesislib.ocp.derivatives import Derivatives
from thesislib.ocp.sensitivity import constant_density

TIGHT = {"optimality": 1e-11, "tolerance": 0.5}


def under_ceiling(ceiling: float) -> Problem:
    """Bryson–Denham with the ceiling as the upper bound of a state; its cost is 4/(9 l)."""
    return Problem(
        "under a ceiling",
        Independent("t", 0.0, 1.0),
        [State("x", "m", (-1, ceiling)), State("v", "m/s", (-10, 10), scale=2.0)],
        lambda point: Equations({"x": point.v, "v": point.u}, integrands={"effort": 0.5 * point.u**2}),
        controls=[Control("u", "m/s²", (-50, 50), scale=10.0)],
        lagrange="effort",
        initial={"x": 0, "v": 1},
        terminal={"x": 0, "v": -1},
        objective_scale=3.0,
    )


def test_bound_of_a_state_moves_the_solution_as_two_others_say() -> None:
    # it meets the ceiling at 3 l = 0.3, inside an interval: at a mesh point its answer would have two slopes
    mesh, ceiling, step = Mesh.uniform(12, 6), 0.1, 1e-5
    solution = ocp.solve(under_ceiling(ceiling), mesh=mesh, **TIGHT)
    found = Derivatives(solution).by_bounds("x", upper=1.0)
    assert found.objective == pytest.approx(
        -4 / (9 * ceiling**2), rel=2e-2
    )  # an interval has the kink inside
    up, down = (ocp.solve(under_ceiling(ceiling + sign * step), solution, **TIGHT) for sign in (1, -1))
    for quantity in ("x", "v", "u"):
        expected = (up[quantity] - down[quantity]) / (2 * step)
        # two solutions of 1e-11, over 2e-5; bounds give way by 1e-8 of their size
        np.testing.assert_allclose(found[quantity], expected, atol=2e-3 * np.abs(expected).max())
    assert found.objective == pytest.approx((up.objective - down.objective) / (2 * step), rel=1e-4)


def test_bound_of_a_path_constraint_does_what_its_constant_does(bryson_denham) -> None:
    derivatives = Derivatives(ocp.solve(bryson_denham(), mesh=Mesh.uniform(12, 6), optimality=1e-11))
    by_bound, by_constant = derivatives.by_bounds("clearance", lower=-1.0), derivatives.by("ceiling")
    for quantity in ("x", "v", "u"):
        np.testing.assert_allclose(by_bound[quantity], by_constant[quantity], atol=1e-6)
    assert by_bound.objective == pytest.approx(by_constant.objective, rel=1e-9)


def test_bounds_of_something_unknown_are_refused(bryson_denham) -> None:
    derivatives = Derivatives(ocp.solve(bryson_denham(), tolerance=0.5))
    with pytest.raises(ocp.ProblemError, match="'height'"):
        derivatives.by_bounds("height", upper=1.0)


def test_constant_on_two_parts_of_the_range_does_what_it_does_on_the_whole(bryson_denham) -> None:
    solution = ocp.solve(bryson_denham(), mesh=Mesh.uniform(12, 6), optimality=1e-11)
    derivatives = Derivatives(solution)
    early = (solution.points < 0.5).astype(float)
    first, second = derivatives.by("ceiling", early), derivatives.by("ceiling", lambda t: t >= 0.5)
    whole = derivatives.by("ceiling")
    np.testing.assert_allclose(first["x"] + second["x"], whole["x"], atol=1e-9)
    density = constant_density(solution, "ceiling")
    assert first.objective + first.regularisation == pytest.approx(solution.weights @ (density * early))
    # the bead meets the ceiling in the middle: half of it is half of the whole
    assert first.objective == pytest.approx(0.5 * whole.objective, rel=1e-3)
