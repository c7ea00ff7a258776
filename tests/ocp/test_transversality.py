"""Conditions at the ends, which the calculus of variations asks and the solver never saw."""

import casadi as ca
import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Control, Equations, Independent, Mesh, Problem, State
from thesislib.ocp.kkt import FirstOrder
from thesislib.ocp.quadrature import FLIPPED_RADAU, RADAU
from thesislib.ocp.transversality import hamiltonian_at_ends, transversality

RULES = pytest.mark.parametrize("rule", [RADAU, FLIPPED_RADAU], ids=["Radau", "flipped Radau"])


def glide(start: float | tuple[float, float] = (0.0, 0.5)) -> Problem:
    """The brachistochrone from a free start of the clock: both ends of the range are free."""
    return Problem(
        "glide",
        Independent("t", start, (0.1, 10.0)),
        [State("x", "m", (-1, 10)), State("y", "m", (-1, 10)), State("v", "m/s", (-5, 50))],
        lambda at: Equations({"x": at.v * ca.sin(at.u), "y": at.v * ca.cos(at.u), "v": 9.81 * ca.cos(at.u)}),
        controls=[Control("u", "rad", (-3, 3))],
        mayer=lambda ends: ends.final.t - ends.initial.t,
        initial={"x": 0, "y": 0, "v": 0},
        terminal={"x": 2, "y": 2},
    )


@RULES
def test_free_ends_meet_their_conditions(rule):
    mesh = Mesh.uniform(2, 10, rule)
    solution = ocp.solve(glide(), {"u": 0.5, "t_final": 1.0}, mesh, optimality=1e-11)
    assert solution.objective == pytest.approx(0.8243386694, abs=2e-10)
    found = {condition.name: condition for condition in transversality(solution)}
    assert set(found) == {"costate v at the end", "Hamiltonian at the start", "Hamiltonian at the end"}
    for condition in found.values():
        assert abs(condition.difference) < 1e-9
    assert found["Hamiltonian at the end"].expected == -1


@RULES
def test_costates_at_both_ends_are_those_of_the_cycloid(rule):
    solution = ocp.solve(glide(0.0), {"u": 0.5, "t_final": 1.0}, Mesh.uniform(2, 10, rule), optimality=1e-11)
    for state in ("x", "y"):
        first, last = solution.costate_at_ends(state)
        # neither place enters the equations: both costates are constants
        assert first == pytest.approx(last, abs=1e-9)
    # at rest, on a slide that begins straight down, H = g λ_v = -1
    assert solution.costate_at_ends("v")[0] == pytest.approx(-1 / 9.81, rel=1e-8)
    assert solution.costate_at_ends("v")[1] == pytest.approx(0, abs=1e-9)


@RULES
def test_hamiltonian_between_the_ends_is_their_constant(rule):
    solution = ocp.solve(glide(0.0), {"u": 0.5, "t_final": 1.0}, Mesh.uniform(2, 10, rule), optimality=1e-11)
    first, last = hamiltonian_at_ends(solution)
    along = ocp.optimality.optimality(solution).hamiltonian
    np.testing.assert_allclose(np.append(along, [first, last]), -1, atol=1e-9)


def test_end_cost_and_boundary_conditions_are_in_the_conditions(everything):
    solution = ocp.solve(everything(), mesh=Mesh.uniform(10, 8), tolerance=0.5, optimality=1e-11)
    found = {condition.name: condition for condition in transversality(solution)}
    assert "costate v at the end" in found and "costate x at the end less at the start" in found
    for condition in found.values():
        # the regulariser's end terms are not in the conditions; the costates are those of the mesh
        assert condition.difference == pytest.approx(0, abs=2e-3 * max(1, abs(condition.expected)))


@RULES
def test_first_order_system_is_met_to_the_tolerance_of_the_solver(everything, rule):
    solution = ocp.solve(everything(), mesh=Mesh.uniform(5, 4, rule), tolerance=0.5, optimality=1e-10)
    rows = FirstOrder(solution).stationarity()
    assert {row.quantity for row in rows} == {"x", "v", "u", "w", "k"}
    for row in rows:
        assert row.scaled < 1e-8 and row.amount >= 0
        assert row.amount == pytest.approx(
            row.scaled * 2.0 / {"x": 0.7, "v": 1.3, "u": 2.0, "w": 1.0, "k": 3.0}[row.quantity], rel=1e-12
        )


def test_first_order_system_notices_a_wrong_multiplier(bryson_denham):
    solution = ocp.solve(bryson_denham(), mesh=Mesh.uniform(6, 5), tolerance=0.5, optimality=1e-10)
    old = solution.iterate.multipliers
    wrong = ocp.iterate.Multipliers(**{**vars(old), "costates": 1.01 * old.costates})
    spoilt = ocp.Solution(
        **{
            **vars(solution),
            "iterate": ocp.iterate.Iterate(**{**vars(solution.iterate), "multipliers": wrong}),
        }
    )
    assert max(row.scaled for row in FirstOrder(spoilt).stationarity()) > 1e-3
    assert max(row.scaled for row in FirstOrder(solution).stationarity()) < 1e-8


def test_path_multiplier_at_the_end_that_is_no_point_follows_its_neighbours():
    # follow the line from below: the push against it grows in proportion to time
    problem = Problem(
        "wall",
        Independent("t", 0.0, 1.0),
        [State("x", "m", (-5, 5))],
        lambda at: Equations({"x": at.u}, {"gap": at.u - at.t}, {"effort": 0.5 * at.u**2}),
        controls=[Control("u", "m/s", (-5, 5))],
        lagrange="effort",
        path=[ocp.Path("gap", "m/s", (0, np.inf))],
        initial={"x": 0.0},
    )
    solution = ocp.solve(problem, mesh=Mesh.uniform(3, 4), optimality=1e-11)
    # x is free at the end, so that λ = 0 and 0 = u + μ with u = t
    assert solution.path_multiplier_at_ends("gap") == pytest.approx((0.0, -1.0), abs=1e-4)
