import casadi as ca
import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Equations, Independent, Mesh, Problem, State
from thesislib.ocp.refinement import refined


def one(order: int, error: float, **limits: float) -> Mesh:
    return refined(Mesh.uniform(1, order), np.array([error]), 1e-6, **limits)


def test_mesh_within_tolerance_stays_as_it_is():
    mesh = Mesh(np.array([0, 0.3, 1]), np.array([4, 6]))
    same = refined(mesh, np.array([1e-6, 9e-7]), 1e-6)
    np.testing.assert_array_equal(same.boundaries, mesh.boundaries)
    np.testing.assert_array_equal(same.orders, mesh.orders)


def test_interval_gets_as_many_points_as_the_logarithm_to_its_own_base_asks():
    # log(100)/log(4) = 3.32, rounded up
    np.testing.assert_array_equal(one(4, 1e-4).orders, [8])


def test_lower_aim_adds_points_only_where_the_tolerance_is_missed():
    # log(1e3)/log(4) = 4.98, rounded up
    np.testing.assert_array_equal(one(4, 1e-4, aim=0.1).orders, [9])
    np.testing.assert_array_equal(one(4, 9e-7, aim=0.1).orders, [4])


def test_interval_just_above_tolerance_gets_one_point():
    np.testing.assert_array_equal(one(4, 1.0001e-6).orders, [5])


def test_interval_that_would_exceed_the_highest_order_is_divided():
    # log(1e4)/log(8) = 4.43: 8 + 5 = 13 points exceed 10, so ceil(13/3) intervals of 3
    mesh = one(8, 1e-2)
    np.testing.assert_array_equal(mesh.orders, [3] * 5)
    np.testing.assert_allclose(np.diff(mesh.boundaries), 0.2)


def test_division_makes_two_intervals_at_least():
    np.testing.assert_array_equal(one(4, 2e-6, lowest=5, highest=4).orders, [5, 5])


def test_single_point_interval_is_refined_though_its_logarithm_is_zero():
    assert one(1, 1e-5).points > 1


def test_only_what_is_above_tolerance_changes():
    mesh = refined(Mesh.uniform(3, 4), np.array([1e-9, 1e-4, 1e-9]), 1e-6)
    np.testing.assert_array_equal(mesh.orders, [4, 8, 4])


def decay(order: int) -> ocp.Solution:
    """x' = -3x + sin 5t from 1 on one interval; no control: collocation of a plain equation."""
    problem = Problem(
        "decay",
        Independent("t", 0.0, 1.0),
        [State("x", bounds=(-2, 2), scale=1.0)],
        lambda point: Equations({"x": -3 * point.x + ca.sin(5 * point.t)}),
        mayer=lambda ends: ends.final.x,
        initial={"x": 1.0},
    )
    return ocp.solve(problem, mesh=Mesh.uniform(1, order), tolerance=0.5)


def exact(t: np.ndarray) -> np.ndarray:
    return (1 + 5 / 34) * np.exp(-3 * t) + (3 * np.sin(5 * t) - 5 * np.cos(5 * t)) / 34


@pytest.mark.parametrize("order", [4, 5, 6, 7, 8])
def test_error_estimate_is_of_the_size_of_the_true_error(order):
    solution = decay(order)
    places = np.linspace(0, 1, 200)
    miss = np.abs(solution.interpolate("x", places) - exact(places)).max() / 2
    # the estimate integrates along the wrong trajectory: right in size, not in digits
    assert 1 / 3 < solution.error / miss < 3


def test_error_estimate_names_the_interval_that_is_worst():
    def equations(point):
        return Equations({"x": ca.exp(-(((point.t - 0.7) / 0.05) ** 2))})

    problem = Problem(
        "bump", Independent("t", 0, 1), [State("x")], equations, mayer=lambda e: e.final.x, initial={"x": 0}
    )
    solution = ocp.solve(problem, mesh=Mesh.uniform(10, 4), tolerance=0.5)
    assert solution.estimate.by_interval.argmax() in (6, 7)
    assert 0.6 <= solution.places(solution.estimate.place)[0, solution.estimate.by_interval.argmax()] <= 0.8


def coarser(errors: list[float], orders: list[int], **options: object) -> ocp.refinement.Refinement:
    mesh = Mesh(np.linspace(0, 1, len(orders) + 1), np.array(orders))
    return ocp.refinement.refine(mesh, np.array(errors), 1e-6, reduction=1e-3, **options)


def test_interval_far_below_tolerance_loses_the_points_that_the_same_rule_would_give_it():
    # √1e-3 times 1e-6 over 1e-12 is 3.2e4: log to the base 8 is 4.98, rounded down
    found = coarser([1e-12, 2e-6], [8, 4])
    np.testing.assert_array_equal(found.mesh.orders, [4, 5])
    assert (found.reduced, found.grown, found.merged) == (1, 1, 0)


def test_neighbours_far_below_tolerance_become_one():
    found = coarser([1e-12, 1e-12, 1e-12, 2e-6], [3, 3, 3, 4])
    np.testing.assert_allclose(found.mesh.boundaries, [0, 0.5, 0.75, 1])
    assert found.merged == 1
    assert str(found) == "intervals: 1 with more points, 1 merged"


def test_what_was_refined_once_is_not_reduced():
    found = coarser([1e-12, 1e-12, 2e-6], [8, 8, 4], keep=np.array([True, False, False]))
    assert found.mesh.orders[0] == 8 and found.mesh.orders[1] < 8


def test_mesh_within_tolerance_is_not_reduced():
    found = coarser([1e-12, 1e-12], [8, 8])
    np.testing.assert_array_equal(found.mesh.orders, [8, 8])
    assert str(found) == "unchanged"


def test_reduction_ends_and_costs_no_accuracy(hypersensitive):
    plain = ocp.solve(hypersensitive(), {"u": 0.0}, tolerance=1e-6, reduction=0.0)
    lean = ocp.solve(hypersensitive(), {"u": 0.0}, tolerance=1e-6)
    assert lean.mesh.points < 0.95 * plain.mesh.points
    assert lean.objective == pytest.approx(plain.objective, abs=1e-7)
    assert any("merged" in record.change for record in lean.history)


def test_error_does_not_depend_on_how_far_away_the_bounds_are():
    def wide(bound: float) -> ocp.Solution:
        problem = Problem(
            "decay",
            Independent("t", 0.0, 1.0),
            [State("x", bounds=(-bound, bound))],
            lambda point: Equations({"x": -3 * point.x + ca.sin(5 * point.t)}),
            mayer=lambda ends: ends.final.x,
            initial={"x": 1.0},
        )
        return ocp.solve(problem, mesh=Mesh.uniform(3, 4), tolerance=0.5, optimality=1e-12)

    assert wide(100.0).error == pytest.approx(wide(1.0).error, rel=1e-6)


def test_history_says_what_was_done_and_why_it_ended(hypersensitive):
    solution = ocp.solve(hypersensitive(50.0), tolerance=1e-6)
    assert all(record.change.startswith("intervals: ") for record in solution.history[:-1])
    assert solution.stopped.startswith("error ") and "within 1.0e-06" in solution.stopped
    with pytest.raises(ocp.SolveError) as caught:
        ocp.solve(hypersensitive(), meshes=2)
    assert "after 2 meshes" in caught.value.solution.stopped
