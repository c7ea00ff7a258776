"""Solutions against answers found in other ways."""

import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Equations, Independent, Mesh, Problem, State

GUESS = {"theta": 0.5, "t_final": 1.0}


def test_brachistochrone_takes_the_time_of_the_cycloid(brachistochrone):
    solution = ocp.solve(brachistochrone(), GUESS, tolerance=1e-8)
    # cycloid through (2, 2) m: theta from (theta - sin theta)/(1 - cos theta) = 1, T = theta sqrt(r/g)
    assert solution.objective == pytest.approx(0.8243386694, abs=2e-10)
    assert solution.parameter("t_final") == pytest.approx(solution.objective, abs=1e-15)


def test_brachistochrone_is_solved_to_spectral_accuracy_on_one_interval(brachistochrone):
    errors = [
        abs(
            ocp.solve(brachistochrone(), GUESS, Mesh.uniform(1, n), tolerance=0.9, optimality=1e-12).objective
            - 0.824338669437
        )
        for n in (5, 10, 20)
    ]
    # every doubling of the points squares the error until rounding: no algebraic rate does that
    assert errors[1] < 1e-2 * errors[0]
    assert errors[2] < 1e-10


def test_ceiling_of_bryson_and_denham_costs_what_the_calculus_says(bryson_denham):
    # with the ends of the boundary arc, 1/3 and 2/3, among the mesh points the answer is a polynomial
    solution = ocp.solve(bryson_denham(), mesh=Mesh.uniform(12, 6), optimality=1e-11)
    # IPOPT lets bounds give way by 1e-8 of their scale of 0.1 m, and a metre of ceiling is worth 36
    assert solution.objective == pytest.approx(4, abs=5e-8)
    assert solution["u"][0] == pytest.approx(-6, abs=3e-5)


def test_costates_of_bryson_and_denham_have_the_sign_of_the_cost_to_go(bryson_denham):
    solution = ocp.solve(bryson_denham(), mesh=Mesh.uniform(12, 6), optimality=1e-11)
    # u = -lambda_v, and lambda_v falls from 6 with the slope -lambda_x = -18 to zero at t = 1/3
    t = solution.points
    before = t < 0.3
    np.testing.assert_allclose(solution.costate("v")[before], 6 - 18 * t[before], atol=1e-4)
    np.testing.assert_allclose(solution.costate("x")[before], 18, atol=1e-3)
    np.testing.assert_allclose(solution["u"][before], -solution.costate("v")[before], atol=1e-6)


def test_path_multipliers_are_one_signed_and_account_for_the_costate(bryson_denham):
    solution = ocp.solve(bryson_denham(), mesh=Mesh.uniform(12, 6), optimality=1e-11)
    price = solution.path_multiplier("clearance")
    # a lower bound: multipliers are negative or, off the bound, nothing
    assert price.max() < 1e-4
    # lambda_x' = -mu dc/dx = mu, and lambda_x goes from 18 to -18
    assert solution.weights @ price == pytest.approx(-36, rel=1e-3)


def test_hypersensitive_cost_and_costate_match_the_analytic_values(hypersensitive):
    ends = np.concatenate((np.linspace(0, 30, 11), [5000.0], np.linspace(9970, 10000, 11))) / 1e4
    mesh = Mesh(ends, np.full(len(ends) - 1, 4))
    solution = ocp.solve(hypersensitive(), {"u": 0.0}, mesh, tolerance=1e-7)
    assert solution.objective == pytest.approx(1.3308069049, abs=1e-8)
    # the cost to go from x has the slope -x^3 + sqrt(x^6 + x^2) while the end is far away
    assert solution.costate("x")[0] == pytest.approx(0.31832168, abs=1e-6)


def test_hypersensitive_refinement_finds_both_layers_from_a_uniform_mesh(hypersensitive):
    solution = ocp.solve(hypersensitive(), {"u": 0.0}, tolerance=1e-6)
    assert solution.objective == pytest.approx(1.3308069, abs=1e-6)
    widths = np.diff(solution.mesh_points)
    assert widths[0] < 10 and widths[-1] < 10 and widths.max() > 500


def hump(area: float = 1.0, scale: float | None = None) -> Problem:
    """Least effort to enclose an area: x = 6 A t (1 - t), cost 6 A^2."""
    return Problem(
        "hump",
        Independent("t", 0.0, 1.0),
        [State("x")],
        lambda point: Equations({"x": point.u}, integrands={"effort": 0.5 * point.u**2, "area": point.x}),
        controls=[ocp.Control("u")],
        lagrange="effort",
        integrals=[ocp.Integral("area", "m s", (area, area), scale)],
        initial={"x": 0},
        terminal={"x": 0},
    )


