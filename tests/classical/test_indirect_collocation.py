"""Claims about midpoint collocation and the penalty (2.109)."""

import casadi as ca
import numpy as np
import pytest

from thesislib.classical import bryson_denham as turn
from thesislib.classical import hypersensitive as rest
from thesislib.classical.comparison import order
from thesislib.classical.control_problem import ControlProblem
from thesislib.classical.indirect_collocation import midpoint_collocation, wall, with_wall


def test_penalty_has_the_values_of_2_109_and_is_zero_on_the_admissible_side():
    np.testing.assert_allclose(
        wall(np.array([-0.3, -0.2, -0.1, 0.0, 0.1]), 0.2, 10), [0, 0, 0.5**10, 1, 1.5**10]
    )
    s = ca.SX.sym("s")
    same = ca.Function("same", [s], [wall(s, 0.2, 10)])
    assert float(same(-0.1)) == pytest.approx(0.5**10, rel=1e-15)
    assert float(same(-0.3)) == 0.0


@pytest.mark.parametrize(("h", "n", "message"), [(0.0, 10, "h = 0.0"), (0.1, 1, "n = 1")])
def test_penalty_without_slope_is_refused(h, n, message):
    with pytest.raises(ValueError, match=message):
        with_wall(turn.bryson_denham(), lambda x: x[0], h, n)


def test_midpoint_rule_converges_with_second_order_for_states_costates_and_cost():
    steps = np.array([100, 200, 400])
    problem = rest.hypersensitive(10.0, 1.0)
    runs = [midpoint_collocation(problem, n) for n in steps]
    state = [np.max(np.abs(run.x[0] - rest.state(run.t, 1.0))) for run in runs]
    costate = [np.max(np.abs(run.costate[0] - rest.costate(run.t_costate, 1.0))) for run in runs]
    cost = [abs(run.objective - float(rest.value(1.0))) for run in runs]
    for error in (state, costate, cost):
        assert order(steps, error) == pytest.approx(2.0, abs=0.03)  # the next term is smaller by 1/100


def test_midpoint_rule_with_given_ends_is_exact_for_a_cubic_costate_problem():
    # without ceiling the effort is least for u = -2, whatever the rule: height t (1 - t), cost 2
    found = midpoint_collocation(turn.bryson_denham(), 10)
    np.testing.assert_allclose(found.u, -2.0, rtol=1e-12)
    assert found.objective == pytest.approx(2.0, rel=1e-12)
    # the midpoint rule's speed is exact, and so is the height at the grid
    np.testing.assert_allclose(found.x[0], found.t * (1 - found.t), atol=1e-12)


def test_penalised_height_tends_to_the_constrained_one():
    misses, guess = [], None
    for h in (0.1, 0.02, 0.005, 0.001):
        held = with_wall(turn.bryson_denham(), lambda x: x[0] - 1 / 9, h)
        guess = midpoint_collocation(held, 100, guess)
        misses.append(np.max(np.abs(guess.x[0] - turn.height(guess.t, 1 / 9))))
    assert misses == sorted(misses, reverse=True)
    assert misses[-1] < 1e-3  # a hundredth of the ceiling
    assert 0.5 * np.mean(guess.u**2) == pytest.approx(turn.effort(1 / 9), rel=5e-3)


def test_closed_form_under_the_ceiling_has_the_effort_it_states():
    t = np.linspace(0.0, 1.0, 100_001)
    force = np.gradient(np.gradient(turn.height(t, 1 / 9), t), t)
    assert 0.5 * np.trapezoid(force**2, t) == pytest.approx(
        turn.effort(1 / 9), rel=1e-3
    )  # of the differences
    assert turn.effort(1 / 9) == pytest.approx(4.0, rel=1e-15)


def test_ceiling_that_is_not_touched_along_an_arc_is_refused():
    with pytest.raises(ValueError, match=r"ceiling = 0\.2 is outside 0 \.\. 1/6"):
        turn.effort(0.2)


def test_free_final_time_and_too_few_intervals_are_refused():
    free = ControlProblem("free", lambda x, u: [u[0]], lambda x, u: u[0] ** 2, [0.0], None)
    with pytest.raises(ValueError, match="needs a fixed final time"):
        midpoint_collocation(free, 10)
    with pytest.raises(ValueError, match="needs at least 2"):
        midpoint_collocation(turn.bryson_denham(), 1)
