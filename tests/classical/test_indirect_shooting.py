"""Claims about indirect single and multiple shooting, on problems with closed forms."""

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

from thesislib.classical import hypersensitive as rest
from thesislib.classical.control_problem import ControlProblem, ConvergenceError, NecessaryConditions
from thesislib.classical.indirect_shooting import (
    largest_offset,
    multiple_shooting,
    propagate,
    single_shooting,
)

COSTATE = np.sqrt(2) - 1  # of the hypersensitive problem at x = 1


def slide(g=9.81):
    def against(x, costate):
        return [ca.atan2(-costate[0] * x[2], -(costate[1] * x[2] + costate[2] * g))]

    return ControlProblem(
        "slide",
        dynamics=lambda x, u: [x[2] * ca.sin(u[0]), x[2] * ca.cos(u[0]), g * ca.cos(u[0])],
        running_cost=lambda x, u: 0 * u[0],
        initial=[0.0, 0.0, 0.0],
        final_time=None,
        terminal_cost=lambda x, t: t,
        terminal={0: 2.0, 1: 2.0},
        minimiser=against,
    )


def cycloid_time(g=9.81):
    angle = brentq(lambda a: (a - np.sin(a)) - (1 - np.cos(a)), 1e-3, 2 * np.pi, xtol=1e-14)
    return angle * np.sqrt(2 / (1 - np.cos(angle)) / g)


@pytest.fixture(scope="module")
def shot():
    return single_shooting(rest.hypersensitive(2.0, 1.0), [0.35])


def test_single_shooting_finds_the_costate_of_the_closed_form(shot):
    assert shot.costate[0, 0] == pytest.approx(COSTATE, rel=1e-10)  # of the integrator's tolerance
    np.testing.assert_allclose(shot.x[0], rest.state(shot.t, 1.0), atol=1e-10)
    np.testing.assert_allclose(shot.u[0], -rest.costate(shot.t, 1.0), atol=1e-10)


def test_objective_is_the_optimal_cost(shot):
    assert shot.objective == pytest.approx(float(rest.value(1.0)), rel=1e-11)


def test_single_shooting_with_free_final_time_finds_the_cycloid():
    found = single_shooting(slide(), [-0.1, -0.1, -0.1], 0.9)
    assert found.objective == pytest.approx(cycloid_time(), rel=1e-11)
    assert found.t[-1] == pytest.approx(found.objective, rel=1e-15)
    np.testing.assert_allclose(found.x[:2, -1], 2.0, rtol=1e-9)


def test_multiple_shooting_with_free_final_time_finds_the_cycloid():
    guess = np.vstack((np.linspace([0, 0, 0], [2, 2, 6], 4).T, np.full((3, 4), -0.1)))
    found = multiple_shooting(slide(), guess, 0.9)
    assert found.objective == pytest.approx(cycloid_time(), rel=1e-10)


def test_multiple_shooting_reaches_a_horizon_from_a_guess_that_single_shooting_cannot_use():
    long = rest.hypersensitive(12.0, 1.0)
    with pytest.raises(ConvergenceError, match="hypersensitive, single shooting: "):
        single_shooting(long, [0.0])
    found = multiple_shooting(long, np.vstack((np.linspace(1, 0, 12), np.zeros(12))))
    assert found.costate[0, 0] == pytest.approx(COSTATE, rel=1e-10)
    np.testing.assert_allclose(found.x[0], rest.state(found.t, 1.0), atol=1e-10)


def test_transition_matrix_is_the_derivative_of_the_flow():
    conditions = NecessaryConditions(rest.hypersensitive(1.5, 1.0))
    start, step = np.array([1.0, 0.3]), 1e-5
    base = propagate(conditions, start, (0.0, 1.5)).transition[:, :, -1]
    for i in range(2):
        ends = [
            propagate(conditions, start + sign * step * np.eye(2)[i], (0.0, 1.5)).p[:, -1] for sign in (1, -1)
        ]
        np.testing.assert_allclose(
            base[:, i], (ends[0] - ends[1]) / (2 * step), rtol=1e-6
        )  # of the differences


def test_flow_keeps_phase_volume_while_errors_grow():
    t = np.linspace(0.0, 8.0, 9)
    run = propagate(NecessaryConditions(rest.hypersensitive(8.0, 1.0)), [1.0, COSTATE], t)
    matrices = np.moveaxis(run.transition, 2, 0)
    # relative errors of 1e-10 in entries of size e^8 meet in the determinant
    np.testing.assert_allclose(np.linalg.det(matrices), 1.0, atol=1e-6)
    stretch = np.linalg.norm(matrices, ord=2, axis=(1, 2))
    # the eigenvalues at rest are one and minus one; from 4 s on the state is below 0.03
    np.testing.assert_allclose(np.diff(np.log(stretch[4:])), 1.0, atol=2e-3)


def test_admissible_error_of_the_guess_shrinks_with_the_horizon():
    near, far = (largest_offset(rest.hypersensitive(t_f, 1.0), [COSTATE]) for t_f in (2.0, 6.0))
    # a quarter of a decade is the resolution, at both ends
    assert np.log(near / far) == pytest.approx(4.0, abs=2 * np.log(10) / 4)


def test_escaping_trajectory_is_reported_with_the_condition_it_cannot_meet():
    with pytest.raises(ConvergenceError, match=r"\(2\.95\) of state 0 is not finite at the guess"):
        single_shooting(rest.hypersensitive(20.0, 1.0), [0.0])


def test_missing_and_misshapen_guesses_are_refused():
    with pytest.raises(ValueError, match="final time is free and needs a guess"):
        single_shooting(slide(), [-0.1, -0.1, -0.1])
    with pytest.raises(ValueError, match=r"costate guess has shape \(2,\), and \(3,\) is needed"):
        single_shooting(slide(), [0.1, 0.2], 1.0)
    with pytest.raises(ValueError, match="entries that are not finite"):
        single_shooting(rest.hypersensitive(1.0, 1.0), [np.nan])
