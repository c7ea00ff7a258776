"""Derivatives of the optimum from one solve against central differences of two others."""

import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Mesh
from thesislib.ocp.sensitivity import density, sensitivity

TIGHT = {"optimality": 1e-11, "tolerance": 0.5}


def minimised(problem: ocp.Problem, start: ocp.Solution) -> float:
    solution = ocp.solve(problem, start, **TIGHT)
    return solution.objective + solution.regularisation


@pytest.mark.parametrize("free_end", [False, True], ids=["fixed end", "free end"])
def test_derivatives_by_all_constants_agree_with_central_differences(everything, free_end):
    mesh = Mesh.uniform(5, 4)
    solution = ocp.solve(everything(free_end), mesh=mesh, **TIGHT)
    derivatives = sensitivity(solution)
    assert set(derivatives) == set(everything(free_end).constants)
    step = 1e-3
    for name, value in everything(free_end).constants.items():
        up, down = (
            minimised(everything(free_end, **{name: value + sign * step}), solution) for sign in (1, -1)
        )
        assert derivatives[name] == pytest.approx((up - down) / (2 * step), rel=1e-5), name


def test_stronger_gravity_shortens_the_slide_as_dimensions_ask(brachistochrone):
    solution = ocp.solve(brachistochrone(), {"theta": 0.5, "t_final": 1.0}, tolerance=1e-8)
    # time goes as 1/sqrt(g)
    assert sensitivity(solution)["g"] == pytest.approx(-0.5 * solution.objective / 9.81, rel=1e-7)


def test_ceiling_is_worth_what_the_formula_of_the_cost_says(bryson_denham):
    solution = ocp.solve(bryson_denham(), mesh=Mesh.uniform(12, 6), optimality=1e-11)
    # cost 4/(9 l): a higher ceiling saves 4/(9 l^2) = 36 per metre
    assert sensitivity(solution)["ceiling"] == pytest.approx(-36, rel=1e-5)


def test_density_is_the_analytic_one_for_a_wave_to_be_followed(following):
    solution = ocp.solve(following(), tolerance=1e-7)
    omega = 2 * np.pi
    wave = np.cos(omega * solution.points)
    # d/dw of (x - w)^2/2 is w - x, and x = w/(1 + omega^2)
    expected = wave * omega**2 / (1 + omega**2)
    np.testing.assert_allclose(density(solution, "wave"), expected, atol=1e-6)


def test_density_predicts_the_change_of_the_optimum_with_the_data(following):
    solution = ocp.solve(following(), tolerance=1e-7)

    def change(t: np.ndarray) -> np.ndarray:
        return np.exp(-20 * (t - 0.3) ** 2)

    step = 1e-4
    moved = [
        minimised(following(lambda t, s=sign: np.cos(2 * np.pi * t) + s * step * change(t)), solution)
        for sign in (1, -1)
    ]
    predicted = solution.weights @ (density(solution, "wave") * change(solution.points))
    assert predicted == pytest.approx((moved[0] - moved[1]) / (2 * step), rel=1e-5)


def test_scales_do_not_enter_the_derivatives(brachistochrone):
    plain = ocp.solve(brachistochrone(), {"theta": 0.5, "t_final": 1.0}, tolerance=1e-8)
    scaled = ocp.solve(brachistochrone(objective_scale=7.0), plain, tolerance=1e-8)
    assert sensitivity(scaled)["g"] == pytest.approx(sensitivity(plain)["g"], rel=1e-6)


def test_unknown_data_are_refused(following, bryson_denham):
    solution = ocp.solve(following(), tolerance=1e-3)
    with pytest.raises(ocp.ProblemError, match="reads no data named 'wind'; known: wave"):
        density(solution, "wind")
    with pytest.raises(ocp.ProblemError, match="reads no data named 'wind'; known: none"):
        density(ocp.solve(bryson_denham(), tolerance=1e-2), "wind")


def test_solution_without_multipliers_has_no_derivatives(following):
    solution = ocp.solve(following(), tolerance=1e-3)
    bare = ocp.iterate.Iterate(**{**vars(solution.iterate), "multipliers": None})
    with pytest.raises(ocp.ProblemError, match="'following' has no multipliers"):
        sensitivity(ocp.Solution(**{**vars(solution), "iterate": bare}))


@pytest.mark.parametrize("free_end", [False, True], ids=["fixed end", "free end"])
def test_derivative_of_the_solution_agrees_with_central_differences(everything, free_end):
    mesh = Mesh.uniform(5, 4)
    solution = ocp.solve(everything(free_end), mesh=mesh, **TIGHT)
    step = 1e-4
    for name, value in everything(free_end).constants.items():
        up, down = (
            ocp.solve(everything(free_end, **{name: value + sign * step}), solution, **TIGHT)
            for sign in (1, -1)
        )
        found = ocp.sensitivity.derivative(solution, name)
        for quantity in ("x", "v", "u", "w", "k"):
            expected = (up[quantity] - down[quantity]) / (2 * step)
            # the difference of two solutions of 1e-11, over 2e-4; bounds give way by 1e-8 of their size
            np.testing.assert_allclose(found[quantity], expected, atol=3e-4, err_msg=f"{quantity} by {name}")
        for share in ("objective", "regularisation"):
            expected = (getattr(up, share) - getattr(down, share)) / (2 * step)
            assert getattr(found, share) == pytest.approx(expected, rel=1e-4, abs=1e-6), (share, name)


def test_shares_of_a_derivative_sum_to_what_the_multipliers_say(everything):
    solution = ocp.solve(everything(), mesh=Mesh.uniform(5, 4), **TIGHT)
    for name, total in sensitivity(solution).items():
        found = ocp.sensitivity.derivative(solution, name)
        assert found.objective + found.regularisation == pytest.approx(total, rel=1e-12)


def test_derivative_by_data_is_the_analytic_one_for_a_wave_to_be_followed(following):
    solution = ocp.solve(following(), mesh=Mesh.uniform(5, 10), tolerance=1e-7, optimality=1e-11)
    omega = 2 * np.pi
    found = ocp.sensitivity.derivative(solution, "wave", lambda t: np.sin(omega * t))
    # the problem is linear: a wave added is followed as the wave itself is, x = w/(1 + omega^2)
    expected = np.sin(omega * solution.points) / (1 + omega**2)
    np.testing.assert_allclose(found["x"], expected, atol=1e-6)
    np.testing.assert_allclose(
        found["u"], omega * np.cos(omega * solution.points) / (1 + omega**2), atol=1e-5
    )


def test_density_of_a_constant_integrates_to_its_sensitivity_where_it_is_in_no_end_condition(bryson_denham):
    solution = ocp.solve(bryson_denham(), mesh=Mesh.uniform(12, 6), optimality=1e-11)
    along = ocp.sensitivity.constant_density(solution, "ceiling")
    assert solution.weights @ along == pytest.approx(sensitivity(solution)["ceiling"], rel=1e-12)
    # a higher ceiling is worth something where the bead is at the ceiling only
    assert np.abs(along[(solution.points < 0.3) | (solution.points > 0.7)]).max() < 1e-3


@pytest.mark.parametrize("ask", [ocp.sensitivity.derivative, ocp.sensitivity.constant_density])
def test_derivative_by_something_unknown_is_refused(bryson_denham, ask):
    solution = ocp.solve(bryson_denham(), tolerance=0.5)
    with pytest.raises(ocp.ProblemError, match="is named 'sealing'; did you mean 'ceiling'"):
        ask(solution, "sealing")
