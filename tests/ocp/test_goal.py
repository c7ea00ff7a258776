"""What state errors are worth in the objective, against problems whose optimum is known."""

import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp.goal import goal_error, resisting


def decay(points):
    """Return the mild hypersensitive problem: x' = u - x³ from 1.5 to 1 with the least ∫ x² + u²."""
    problem = ocp.Problem(
        name="decay",
        independent=ocp.Independent("t", 0.0, 10.0),
        states=[ocp.State("x", "-", (-2.0, 2.0), 1.0)],
        controls=[ocp.Control("u", "-", (-5.0, 5.0), 1.0)],
        equations=lambda at: ocp.Equations({"x": -(at.x**3) + at.u}, {}, {"cost": at.x**2 + at.u**2}),
        lagrange="cost",
        initial={"x": 1.5},
        terminal={"x": 1.0},
        objective_scale=3.0,
    )
    return ocp.solve(problem, {"x": 0.5}, ocp.Mesh.uniform(points, 3), compile_code=False, tolerance=0.9)


@pytest.fixture(scope="module")
def exact():
    return decay(200).objective


@pytest.mark.parametrize("intervals", [6, 10, 20])
def test_the_bound_holds(exact, intervals):
    solution = decay(intervals)
    found = goal_error(solution)
    assert abs(solution.objective - exact) < found.bound.sum()
    assert np.all(np.abs(found.signed) <= found.bound + 1e-15)


def test_a_solution_of_dynamics_with_a_known_error_costs_what_is_estimated(exact):
    """Push the dynamics by a small constant r: the optimum changes by ∫ λ r, as the costates tell."""
    solution = decay(200)
    r = 1e-4  # its square is a ten-thousandth of what is looked at
    problem = solution.problem
    pushed = ocp.Problem(
        **{
            **{name: getattr(problem, name) for name in problem.__dataclass_fields__},
            "equations": lambda at: ocp.Equations(
                {"x": -(at.x**3) + at.u + r}, {}, {"cost": at.x**2 + at.u**2}
            ),
        }
    )
    other = ocp.solve(pushed, solution, compile_code=False, tolerance=0.9)
    # the residual of `other` in the dynamics of `problem` is r everywhere
    worth = float(solution.weights @ (solution.costate("x") * r))
    assert other.objective - exact == pytest.approx(worth, rel=5e-3)


def test_errors_shrink_with_the_mesh():
    bounds = [goal_error(decay(intervals)).bound.sum() for intervals in (10, 20, 40)]
    assert bounds[0] > 4.0 * bounds[1] > 16.0 * bounds[2]


def test_resisting_intervals_are_those_above_the_tolerance():
    solution = decay(10)
    tolerance = float(np.sort(solution.estimate.by_interval)[-3])
    found = resisting(solution, tolerance)
    assert len(found) == 2
    assert all(each.error > tolerance for each in found)
    assert found[0].begin < found[0].end <= found[1].begin
    assert str(found[0]).startswith(f"{found[0].begin:.1f} to {found[0].end:.1f}: error ")
    assert resisting(solution, 1.0) == ()