@pytest.mark.parametrize("scale", [None, 0.1])
def test_integral_constraint_gives_the_parabola_of_known_cost(scale):
    solution = ocp.solve(hump(1.0, scale), mesh=Mesh.uniform(3, 4))
    assert solution.objective == pytest.approx(6, abs=1e-9)
    t = solution.nodes
    np.testing.assert_allclose(solution.at_nodes("x"), 6 * t * (1 - t), atol=1e-9)


def test_multipliers_of_the_partial_sums_are_the_price_of_the_integral():
    solution = ocp.solve(hump(0.5), mesh=Mesh.uniform(3, 4))
    # d(6 A^2)/dA = 6 at A = 1/2: enclosing more costs more, and every partial sum says so
    scale = solution.problem.objective_scale / solution.problem.integrals[0].size
    np.testing.assert_allclose(-solution.iterate.multipliers.sums * scale, -6.0, atol=1e-6)


def test_periodic_problem_is_solved_by_its_harmonic(following):
    solution = ocp.solve(following(), tolerance=1e-7)
    omega = 2 * np.pi
    assert solution.objective == pytest.approx(0.25 * omega**2 / (1 + omega**2), abs=1e-9)
    x = solution.at_nodes("x")
    assert x[0] == x[-1]
    np.testing.assert_allclose(x, np.cos(omega * solution.nodes) / (1 + omega**2), atol=1e-6)


def test_data_are_read_at_the_points_of_every_mesh():
    # nine points see nothing of the bump; data sampled on the first mesh only would stay blind to it
    problem = Problem(
        "forced",
        Independent("t", 0.0, 1.0),
        [State("x")],
        lambda point: Equations({"x": point.push}),
        mayer=lambda ends: ends.final.x,
        initial={"x": 0},
        data={"push": lambda t: np.exp(-(((t - 0.45) / 0.03) ** 2))},
    )
    solution = ocp.solve(problem, mesh=Mesh.uniform(3, 3), tolerance=1e-9)
    assert len(solution.history) > 2
    assert solution.objective == pytest.approx(0.03 * np.sqrt(np.pi), abs=1e-8)


def test_solution_of_a_problem_with_every_feature_keeps_its_constraints(everything):
    solution = ocp.solve(everything(), tolerance=1e-4)
    x, v, u, w = (solution[name] for name in ("x", "v", "u", "w"))
    power = u * v + 0.3 * w
    assert power.max() < 0.6 + 1e-6 and power.min() > -0.5 - 1e-6
    work = solution.weights @ (u**2 + 0.1 * solution.parameter("k") * x**2)
    assert 0.3 - 1e-6 < work < 0.45 + 1e-6
    first, last = (solution.at_nodes("v")[k] for k in (0, -1))
    x_end = solution.at_nodes("x")[-1]
    assert first + 0.3 * x[0] * x_end == pytest.approx(0.4, abs=1e-6)
    assert abs(first + last) < 1 + 1e-6
    assert solution.regularisation > 0


def test_free_end_has_the_hamiltonian_of_the_end_cost(everything):
    solution = ocp.solve(everything(free_end=True), tolerance=1e-6)
    assert 1.0 < solution.parameter("t_final") < 3.0
    assert solution.converged and solution.span == solution.parameter("t_final")


def test_resolve_of_a_solved_problem_takes_hardly_an_iteration(hypersensitive, bryson_denham):
    for problem in (hypersensitive(50.0), bryson_denham()):
        solution = ocp.solve(problem, tolerance=1e-5)
        again = ocp.solve(problem, solution, tolerance=1e-5)
        assert again.history[0].iterations <= 3
        assert again.objective == pytest.approx(solution.objective, rel=1e-7)


def test_warm_start_carries_over_to_a_mesh_of_halved_intervals(brachistochrone):
    solution = ocp.solve(brachistochrone(), GUESS, tolerance=1e-8)
    cold = solution.history[0].iterations
    finer = ocp.solve(brachistochrone(), solution, solution.mesh.halved(), tolerance=1e-8)
    assert finer.history[0].iterations <= 4 < cold
    assert finer.objective == pytest.approx(solution.objective, abs=1e-9)


