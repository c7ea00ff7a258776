import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Mesh
from thesislib.ocp.optimality import optimality

GUESS = {"theta": 0.5, "t_final": 1.0}


@pytest.fixture(scope="module")
def slide(brachistochrone):
    return ocp.solve(brachistochrone(), GUESS, Mesh.uniform(4, 10), tolerance=1e-8, optimality=1e-11)


@pytest.mark.parametrize("where", ["between", "collocation"])
def test_accurate_solution_satisfies_every_condition_everywhere(slide, where):
    found = optimality(slide, where)
    assert list(found.residuals) == ["costate x", "costate y", "costate v", "control theta", "hamiltonian"]
    for name, values in found.residuals.items():
        assert values.shape == found.places.shape == (40,)
        assert values.max() < 1e-4, name
    assert set(found.share(1e-4).values()) == {1.0}


def test_hamiltonian_of_a_minimum_time_problem_is_minus_one(slide):
    # d(optimal time)/d(time spent) = -H: with time itself as the cost, H = -1 from start to end
    np.testing.assert_allclose(optimality(slide).hamiltonian, -1, atol=1e-6)


def test_coarse_solution_violates_the_conditions_between_its_points_only(brachistochrone):
    coarse = ocp.solve(brachistochrone(), GUESS, Mesh.uniform(1, 3), tolerance=0.5, optimality=1e-11)
    assert optimality(coarse, "collocation").residuals["control theta"].max() < 1e-8
    assert optimality(coarse, "between").residuals["control theta"].max() > 1e-3


def test_feasible_solution_that_is_not_optimal_is_caught(brachistochrone, slide):
    # the multipliers of another gravity are near, but not those of this solution
    other = ocp.solve(brachistochrone(g=7.0), slide)
    mixed = ocp.iterate.Iterate(
        **{
            **vars(slide.iterate),
            "multipliers": other.iterate.multipliers,
            "controls": slide.iterate.controls + 0.01,
        }
    )
    spoiled = ocp.Solution(**{**vars(slide), "iterate": mixed})
    share = optimality(spoiled).share(1e-3)
    assert share["control theta"] < 0.5
    assert share["hamiltonian"] < 0.9


def test_path_multipliers_are_part_of_the_conditions(bryson_denham):
    solution = ocp.solve(bryson_denham(), mesh=Mesh.uniform(12, 6), optimality=1e-11)
    found = optimality(solution, "collocation")
    # on the ceiling the price of height changes only through the path multiplier; where the arc is
    # entered and left it acts at a single point, which no polynomial follows
    assert found.share(1e-3)["costate x"] > 0.8
    assert found.share(1e-3)["costate v"] > 0.9
    assert found.residuals["control u"].max() < 1e-6
    without = ocp.iterate.Multipliers(
        **{**vars(solution.iterate.multipliers), "path": np.zeros_like(solution.iterate.multipliers.path)}
    )
    bare = ocp.Solution(
        **{
            **vars(solution),
            "iterate": ocp.iterate.Iterate(**{**vars(solution.iterate), "multipliers": without}),
        }
    )
    assert optimality(bare, "collocation").share(1e-3)["costate x"] < 0.8


def test_explicit_dependence_on_data_and_time_is_counted(everything, following):
    wave = ocp.solve(following(), mesh=Mesh.uniform(10, 8), tolerance=1e-7, optimality=1e-11)
    found = optimality(wave)
    # H varies with the wave, by far more than the residual
    assert np.ptp(found.hamiltonian) > 0.1
    assert found.residuals["hamiltonian"].max() < 1e-4
    forced = ocp.solve(everything(), mesh=Mesh.uniform(10, 6), tolerance=1e-6, optimality=1e-10)
    assert optimality(forced).share(1e-2)["hamiltonian"] > 0.6


def test_every_feature_together_satisfies_the_solved_conditions(everything):
    solution = ocp.solve(everything(), mesh=Mesh.uniform(10, 6), tolerance=1e-6, optimality=1e-11)
    found = optimality(solution, "collocation")
    assert found.residuals["control u"].max() < 1e-6
    assert found.residuals["control w"].max() < 1e-6
    # all points but the first of an interval, where the costate may jump
    inside = np.ones(solution.mesh.points, dtype=bool)
    inside[solution.mesh.first] = False
    assert found.residuals["costate x"][inside].max() < 1e-5
    assert found.residuals["costate v"][inside].max() < 1e-5


def test_regulariser_takes_its_share_of_the_hamiltonian():
    problem = ocp.Problem(
        "smoothed",
        ocp.Independent("t", 0.0, 2.0, scale=0.5),
        [ocp.State("x")],
        lambda point: ocp.Equations({"x": point.u}, integrands={"cost": 0.5 * point.u**2 + 50 * point.x**2}),
        controls=[ocp.Control("u", rate_weight=1.0)],
        lagrange="cost",
        initial={"x": 1.0},
        terminal={"x": -1.0},
        objective_scale=3.0,
    )
    solution = ocp.solve(problem, mesh=Mesh.uniform(20, 6), tolerance=0.5, optimality=1e-11)
    found = optimality(solution).hamiltonian
    # 3/2 (du/ds)^2 with s in units of 0.5: by so much H changes if the control's slope is left out
    share = 0.5 * 3 * 0.5 * np.gradient(solution["u"], solution.points) ** 2
    assert np.ptp(share[8:-8]) > 4
    # the solver's slopes are differences between unevenly spaced points, good to a few per cent
    assert np.ptp(found[8:-8]) < 0.05 * np.ptp(share[8:-8])


def test_residuals_relative_to_the_range_are_the_smaller_ones(everything):
    solution = ocp.solve(everything(), mesh=Mesh.uniform(10, 6), tolerance=1e-6, optimality=1e-11)
    strict, wide = (optimality(solution, relative_to=size).residuals for size in ("point", "range"))
    for name in strict:
        assert np.all(wide[name] <= strict[name])
        # the same residuals in another unit: the largest term is somewhere, and there they agree
        assert np.any(wide[name] > 0.1 * strict[name])


def test_solution_without_multipliers_is_refused(slide):
    bare = ocp.iterate.Iterate(**{**vars(slide.iterate), "multipliers": None})
    with pytest.raises(ocp.ProblemError, match="'brachistochrone' has no multipliers"):
        optimality(ocp.Solution(**{**vars(slide), "iterate": bare}))
