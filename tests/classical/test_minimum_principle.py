"""Claims about the time-optimal stop."""

import numpy as np
import pytest

from thesislib import ocp
from thesislib.classical.control_problem import NecessaryConditions
from thesislib.classical.minimum_principle import FastestStop

STARTS = [(1.0, 0.5, 1.0), (-2.0, 0.3, 2.0), (0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (-0.5, 1.0, 1.0)]


@pytest.mark.parametrize("start", STARTS)
def test_law_of_the_minimum_principle_brings_the_mass_to_rest_when_the_hand_says(start):
    stop = FastestStop.by_hand(*start)
    p, _ = stop.integrated(np.linspace(0.0, stop.final_time, 101))
    assert np.max(np.abs(p[:2, -1])) < 1e-11  # of the integrator's tolerance, 1e-12


@pytest.mark.parametrize("start", STARTS)
def test_hamiltonian_stays_at_minus_one(start):
    stop = FastestStop.by_hand(*start)
    p, u = stop.integrated(np.linspace(0.0, stop.final_time, 101))
    H = NecessaryConditions(stop.problem()).hamiltonian.map(101)(p, u[None]).full()
    np.testing.assert_allclose(H, -1.0, rtol=1e-11)  # of the integrator's tolerance


def test_start_on_the_switching_curve_needs_no_switch():
    stop = FastestStop.by_hand(-0.5, 1.0, 1.0)
    assert stop.switch_time == 0.0
    assert stop.final_time == 1.0
    _, u = stop.integrated(np.linspace(0.0, 1.0, 11))
    np.testing.assert_array_equal(u, -1.0)


def test_published_time_from_rest_is_reached():
    # the textbook case: from rest at distance 1 with unit force, 2 s
    assert FastestStop.by_hand(1.0, 0.0, 1.0).final_time == pytest.approx(2.0, rel=1e-15)


@pytest.mark.parametrize("start", [(1.0, 0.5, 1.0), (-2.0, 0.3, 2.0)])
def test_collocation_finds_no_faster_stop(start):
    stop = FastestStop.by_hand(*start)
    problem = ocp.Problem(
        "stop",
        ocp.Independent("t", 0.0, (0.1, 10.0)),
        [ocp.State("x", "m", (-4, 4)), ocp.State("v", "m/s", (-5, 5))],
        lambda at: ocp.Equations({"x": at.v, "v": at.u}),
        controls=[ocp.Control("u", "m/s²", (-stop.limit, stop.limit))],
        mayer=lambda ends: ends.final.t,
        initial={"x": stop.position, "v": stop.speed},
        terminal={"x": 0.0, "v": 0.0},
    )
    found = ocp.solve(problem, {"t_final": 3.0}, tolerance=1e-4).objective
    # the switch lies inside a mesh interval, where a polynomial control costs some 1e-4 of the time
    assert 0 <= found - stop.final_time < 2e-3


def test_impossible_stops_are_refused():
    with pytest.raises(ValueError, match="largest acceleration 0 m/s² must be positive"):
        FastestStop.by_hand(1.0, 0.0, 0)
    with pytest.raises(ValueError, match="are the end already"):
        FastestStop.by_hand(0.0, 0.0, 1.0)
