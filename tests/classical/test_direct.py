"""Claims about the direct methods, their multipliers, and their refusals."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thesislib.classical import bryson_denham as turn
from thesislib.classical import hypersensitive as rest
from thesislib.classical.comparison import order
from thesislib.classical.control_problem import ControlProblem, ConvergenceError
from thesislib.classical.direct import (
    direct_multiple_shooting,
    direct_single_shooting,
    euler_collocation,
    euler_conditions,
)

PROBLEM = rest.hypersensitive(10.0, 1.0)
METHODS = [direct_single_shooting, direct_multiple_shooting, euler_collocation]


def test_single_and_multiple_shooting_are_the_same_programme():
    single, multiple = direct_single_shooting(PROBLEM, 40), direct_multiple_shooting(PROBLEM, 40)
    # both are solved to 1e-11 in the gradient, and the least curvature is that of a last interval of 1/4 s
    np.testing.assert_allclose(single.u, multiple.u, atol=1e-8)
    np.testing.assert_allclose(single.x, multiple.x, atol=1e-8)
    np.testing.assert_allclose(single.costate, multiple.costate, atol=1e-8)
    assert (single.unknowns, multiple.unknowns) == (40, 81)


def test_trajectory_of_multiple_shooting_is_that_of_an_independent_integrator():
    found = direct_multiple_shooting(PROBLEM, 40, substeps=8)
    x = np.array([1.0])
    for left, right, u, state in zip(found.t[:-1], found.t[1:], found.u[0], found.x[0, 1:], strict=True):
        x = solve_ivp(lambda t, x, u=u: -(x**3) + u, (left, right), x, rtol=1e-11, atol=1e-13).y[:, -1]
        assert x[0] == pytest.approx(state, abs=1e-7)  # Runge's and Kutta's fourth order, steps of 1/32 s


def test_shooting_converges_with_second_order_and_euler_with_first():
    steps = np.array([50, 100, 200])
    exact = float(rest.value(1.0))
    shots = [direct_multiple_shooting(PROBLEM, n) for n in steps]
    assert order(steps, [abs(run.objective - exact) for run in shots]) == pytest.approx(2.0, abs=0.05)
    eulers = [euler_collocation(PROBLEM, n) for n in 4 * steps]
    state = [np.max(np.abs(run.x[0] - rest.state(run.t, 1.0))) for run in eulers]
    assert order(steps, state) == pytest.approx(1.0, abs=0.05)  # steps are 1/20 s and shorter


def test_multipliers_of_euler_collocation_tend_to_the_costates_with_first_order():
    steps = np.array([200, 400, 800])
    runs = [euler_collocation(PROBLEM, n) for n in steps]
    error = [np.max(np.abs(run.costate[0] - rest.costate(run.t_costate, 1.0))) for run in runs]
    # the second-order term is a tenth of the first at 200 steps, and a fortieth at 800
    assert order(steps, error) == pytest.approx(1.0, abs=0.1)
    assert order(steps[1:], error[1:]) < order(steps[:2], error[:2])
    assert error[-1] < 2e-3


@pytest.mark.parametrize("method", METHODS)
def test_first_costate_is_the_derivative_of_the_optimal_cost_by_the_start(method):
    step = 1e-4
    costs = [method(rest.hypersensitive(4.0, 1.0 + sign * step), 30).objective for sign in (1, -1)]
    slope = (costs[0] - costs[1]) / (2 * step)
    # central differences are right to step^2; IPOPT's cost to 1e-11
    assert method(rest.hypersensitive(4.0, 1.0), 30).costate[0, 0] == pytest.approx(slope, abs=1e-6)


def test_conditions_2_128_to_2_131_hold_with_the_multipliers_of_ipopt():
    residuals = euler_conditions(PROBLEM, euler_collocation(PROBLEM, 100))
    assert list(residuals) == ["(2.128)", "(2.129)", "(2.130)", "(2.131)"]
    assert max(residuals.values()) < 1e-10  # of IPOPT's tolerance, 1e-11


def test_conditions_do_not_hold_with_costates_shifted_by_a_step():
    found = euler_collocation(PROBLEM, 100)
    shifted = type(found)(**{**found.__dict__, "costate": np.roll(found.costate, 1, axis=1)})
    assert euler_conditions(PROBLEM, shifted)["(2.129)"] > 1e-3


@pytest.mark.parametrize("method", METHODS)
def test_given_end_states_are_met(method):
    found = method(turn.bryson_denham(), 50)
    np.testing.assert_allclose(found.x[:, -1], [0.0, -1.0], atol=1e-9)
    # 2 without ceiling; Euler's rule is of first order
    assert found.objective == pytest.approx(2.0, rel=0.1 if method is euler_collocation else 1e-8)


def test_transversality_is_not_asked_of_given_ends():
    residuals = euler_conditions(turn.bryson_denham(), euler_collocation(turn.bryson_denham(), 20))
    assert np.isnan(residuals["(2.131)"])
    assert max(residuals[name] for name in ("(2.128)", "(2.129)", "(2.130)")) < 1e-9


@pytest.mark.parametrize("method", [direct_multiple_shooting, euler_collocation])
def test_problem_that_cannot_be_solved_names_the_largest_residual(method):
    # a speed that is never negative cannot bring the state down
    stuck = ControlProblem(
        "stuck", lambda x, u: [u[0] ** 2], lambda x, u: u[0] ** 2, [1.0], 1.0, terminal={0: 0.0}
    )
    with pytest.raises(ConvergenceError, match=r"^stuck, .*: IPOPT says .*largest residual is equation"):
        method(stuck, 5)


@pytest.mark.parametrize("method", METHODS)
def test_no_intervals_and_free_times_are_refused(method):
    with pytest.raises(ValueError, match="intervals = 0 must be at least 1"):
        method(PROBLEM, 0)
    free = ControlProblem("free", lambda x, u: [ca.sin(u[0])], lambda x, u: u[0] ** 2, [0.0], None)
    with pytest.raises(ValueError, match="needs a fixed final time"):
        method(free, 10)
