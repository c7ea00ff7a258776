"""What a solve that did not work says."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Control, Equations, Independent, Mesh, Problem, ProblemError, SolveError, State


def rocket(final: float = 2.0, **changes: object) -> Problem:
    """Least effort to come from 0 to `final` in 1 s at no more than 1 m/s."""
    return Problem(
        **{
            "name": "rocket",
            "independent": Independent("t", 0.0, 1.0),
            "states": [State("x", "m", (-5, 5))],
            "controls": [Control("u", "m/s", (-1, 1))],
            "equations": lambda point: Equations({"x": point.u}, integrands={"effort": point.u**2}),
            "lagrange": "effort",
            "initial": {"x": 0},
            "terminal": {"x": final},
            **changes,
        }
    )


def test_infeasible_bounds_are_told_with_equation_interval_and_place():
    with pytest.raises(SolveError) as caught:
        ocp.solve(rocket())
    message = str(caught.value)
    assert (
        "rocket: IPOPT stopped with Infeasible_Problem_Detected on mesh 1 (10 intervals, 40 points)"
        in message
    )
    assert "largest residual: defect of x, interval " in message
    assert ", t = 0." in message and message.endswith(" m")


def test_infeasible_path_constraint_is_named():
    problem = rocket(
        0.5,
        equations=lambda point: Equations({"x": point.u}, {"fence": point.x - 3.0}, {"effort": point.u**2}),
        path=[ocp.Path("fence", "m", (0, np.inf))],
    )
    with pytest.raises(
        SolveError, match=r"largest residual: path constraint fence, interval \d, t = 0\.\d s"
    ):
        ocp.solve(problem)


def test_residuals_of_a_defect_are_in_units_of_its_state():
    with pytest.raises(SolveError) as caught:
        ocp.solve(rocket())
    found = {residual.equation: residual for residual in ocp.residuals.residuals(caught.value.solution)}
    # the road is a metre too long for ten intervals: each misses some of it
    assert 0.01 < found["defect of x"].amount < 1.0 and found["defect of x"].unit == "m"
    assert found["bound of u"].amount < 1e-6


def test_equation_without_value_at_the_start_is_named_before_anything_is_solved():
    problem = rocket(
        0.5, equations=lambda p: Equations({"x": ca.sqrt(p.x - 3) + p.u}, {}, {"effort": p.u**2})
    )
    with pytest.raises(ProblemError, match="rocket: derivative of x is nan at the start, t = 0 s"):
        ocp.solve(problem)


def test_derivative_that_is_infinite_on_the_way_is_named():
    # the square root has a value at the start, x = 0, but no slope: the solver meets it first
    problem = rocket(0.5, equations=lambda p: Equations({"x": ca.sqrt(p.x) + p.u}, {}, {"effort": p.u**2}))
    with pytest.raises(SolveError) as caught:
        ocp.solve(problem)
    assert "IPOPT stopped with Invalid_Number_Detected on mesh 1" in str(caught.value)
    assert "derivative of x, derived by x, is inf in interval 0, t = 0 s" in str(caught.value)


def test_tolerance_that_is_not_reached_is_told_with_the_worst_state_and_place(hypersensitive):
    with pytest.raises(
        SolveError, match=r"above the tolerance 1.0e-06 after 1 mesh; largest error: state x, interv"
    ):
        ocp.solve(hypersensitive(), meshes=1)


def test_refinement_stops_before_a_mesh_that_is_too_large(hypersensitive):
    with pytest.raises(SolveError, match=r"next mesh would have \d+ points, more than 50; largest error"):
        ocp.solve(hypersensitive(), most_points=50)


def test_best_iterate_comes_marked_when_the_caller_asks_for_it(hypersensitive):
    solution = ocp.solve(hypersensitive(), meshes=1, accept_best=True)
    assert not solution.converged and solution.error > solution.tolerance
    assert solution.summary()["converged"] is False
    assert solution.status == "Solve_Succeeded"


def test_best_iterate_travels_with_the_failure():
    with pytest.raises(SolveError) as caught:
        ocp.solve(rocket(), iterations=2)
    assert "Maximum_Iterations_Exceeded" in str(caught.value)
    assert not caught.value.solution.converged
    assert caught.value.solution["x"].shape == (40,)


def test_failed_solve_that_is_accepted_is_marked_with_its_status():
    solution = ocp.solve(rocket(), iterations=2, accept_best=True)
    assert not solution.converged and solution.status == "Maximum_Iterations_Exceeded"


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, 1.5])
def test_tolerance_without_sense_is_refused(tolerance):
    with pytest.raises(ProblemError, match=r"is outside 0 \.\. 1"):
        ocp.solve(rocket(0.5), tolerance=tolerance)


@pytest.mark.parametrize(
    ("guess", "reason"),
    [
        ({"y": 0.0}, "the guess names 'y', which is none of: x, u"),
        ({"x": np.nan}, "the guess for problem 'rocket' has values that are not finite"),
        ({"u": lambda t: 1 / t}, "the guess for problem 'rocket' has values that are not finite"),
    ],
)
def test_guess_without_sense_is_refused(guess, reason):
    with np.errstate(divide="ignore"), pytest.raises(ProblemError, match=reason):
        ocp.solve(rocket(0.5), guess, Mesh.uniform(2, 3))


def test_solution_is_asked_for_what_it_has(hypersensitive):
    solution = ocp.solve(hypersensitive(10.0), tolerance=1e-2)
    for ask, reason in (
        (lambda: solution["y"], "has no 'y'; known: x, u"),
        (lambda: solution.parameter("x"), "'x' is a state, not a parameter"),
        (lambda: solution.at_nodes("u"), "'u' is a control; only states live at the nodes"),
        (lambda: solution.costate("u"), "'u' has no costate: it is a control"),
        (lambda: solution.path_multiplier("power"), "no path constraint is named 'power'"),
    ):
        with pytest.raises(ProblemError, match=reason):
            ask()


def test_violated_limit_is_told_with_its_value_and_unit():
    problem = rocket(
        0.5,
        equations=lambda point: Equations({"x": point.u}, {"power": 100 * point.u}, {"effort": point.u**2}),
        path=[ocp.Path("power", "kW", (-np.inf, 20.0))],
    )
    with pytest.raises(SolveError) as caught:
        ocp.solve(problem)
    rows = [str(row) for row in caught.value.residuals]
    assert any(row.startswith("path constraint power, interval ") and "kW above 20 kW" in row for row in rows)


def test_failure_brings_a_table_of_residuals_and_its_meshes():
    with pytest.raises(SolveError) as caught:
        ocp.solve(rocket())
    error = caught.value
    scaled = [row.scaled for row in error.residuals]
    assert scaled == sorted(scaled, reverse=True) and scaled[0] > 1e-3
    assert error.history == error.solution.history and len(error.history) == 1
    report = error.report()
    assert report.startswith("worst residuals:\n  defect of x, interval ")
    assert "meshes:\n  1: 10 intervals, 40 points" in report
    assert error.__notes__ == [report]


def test_time_limit_ends_the_whole_solve(hypersensitive):
    with pytest.raises(SolveError, match=r"the time limit of 0\.001 s"):
        ocp.solve(hypersensitive(), seconds=1e-3)


def test_caller_hears_every_iteration_and_can_stop(hypersensitive):
    heard = []
    solution = ocp.solve(hypersensitive(20.0), tolerance=1e-5, progress=heard.append)
    assert {told.mesh for told in heard} == set(range(1, len(solution.history) + 1))
    assert heard[-1].points == solution.mesh.points
    assert heard[-1].objective == pytest.approx(solution.objective, rel=1e-6)
    with pytest.raises(SolveError, match="IPOPT stopped with User_Requested_Stop on mesh 1"):
        ocp.solve(hypersensitive(), progress=lambda told: told.iteration >= 3)


def test_exception_of_the_callers_function_comes_through(hypersensitive):
    def impatient(told: ocp.Progress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ocp.solve(hypersensitive(), progress=impatient)


def test_tolerance_of_ipopt_that_is_too_mild_is_tightened_and_not_answered_by_more_points(hypersensitive):
    # IPOPT takes a start with defects below 1e-3 as it is, and no mesh makes them smaller
    solution = ocp.solve(hypersensitive(50.0), tolerance=1e-6, draft=1e-3)
    assert any("tighter" in record.change for record in solution.history)
    same = [a.points == b.points for a, b in pairwise(solution.history)]
    assert any(same) and solution.error < 1e-6


def test_start_in_other_units_is_refused(hypersensitive):
    solution = ocp.solve(rocket(0.5), tolerance=1e-3)
    other = rocket(0.5, states=[State("x", "km", (-5, 5))])
    with pytest.raises(ProblemError, match="'rocket' cannot start 'rocket': x is in m there and in km here"):
        ocp.solve(other, solution)


def test_option_that_ipopt_does_not_know_is_refused_by_name():
    with pytest.raises(RuntimeError, match="no_such_option"):
        ocp.solve(rocket(0.5), ipopt={"no_such_option": 1})


@pytest.mark.parametrize(
    ("range_", "reason"),
    [
        ({"initial": (2.0, 1.0)}, r"initial t = 2 \.\. 1 is not an interval"),
        ({"initial": 1.0, "final": 1.0}, r"t starts at 1\.0 and ends at 1\.0: no range is left"),
        ({"final": (np.nan, 1.0)}, "final t = nan"),
    ],
)
def test_range_without_sense_is_refused(range_, reason):
    with pytest.raises(ProblemError, match=reason):
        Independent("t", **range_)


@pytest.mark.parametrize("derivative", [np.zeros(3), [0.0, 1.0]])
def test_derivative_of_the_wrong_shape_is_named(derivative):
    with pytest.raises(ProblemError, match="derivative of state 'x' is not one number or expression"):
        ocp.solve(rocket(0.5, equations=lambda p: Equations({"x": derivative}, {}, {"effort": p.u**2})))
