"""Steady cornering: equilibria that are ones, the linear car at small accelerations, and the limit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from thesislib.lap.handling import degrees_per_g, linear_understeer_gradient, steady_cornering
from thesislib.lap.setups import Setup
from thesislib.vehicles import CONTROLS, Readings

GRAVITY = 9.80665


@pytest.fixture(scope="module")
def car():
    return Setup().car()


@pytest.fixture(scope="module")
def branch(car):
    return steady_cornering(car, 45.0)


@pytest.mark.parametrize("speed", [20.0, 70.0])
def test_with_an_open_differential_the_gradient_straight_on_is_that_of_the_linear_car(car, speed) -> None:
    found = steady_cornering(car.replace(k_d=0.0), speed)
    # both are derivatives without truncation; nothing is left but rounding and the solver's 1e-10
    assert found.understeer_gradient[0] == pytest.approx(linear_understeer_gradient(found), rel=1e-7)


def test_the_differential_resists_the_turn(car) -> None:
    closed, opened = (steady_cornering(car.replace(k_d=k_d), 20.0) for k_d in (10.47, 0.0))
    assert closed.understeer_gradient[0] > opened.understeer_gradient[0]


def test_at_every_equilibrium_the_car_turns_steadily(branch) -> None:
    g, V = GRAVITY, branch.speed
    assert np.abs(branch["a_y"] - branch["omega"] * branch["u"]).max() < 1e-8 * g
    assert np.abs(branch["a_x"] + branch["omega"] * branch["v"]).max() < 1e-8 * g
    assert np.abs(branch["domega_ds"]).max() < 1e-8
    for balance in ("vertical_balance", "roll_balance", "pitch_balance", "differential_balance"):
        assert np.abs(branch[balance]).max() < 1e-5, balance  # N, N m
    assert np.abs(branch["roll_difference"]).max() < 1e-10
    assert np.hypot(branch["u"], branch["v"]) == pytest.approx(V, abs=1e-10)
    for wheel in ("fl", "fr"):
        assert np.abs(branch[f"F_{wheel}x"]).max() < 1e-6, "the front wheels roll"
        assert branch[f"F_{wheel}z"].max() < 0.0, "every wheel stays on the road"


def test_the_branch_begins_straight_on_and_its_acceleration_grows(branch) -> None:
    assert branch.lateral_acceleration[0] == pytest.approx(0.0, abs=1e-12)
    assert branch["delta"][0] == pytest.approx(0.0, abs=1e-12)
    assert (np.diff(branch.lateral_acceleration) > 0.0).all()
    assert branch.ended_by == "grip"


def test_the_gradient_along_the_branch_is_the_slope_of_the_handling_diagram(branch) -> None:
    a_y, steer = branch.lateral_acceleration, branch.steer_for_slip
    middle = 0.5 * (branch.understeer_gradient[1:] + branch.understeer_gradient[:-1])
    inside = a_y[1:] < 0.8 * branch.limit
    chords = np.diff(steer) / np.diff(a_y)
    # a chord of a tenth of a g against the mean of its ends' slopes: second order in the step
    assert np.abs(chords - middle)[inside].max() < 0.02 * np.abs(middle).max()


def test_beyond_the_limit_nothing_is_found_and_below_it_an_equilibrium_is(car, branch) -> None:
    """Another method: least squares of all the equations at a given lateral acceleration."""
    names = ("v", *CONTROLS)
    last = np.array([branch[name][-1] for name in names])
    sizes = np.array([1.0, 0.1, 0.1, 0.1, 0.1, 0.1, 2e3, 2e3, 2e3, 2e3])

    def unsteady(a_y: float) -> float:
        def equations(z):
            found = dict(zip(names, z * sizes, strict=True))
            omega = a_y / branch.speed
            u = np.sqrt(branch.speed**2 - found["v"] ** 2)
            x = {"n": 0.0, "xi": 0.0, "v": found["v"], "u": u, "omega": omega}
            q = car.quantities(x, found, 0.0)
            mass = car.values["mass"]
            return [
                (q["a_x"] + omega * found["v"]) / GRAVITY,
                (q["a_y"] - omega * u) / GRAVITY,
                q["domega_ds"] * u / GRAVITY,
                q["vertical_balance"] / mass / GRAVITY,
                q["roll_balance"] / mass / GRAVITY,
                q["pitch_balance"] / mass / GRAVITY,
                q["differential_balance"] / mass / GRAVITY,
                q["roll_difference"] / 0.05,
                found["kappa_fl"] / 0.1,
                found["kappa_fr"] / 0.1,
            ]

        return float(np.linalg.norm(least_squares(equations, last / sizes, xtol=1e-15, ftol=1e-15).fun))

    assert unsteady(0.999 * branch.limit) < 1e-8
    assert unsteady(1.001 * branch.limit) > 1e-5


def test_more_power_moves_the_limit_of_power_and_not_that_of_grip(car) -> None:
    weak = steady_cornering(car.replace(P_max=460e3), 75.0)
    strong = steady_cornering(car, 75.0)
    assert weak.power_limit < strong.power_limit <= strong.limit
    assert weak.limit == pytest.approx(strong.limit)
    at = np.interp(weak.power_limit, weak.lateral_acceleration, weak["power"])
    assert at == pytest.approx(460e3, rel=1e-3)  # linear between equilibria a tenth of a g apart


def test_where_the_engine_cannot_keep_the_speed_the_limit_of_power_is_zero(car) -> None:
    assert steady_cornering(car, 95.0).power_limit == 0.0


def test_slow_the_front_gives_way_and_fast_the_rear(car) -> None:
    slow, fast = steady_cornering(car, 80.0 / 3.6), steady_cornering(car, 200.0 / 3.6)
    assert slow.steer_for_slip[-1] > 0.0 > fast.steer_for_slip[-1]
    assert slow.growth.max() < 0.0 < fast.growth[-1]
    # what the steering adds is what the axles differ in, but for the wheels' different paths
    assert fast.slip_difference[-1] == pytest.approx(fast.steer_for_slip[-1], rel=0.02)


def test_numbers_that_a_set_up_changes_are_those_of_a_car_that_has_them(car, branch) -> None:
    moved = {"C_L_front_0": 1.0, "h_r_unloaded": -0.08}
    adjusted = steady_cornering(car, 45.0, moved)
    built = steady_cornering(car.replace(C_L_front_0=1.0), 45.0, {"h_r_unloaded": -0.08})
    assert adjusted.limit == pytest.approx(built.limit, rel=1e-9)
    assert adjusted.limit != pytest.approx(branch.limit, rel=1e-3)


def test_an_understeer_gradient_is_said_in_degrees_per_g() -> None:
    assert degrees_per_g(1.0) == pytest.approx(180.0 / np.pi * GRAVITY)


@pytest.mark.parametrize("speed", [0.0, -10.0])
def test_a_speed_that_is_none_is_refused(car, speed) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        steady_cornering(car, speed)


def test_a_rigid_car_is_refused_with_the_reason(car) -> None:
    rigid = replace(car, readings=Readings(suspension="rigid"))
    with pytest.raises(ValueError, match=r"rigid.*roll moment"):
        steady_cornering(rigid, 40.0)
