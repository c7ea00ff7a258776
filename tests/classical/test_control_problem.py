"""Claims about problems and their necessary conditions."""

import casadi as ca
import numpy as np
import pytest

from thesislib.classical import hypersensitive as rest
from thesislib.classical.control_problem import ControlProblem, NecessaryConditions


def pendulum(**changes):
    return ControlProblem(
        **{
            "name": "pendulum",
            "dynamics": lambda x, u: [x[1], u[0] - ca.sin(x[0])],
            "running_cost": lambda x, u: 0.5 * (x[0] ** 2 + u[0] ** 2) + 0.1 * u[0] * x[1],
            "initial": [1.0, 0.5],
            "final_time": 2.0,
            "terminal_cost": lambda x, t: x[0] ** 2 + 3 * x[1],
            **changes,
        }
    )


def test_canonical_equations_are_central_differences_of_the_hamiltonian():
    conditions = NecessaryConditions(pendulum())
    p, u, step = np.array([0.3, -0.7, 1.1, 0.4]), 0.6, 1e-6

    def slope(i):
        ends = [float(conditions.hamiltonian(p + sign * step * np.eye(4)[i], u)) for sign in (1, -1)]
        return (ends[0] - ends[1]) / (2 * step)

    rates = conditions.canonical(p, u).full().ravel()
    # central differences are right to step^2, and rounding adds 1e-16 / step
    np.testing.assert_allclose(rates[:2], [slope(2), slope(3)], atol=1e-9)
    np.testing.assert_allclose(rates[2:], [-slope(0), -slope(1)], atol=1e-9)


def test_control_found_for_a_quadratic_hamiltonian_has_the_least_of_all():
    conditions = NecessaryConditions(pendulum())
    p = np.array([0.3, -0.7, 1.1, 0.4])
    best = float(conditions.control(p))
    least = float(conditions.hamiltonian(p, best))
    others = [float(conditions.hamiltonian(p, u)) for u in np.linspace(best - 3, best + 3, 61)]
    assert least <= min(others) + 1e-14  # the grid holds the minimiser itself, up to rounding
    assert abs(float(conditions.stationarity(p, best))) < 1e-14


def test_end_conditions_are_transversality_where_free_and_the_value_where_given():
    p, t_f = np.array([0.3, -0.7, 1.1, 0.4]), 2.0
    free = NecessaryConditions(pendulum()).end(p, t_f).full().ravel()
    np.testing.assert_allclose(free, [1.1 - 2 * 0.3, 0.4 - 3.0], rtol=1e-15)
    given = NecessaryConditions(pendulum(terminal={1: 0.25}))
    np.testing.assert_allclose(given.end(p, t_f).full().ravel(), [0.5, -0.95], rtol=1e-15)
    assert given.end_names() == ["(2.95) of state 0", "end value of state 1"]


def test_hamiltonian_of_the_hypersensitive_problem_vanishes_along_its_closed_form():
    t = np.linspace(0.0, 8.0, 50)
    x, costate = rest.state(t, 1.5), rest.costate(t, 1.5)
    conditions = NecessaryConditions(rest.hypersensitive(8.0, 1.5))
    H = conditions.hamiltonian.map(50)(np.vstack((x, costate)), -costate[None]).full()
    assert np.max(np.abs(H)) < 1e-14  # terms of size one cancel


def test_closed_form_satisfies_the_canonical_equations():
    t, step = np.linspace(0.1, 5.0, 20), 1e-5
    conditions = NecessaryConditions(rest.hypersensitive(5.0, 1.5))
    rates = conditions.flow.map(20)(np.vstack((rest.state(t, 1.5), rest.costate(t, 1.5)))).full()
    for row, function in zip(rates, (rest.state, rest.costate), strict=True):
        slope = (function(t + step, 1.5) - function(t - step, 1.5)) / (2 * step)
        np.testing.assert_allclose(row, slope, atol=1e-9)  # of the difference quotient


def test_value_is_the_integral_of_the_running_cost():
    nodes, weights = np.polynomial.legendre.leggauss(80)
    t = 20 * (nodes + 1)  # beyond 40 s the cost is below 1e-30
    costs = 0.5 * (rest.state(t, 1.5) ** 2 + rest.costate(t, 1.5) ** 2)
    assert 20 * weights @ costs == pytest.approx(float(rest.value(1.5)), rel=1e-8)  # of the quadrature


def test_costate_at_the_start_is_the_published_one():
    # the benchmark's 0.31832168 at x = 1.5, printed to eight digits
    assert float(rest.costate(0.0, 1.5)) == pytest.approx(0.31832168, abs=6e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"final_time": 0.0}, "final time 0.0 s must be positive"),
        ({"terminal": {2: 1.0}}, r"terminal state 2 is not one of 0 \.\. 1"),
        ({"initial": [1.0]}, "dynamics have 2 entries for 1 initial"),
    ],
)
def test_contradictory_problem_is_refused(changes, message):
    kept = {"dynamics": lambda x, u: [x[0], u[0]]} if "initial" in changes else {}
    with pytest.raises(ValueError, match=message):
        pendulum(**kept, **changes)


def test_hamiltonian_that_is_not_quadratic_needs_a_minimiser():
    with pytest.raises(ValueError, match="not quadratic in the controls"):
        NecessaryConditions(pendulum(running_cost=lambda x, u: u[0] ** 4))


def test_start_without_closed_form_is_refused():
    with pytest.raises(ValueError, match=r"start -1\.0 must be positive"):
        rest.hypersensitive(1.0, -1.0)
