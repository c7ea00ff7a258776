"""The optimum under a bound, by hand, against an integrator and the equations it must satisfy."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from thesislib.classical.hypersensitive import Bounded, costate, state, value


@pytest.fixture(scope="module")
def bounded() -> Bounded:
    return Bounded(1.0, 0.3)


def test_state_under_a_bound_is_that_of_an_integrator(bounded):
    # the integrator is stopped at the kink, which its order does not survive
    for begin, end, start in ((0.0, bounded.kink, 1.0), (bounded.kink, 6.0, bounded.leaving)):
        found = solve_ivp(
            lambda t, x: -(x**3) + bounded.control(np.array([t])),
            (begin, end),
            [start],
            "DOP853",
            rtol=1e-12,
            atol=1e-13,
        )
        # a hundred times the integrator's own tolerance
        np.testing.assert_allclose(bounded.state(found.t), found.y[0], atol=1e-10)


def test_control_is_bound_before_the_kink_and_that_of_the_free_problem_after_it(bounded):
    before, after = np.linspace(0.0, bounded.kink - 1e-6, 9), np.linspace(0.0, 4.0, 9)
    np.testing.assert_array_equal(bounded.control(before), -0.3)
    free = -costate(after, bounded.leaving)
    np.testing.assert_allclose(bounded.control(bounded.kink + after), free, rtol=1e-12)
    np.testing.assert_allclose(bounded.state(bounded.kink + after), state(after, bounded.leaving), rtol=1e-12)


def test_cost_is_the_integral_along_the_way_and_more_than_without_a_bound(bounded):
    def running(t):
        return 0.5 * float(bounded.state(t) ** 2 + bounded.control(t) ** 2)

    along = quad(running, 0.0, 8.0, points=[bounded.kink], epsabs=1e-12)[0] + float(value(bounded.state(8.0)))
    assert bounded.cost() == pytest.approx(along, rel=1e-10)
    assert bounded.cost() > float(value(1.0))


def test_hamiltonian_is_zero_on_the_bound_where_the_cost_falls_with_the_state(bounded):
    # dV/dx by central differences of the cost; H = (x² + u²)/2 + V' (u - x³) = 0 on an infinite horizon
    step = 1e-4
    slope = (Bounded(1.0 + step, 0.3).cost() - Bounded(1.0 - step, 0.3).cost()) / (2 * step)
    assert 0.5 * (1 + 0.09) + slope * (-0.3 - 1) == pytest.approx(0.0, abs=1e-7)
    assert slope > 0.3  # the bound holds: without it the control would be -V'


@pytest.mark.parametrize(
    ("start", "limit", "reason"),
    [
        (1.0, 0.0, r"limit 0.0 of the control is outside 0 .. 0.4"),
        (1.0, 0.45, r"limit 0.45 of the control is outside 0 .. 0.4"),
        (0.3, 0.3, r"at the start 0.3 the limit 0.3 does not bind"),
        (2.0, 0.3, r"at the start 2.0 the limit 0.3 does not bind"),
    ],
)
def test_bound_that_does_not_hold_at_the_start_is_refused(start, limit, reason):
    with pytest.raises(ValueError, match=reason):
        Bounded(start, limit)
