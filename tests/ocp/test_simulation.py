import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Mesh

GUESS = {"theta": 0.5, "t_final": 1.0}


@pytest.fixture(scope="module")
def slide(brachistochrone):
    return ocp.solve(
        brachistochrone(), GUESS, Mesh(np.array([0, 0.2, 0.5, 1]), np.array([6, 8, 7])), tolerance=1e-8
    )


def test_accurate_solution_ends_where_it_says_under_an_independent_integrator(slide):
    simulation = ocp.simulate(slide)
    for name in ("x", "y", "v"):
        # one segment, three intervals: the miss is of the size of the error estimate
        assert simulation[name].shape == (1,)
        assert simulation.largest(name) < 100 * slide.error < 1e-6


def test_segments_restart_from_the_solution_and_cover_the_range(slide):
    simulation = ocp.simulate(slide, segments=2)
    np.testing.assert_allclose(simulation.places, slide.mesh_points[[0, 2, 3]])
    assert simulation.differences.shape == (3, 2)
    whole = ocp.simulate(slide, segments=3)
    # the first two intervals of the whole range are the first segment: both saw the same trajectory
    np.testing.assert_allclose(whole["x"], ocp.simulate(slide)["x"], atol=1e-14)


def test_segments_that_advance_together_end_as_they_do_alone(slide):
    together = ocp.simulate(slide, segments=1, tolerance=1e-12)
    for name in ("x", "y", "v"):
        alone = []
        for k in range(3):
            part = slide.mesh.boundaries[k : k + 2]
            places = slide.places(np.linspace(*part, 4001))
            # trapezoidal re-integration of the solution's own slope, far cruder, as a second opinion
            theta, v = slide.interpolate("theta", places), slide.interpolate("v", places)
            rate = {"x": v * np.sin(theta), "y": v * np.cos(theta), "v": 9.81 * np.cos(theta)}[name]
            gained = np.sum(0.5 * (rate[1:] + rate[:-1])) * (places[1] - places[0])
            first, last = slide.interpolate(name, places[[0, -1]])
            alone.append(first + gained - last)
        np.testing.assert_allclose(together[name], alone, atol=3e-8)


def test_coarse_solution_is_caught(brachistochrone):
    coarse = ocp.solve(brachistochrone(), GUESS, Mesh.uniform(1, 3), tolerance=0.5)
    simulation = ocp.simulate(coarse)
    assert max(simulation.largest(name) for name in ("x", "y", "v")) > 1e-4


def test_solution_that_was_changed_is_caught(slide):
    states = slide.iterate.states.copy()
    states[0, slide.mesh.first[1]] += 1e-3
    spoiled = ocp.Solution(
        **{**vars(slide), "iterate": ocp.iterate.Iterate(**{**vars(slide.iterate), "states": states})}
    )
    misses = ocp.simulate(spoiled, segments=1)["x"]
    # the first interval misses its end, the second starts from the wrong place, the third knows nothing
    size = slide.problem.states[0].size
    np.testing.assert_allclose(misses, [-1e-3 * size, 1e-3 * size, 0], atol=1e-6)


def test_data_and_parameters_reach_the_integrator(everything):
    solution = ocp.solve(everything(), tolerance=1e-6)
    simulation = ocp.simulate(solution, segments=1)
    assert simulation.largest("x") < 1e-5 and simulation.largest("v") < 1e-5


def test_other_methods_and_tolerances_are_taken(slide):
    rough = ocp.simulate(slide, method="RK45", tolerance=1e-3)
    fine = ocp.simulate(slide, method="Radau", tolerance=1e-9)
    reference = ocp.simulate(slide)
    assert np.abs(fine.differences - reference.differences).max() < 1e-6
    assert np.abs(rough.differences - reference.differences).max() > 1e-9


def test_unstable_dynamics_need_short_segments(hypersensitive):
    solution = ocp.solve(hypersensitive(50.0), tolerance=1e-7)
    # near x = 0 the costate direction grows as exp(t): restarts keep it from growing
    assert ocp.simulate(solution, segments=1).largest("x") < 1e-5


def test_integrator_that_gives_up_is_told_with_the_place():
    # a hole in the data that the collocation points step over and an integrator cannot
    problem = ocp.Problem(
        "holed",
        ocp.Independent("t", 0.0, 1.0),
        [ocp.State("x")],
        lambda point: ocp.Equations({"x": point.push}),
        mayer=lambda ends: ends.final.x,
        initial={"x": 0.0},
        data={"push": lambda t: np.where(np.abs(t - 0.5) < 0.01, np.nan, np.cos(60 * t))},
    )
    solution = ocp.solve(problem, mesh=Mesh.uniform(1, 4), tolerance=0.9)
    with pytest.raises(
        ocp.ProblemError, match="holed: re-integration from t = 0 s stopped: Required step size"
    ):
        ocp.simulate(solution)


@pytest.mark.parametrize("segments", [0, -2])
def test_empty_segments_are_refused(slide, segments):
    with pytest.raises(ocp.ProblemError, match="a segment holds at least one mesh interval"):
        ocp.simulate(slide, segments=segments)


def test_unknown_state_is_refused(slide):
    with pytest.raises(ocp.ProblemError, match="no state is named 'z'; known: x, y, v"):
        ocp.simulate(slide)["z"]