def test_warm_start_carries_over_to_other_scales(bryson_denham, brachistochrone):
    solution = ocp.solve(brachistochrone(), GUESS)
    states = [
        State("x", "m", (-1, 10), 0.3),
        State("y", "m", (-1, 10), 3.0),
        State("v", "m/s", (-5, 50), 7.0),
    ]
    rescaled = brachistochrone(states=states, objective_scale=0.2)
    again = ocp.solve(rescaled, solution)
    assert again.history[0].iterations <= 4
    np.testing.assert_allclose(again.costate("v"), solution.costate("v"), atol=1e-6)


def test_start_from_a_solution_of_other_names_is_refused(brachistochrone, hypersensitive):
    solution = ocp.solve(hypersensitive(10.0), tolerance=1e-2)
    with pytest.raises(ocp.ProblemError, match="cannot start 'brachistochrone': their states differ"):
        ocp.solve(brachistochrone(), solution)


def test_first_mesh_does_not_decide_the_answer(hypersensitive):
    objectives = [
        ocp.solve(hypersensitive(100.0), mesh=Mesh.uniform(k, n), tolerance=1e-7).objective
        for k, n in ((5, 4), (20, 3), (8, 8))
    ]
    # the error estimate is of the states; the cost's own quadrature is coarsest with three points
    assert np.ptp(objectives) < 3e-6


def test_drafted_meshes_end_in_the_solution_that_full_ones_end_in(hypersensitive):
    full = ocp.solve(hypersensitive(50.0), tolerance=1e-6)
    drafted = ocp.solve(hypersensitive(50.0), tolerance=1e-6, draft=1e-3)
    # the last mesh is solved twice, the second time to the end
    assert drafted.history[-1].points == drafted.history[-2].points
    # two meshes of one tolerance: the cost follows the states' errors, not the draft's
    assert drafted.objective == pytest.approx(full.objective, abs=1e-6)
    assert drafted.converged


def test_regulariser_is_reported_apart_from_the_objective(everything):
    solution = ocp.solve(everything(), tolerance=1e-4)
    x, u, w = (solution[name] for name in ("x", "u", "w"))
    target = np.sin(3 * solution.points)
    running = solution.weights @ (0.5 * u**2 + 0.5 * w**2 + 0.5 * (x - target) ** 2 + 0.1)
    v_end = solution.at_nodes("v")[-1]
    ends = v_end**2 + 0.2 * x[0] * v_end + 0.1 * solution.parameter("k") ** 2 * 0.3
    assert solution.objective == pytest.approx(running + ends, rel=1e-9)


def test_every_mesh_is_one_line_of_progress(hypersensitive, caplog):
    with caplog.at_level("INFO", "thesislib.ocp.solver"):
        solution = ocp.solve(hypersensitive(50.0), tolerance=1e-5)
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == len(solution.history) > 1
    assert "hypersensitive: mesh 1, 10 intervals, 40 points, objective" in lines[0]


def test_start_that_leads_astray_is_tried_once_more_from_its_values_alone(bryson_denham):
    # a start at a far ceiling with a barrier that has all but vanished crawls along the bounds
    far = ocp.solve(bryson_denham(0.5), mesh=Mesh.uniform(12, 6), tolerance=0.5)
    limit = 20
    found = ocp.solve(bryson_denham(0.05), far, tolerance=0.5, barrier=1e-12, iterations=limit)
    assert found.converged and found.history[0].iterations > limit
    assert found.objective == pytest.approx(4 / (9 * 0.05), rel=1e-3)


def test_start_that_ends_in_a_point_without_way_out_is_led_around():
    # a straight line from 2 m/s to rest at a lower place contradicts itself, and the end is free
    problem = Problem(
        "stop",
        Independent("t", 0.0, (0.1, 20.0)),
        [State("x", "m", (-20, 20)), State("v", "m/s", (-10, 10))],
        lambda at: Equations({"x": at.v, "v": at.u}),
        controls=[ocp.Control("u", "m/s²", (-1, 1))],
        mayer=lambda ends: ends.final.t,
        initial={"x": 1.0, "v": 2.0},
        terminal={"x": 0.0, "v": 0.0},
    )
    solution = ocp.solve(problem, tolerance=1e-4)
    # brake, come back, brake: v0 + 2 √(v0²/2 + x0); the switch lies inside a mesh interval
    assert solution.objective == pytest.approx(2 + 2 * np.sqrt(3), rel=2e-4)
