"""A lap's loads on moving axles: momentum, first-order lap times against laps solved again, refusals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from thesislib import ocp
from thesislib.lap import figures_replay
from thesislib.lap.replay import AXLES, Replay, difference, replayed, time_mean, time_rms, with_heights
from thesislib.lap.setups import Start
from thesislib.ocp.sensitivity import constant_density
from thesislib.suspension import Axle
from thesislib.vehicles import Readings

# Laps whose difference is a tenth of a millisecond: what the barrier leaves in each must be far less.
TIGHT = ocp.Settings(optimality=1e-9)


@pytest.fixture(scope="module")
def lap(start: Start):
    """The oval's lap on its own mesh, solved tightly."""
    base = start.lap()
    problem = start.setup.problem("tight")
    solution = ocp.solve(problem, base.solution, None, TIGHT, tolerance=start.tolerance)
    return replace(base, solution=solution)


@pytest.fixture(scope="module")
def replay(lap) -> Replay:
    return replayed(lap)


def test_a_periodic_lap_has_periodic_heights(replay: Replay) -> None:
    # the slowest mode has fallen by e^-12 from a few millimetres
    assert replay.gap < 1e-7


def test_over_a_lap_moving_tyres_carry_what_the_loads_do(replay: Replay) -> None:
    for axle in AXLES:
        wheels = [f"{axle[0]}{side}" for side in "lr"]
        carried = time_mean(replay.lap, sum(replay.tyre_forces[wheel] for wheel in wheels))
        loaded = time_mean(replay.lap, sum(replay.lap[f"F_{wheel}z"] for wheel in wheels))
        # momentum comes back to what it was; the sum over points of a ringing force is not better
        assert carried == pytest.approx(loaded, rel=2e-3), axle


def test_the_two_errors_add_up(replay: Replay) -> None:
    parts, both = (replay.quasi_static, replay.table_error), replay.both
    for axle in AXLES:
        np.testing.assert_allclose(sum(one.height[axle] for one in parts), both.height[axle], atol=1e-15)
        np.testing.assert_allclose(sum(one.downforce[axle] for one in parts), both.downforce[axle], atol=1e-9)
    assert sum(one.time for one in parts) == pytest.approx(both.time, rel=1e-9)


def test_price_of_ride_height_is_that_of_the_coefficients_and_of_the_plank(lap) -> None:
    values, worth = lap.car.values, {}
    for name in ("C_L_front", "C_L_rear", "C_D"):
        worth[name] = constant_density(lap.solution, f"{name}_0")
    aero = sum(worth[name] * values[f"{name}_h_f"] for name in worth)
    rear = sum(
        worth[name] * (values[f"{name}_h_r"] + 2 * values[f"{name}_h_r2"] * lap["h_r"]) for name in worth
    )
    plank = lap.solution.path_multiplier("ride_height")
    # the same multipliers by two ways through the equations
    for name, parts in (("h_f_unloaded", aero + plank), ("h_r_unloaded", rear)):
        whole = constant_density(lap.solution, name)
        np.testing.assert_allclose(whole, parts, atol=1e-9 * np.abs(whole).max())


def test_first_order_lap_time_is_that_of_laps_solved_with_moved_heights(lap, replay: Replay) -> None:
    change = replay.quasi_static
    times = []
    for share in (0.02, -0.02):
        problem = with_heights(lap.solution.problem, lap, change.change, share=share)
        again = ocp.solve(problem, lap.solution, None, TIGHT, tolerance=0.1)
        times.append(again.objective + again.regularisation)
    measured = (times[0] - times[1]) / 0.04
    assert sum(change.time_by_height.values()) == pytest.approx(measured, rel=0.01)


def test_a_posture_less_itself_is_worth_nothing(replay: Replay) -> None:
    nothing = difference(replay.lap, replay.table, replay.table)
    assert nothing.time == 0.0
    assert time_rms(replay.lap, nothing.downforce["front"]) == 0.0


def test_the_table_on_moving_loads_is_nearer_to_the_motion_than_on_those_of_the_lap(replay: Replay) -> None:
    lap, following = replay.lap, replay.following()
    by_loads = time_rms(lap, replay.moving.h_f - following.h_f)
    assert by_loads < 0.5 * time_rms(lap, replay.moving.h_f - replay.table.h_f)


def test_a_rigid_suspension_and_a_missing_axle_are_refused(lap) -> None:
    rigid = replace(lap, car=replace(lap.car, readings=Readings(suspension="rigid")))
    with pytest.raises(ValueError, match="the car's suspension is rigid"):
        replayed(rigid)
    with pytest.raises(ValueError, match="axles has no rear"):
        replayed(lap, {"front": Axle.from_file("front_axle")})


def test_a_lap_whose_set_up_was_adjusted_is_refused(lap) -> None:
    lower = SimpleNamespace(name="row D", car=lap.car, adjustments={"dh_f": 0.0, "dh_r": 0.007})
    with pytest.raises(ValueError, match=r"row D: its set-up is adjusted \(dh_r\), but the axles are not"):
        replayed(lower)


def test_pictures_show_every_axle_and_refuse_a_part_off_the_lap(replay: Replay) -> None:
    panels = figures_replay.ride_height_errors(replay).axes
    drawn = panels[0].lines[0].get_ydata()
    assert np.nanmax(np.abs(drawn)) == pytest.approx(1e3 * np.abs(replay.quasi_static.height["front"]).max())
    assert [len(axes.lines) for axes in panels] == [2, 2, 2]
    detail = figures_replay.moving_ride_heights(replay, 100.0, 300.0, bound_mm=15.0)
    assert detail.axes[-1].get_xlim()[0] >= 100.0
    with pytest.raises(ValueError, match="must lie within"):
        figures_replay.moving_ride_heights(replay, 300.0, 9000.0)
