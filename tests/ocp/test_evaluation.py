import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Mesh, ProblemError
from thesislib.ocp.quadrature import FLIPPED_RADAU, RADAU

RULES = pytest.mark.parametrize("rule", [RADAU, FLIPPED_RADAU], ids=["Radau", "flipped Radau"])


@RULES
@pytest.mark.parametrize("periodic", ["x", ""], ids=["periodic", "not periodic"])
def test_both_forms_of_collocation_have_the_same_solution(everything, rule, periodic):
    statement = {**vars(everything()), "periodic": [periodic] if periodic else []}
    problem, mesh = ocp.Problem(**statement), Mesh.uniform(4, 5, rule)
    options = {"mesh": mesh, "tolerance": 0.5, "optimality": 1e-11}
    by_slopes = ocp.solve(problem, **options)
    by_integrals = ocp.solve(problem, form="integral", **options)
    assert by_integrals.objective == pytest.approx(by_slopes.objective, abs=1e-10)
    for name in ("x", "v", "u", "k"):
        np.testing.assert_allclose(by_integrals[name], by_slopes[name], atol=1e-10)
    for name in ("x", "v"):
        np.testing.assert_allclose(by_integrals.costate(name), by_slopes.costate(name), atol=1e-7)


def test_unknown_form_is_refused(everything):
    with pytest.raises(ProblemError, match="form 'weak' is neither 'differential' nor 'integral'"):
        ocp.solve(everything(), form="weak")


@RULES
def test_warm_start_from_the_other_form_is_a_start_from_the_solution(everything, rule):
    mesh = Mesh.uniform(4, 5, rule)
    first = ocp.solve(everything(), mesh=mesh, tolerance=0.5, optimality=1e-9)
    again = ocp.solve(everything(), first, tolerance=0.5, optimality=1e-9, form="integral")
    assert again.history[0].iterations <= 3


def test_flipped_points_solve_what_radau_points_solve(hypersensitive):
    ours = ocp.solve(hypersensitive(20.0), mesh=Mesh.uniform(10, 6), tolerance=1e-8)
    theirs = ocp.solve(hypersensitive(20.0), mesh=Mesh.uniform(10, 6, FLIPPED_RADAU), tolerance=1e-8)
    assert theirs.objective == pytest.approx(ours.objective, abs=1e-8)
    assert theirs.costate_at_ends("x")[0] == pytest.approx(ours.costate_at_ends("x")[0], abs=1e-5)
    assert theirs.simulate().largest("x") < 1e-5


def test_flipped_points_start_where_the_slope_is_infinite():
    # x' = 1/(2 √t) has no value at t = 0, which flipped points leave out
    problem = ocp.Problem(
        "root",
        ocp.Independent("t", 0.0, 1.0),
        [ocp.State("x", "m", (-1, 2))],
        lambda at: ocp.Equations({"x": 0.5 / at.t**0.5}),
        mayer=lambda ends: ends.final.x,
        initial={"x": 0.0},
    )
    with pytest.raises(ProblemError, match="derivative of x is inf at the start, t = 0 s"):
        ocp.solve(problem, tolerance=0.5)
    found = ocp.solve(problem, mesh=Mesh.uniform(20, 8, FLIPPED_RADAU), tolerance=0.5)
    # Gauss quadrature of 1/√t converges with the square root of the first width only
    assert found.objective == pytest.approx(1.0, abs=2e-2)


@pytest.mark.parametrize("rule", [ocp.quadrature.GAUSS, ocp.quadrature.LOBATTO])
def test_mesh_of_points_that_cannot_be_collocated_is_refused(rule):
    with pytest.raises(
        ValueError, match="collocation takes Radau points or flipped ones, not Legendre–Gauss"
    ):
        Mesh.uniform(3, 4, rule)


def test_integrals_are_those_of_the_equations(everything):
    solution = ocp.solve(everything(), tolerance=1e-4)
    x, u = solution["x"], solution["u"]
    work = solution.weights @ (u**2 + 0.1 * solution.parameter("k") * x**2)
    assert solution.integral("work") == pytest.approx(work, rel=1e-12)
    # the constraint on it is active: between 0.3 and 0.45
    assert 0.3 - 1e-6 < solution.integral("work") < 0.45 + 1e-6
    with pytest.raises(ProblemError, match="no integral is named 'worth'; did you mean 'work'"):
        solution.integral("worth")


def test_integral_that_is_minimised_is_the_objective(hypersensitive):
    solution = ocp.solve(hypersensitive(20.0), tolerance=1e-5)
    assert solution.integral("cost") == pytest.approx(solution.objective, rel=1e-12)


def test_defects_of_a_solution_vanish_and_those_of_a_guess_do_not(brachistochrone):
    guess = {"theta": 0.5, "t_final": 1.0}
    solution = ocp.solve(brachistochrone(), guess, tolerance=1e-6)
    # IPOPT takes constraints within 1e-8 of their scale, up to 50 m/s, as met
    assert all(row.shape == (10,) and row.max() < 1e-7 for row in solution.defects().values())
    begun = ocp.solve(brachistochrone(), guess, iterations=1, accept_best=True)
    assert begun.defects()["v"].max() > 1e-3


def test_solution_on_another_mesh_keeps_what_it_is(everything):
    solution = ocp.solve(everything(), mesh=Mesh.uniform(6, 8), tolerance=1e-4, optimality=1e-10)
    carried = solution.resample(Mesh.uniform(9, 7))
    assert not carried.converged and carried.stopped == "carried to another mesh, not solved there"
    assert carried.mesh.intervals == 9
    places = np.linspace(0, 2, 50)
    for name in ("x", "v", "u"):
        before, after = solution.interpolate(name, places), carried.interpolate(name, places)
        np.testing.assert_allclose(after, before, atol=2e-2 * np.abs(before).max())
    assert carried.parameter("k") == solution.parameter("k")
    assert carried.integral("work") == pytest.approx(solution.integral("work"), rel=1e-3)
    assert carried.objective == pytest.approx(solution.objective, rel=1e-3)
    finer = solution.resample(solution.mesh.halved())
    # the same polynomials: nothing is lost on a mesh that contains the old one
    assert finer.objective == pytest.approx(solution.objective, rel=1e-6)
    assert finer.weights @ finer.path_multiplier("power") == pytest.approx(
        solution.weights @ solution.path_multiplier("power"), rel=0.1, abs=1e-6
    )
