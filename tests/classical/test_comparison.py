"""Claims about the comparison of methods, and Radau collocation's place in it."""

import numpy as np
import pytest

from thesislib.classical import bryson_denham as turn
from thesislib.classical import hypersensitive as rest
from thesislib.classical.comparison import Exact, by_method, errors, measured, order
from thesislib.classical.control_problem import Trajectory
from thesislib.classical.radau import radau_collocation, radau_problem

EXACT = Exact(lambda t: rest.state(t, 1.0), lambda t: rest.costate(t, 1.0), float(rest.value(1.0)))


def exact_trajectory(shift=0.0):
    t = np.linspace(0.0, 1.0, 5)
    x, costate = rest.state(t, 1.0)[None], rest.costate(t, 1.0)[None]
    return Trajectory(t, x + shift, t, -costate, t, costate - 2 * shift, EXACT.objective + 3 * shift, 5, 1)


def test_errors_are_the_differences_from_the_closed_form():
    assert errors(exact_trajectory(), EXACT) == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(errors(exact_trajectory(0.01), EXACT), (0.01, 0.02, 0.03), rtol=1e-12)


def test_a_measurement_runs_as_often_as_it_says():
    runs = []
    found = measured("method", lambda: runs.append(1) or exact_trajectory(), EXACT, repetitions=4)
    assert len(runs) == 4
    assert found.cpu_s >= 0
    assert (found.unknowns, found.iterations, found.state_error) == (5, 1, 0.0)
    with pytest.raises(ValueError, match="repetitions = 0"):
        measured("method", exact_trajectory, EXACT, repetitions=0)


def test_order_is_the_exponent():
    steps = np.array([10, 20, 40])
    assert order(steps, 3.0 / steps**2) == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize(("steps", "error"), [([1], [1.0]), ([1, 2], [1.0, 0.0]), ([1, 2], [1.0])])
def test_order_of_too_few_or_vanishing_errors_is_refused(steps, error):
    with pytest.raises(ValueError, match="an order needs"):
        order(steps, error)


def test_measurements_are_grouped_by_method_and_sorted_by_size():
    def of(method, unknowns):
        t = exact_trajectory()
        return measured(
            method, lambda: Trajectory(**{**t.__dict__, "unknowns": unknowns}), EXACT, repetitions=1
        )

    groups = by_method([of("b", 3), of("a", 1), of("b", 2)])
    assert {name: [each.unknowns for each in group] for name, group in groups.items()} == {
        "b": [2, 3],
        "a": [1],
    }


def test_radau_collocation_converges_faster_than_any_power():
    problem = rest.hypersensitive(10.0, 1.0)
    state = [errors(radau_collocation(problem, 4, n, [(-2, 2)], [(-5, 5)]), EXACT)[0] for n in (6, 12, 18)]
    # each six points more gain two digits or more
    assert state[1] < 1e-2 * state[0]
    assert state[2] < 1e-2 * state[1]


def test_radau_collocation_meets_given_ends_and_the_effort_without_ceiling():
    found = radau_collocation(turn.bryson_denham(), 2, 4, [(-2, 2), (-5, 5)], [(-50, 50)])
    np.testing.assert_allclose(found.x[:, -1], [0.0, -1.0], atol=1e-10)
    assert found.objective == pytest.approx(2.0, rel=1e-8)  # of IPOPT's tolerance


def test_bounds_for_other_states_are_refused():
    with pytest.raises(ValueError, match="1 and 1 pairs of bounds for 2 states and 1 controls"):
        radau_problem(turn.bryson_denham(), [(-1, 1)], [(-1, 1)])
