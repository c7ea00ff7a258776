"""Downforce moved between the axles: the cases, the front they make, and one of them solved on an oval."""

import pickle

import pytest

from thesislib.lap.aero_balance import (
    OFFSETS,
    Drivability,
    balanced,
    balanced_lap,
    balances,
    fastest_for_stability,
)
from thesislib.lap.setups import Setup, Start

LOOSE = 2e-2  # a coarse oval, on which the balance moves the lap time by hundredths


def test_the_balance_moves_and_the_whole_downforce_stays() -> None:
    base = Setup(values={"mass": 700.0})
    moved = balanced(base, 0.2).car().values
    own = base.car().values
    assert moved["C_L_front_0"] == pytest.approx(own["C_L_front_0"] - 0.2)
    assert moved["C_L_rear_0"] == pytest.approx(own["C_L_rear_0"] + 0.2)
    assert {name for name in own if moved[name] != own[name]} == {"C_L_front_0", "C_L_rear_0"}


def test_moving_a_moved_balance_back_gives_the_first() -> None:
    there_and_back = balanced(balanced(Setup(), 0.15), -0.15).car().values
    assert there_and_back == pytest.approx(Setup().car().values, abs=1e-15)


def test_more_downforce_than_the_front_has_is_refused_before_anything_is_solved(start: Start) -> None:
    with pytest.raises(ValueError, match="C_L_front_0"):
        balances(Setup(), start, LOOSE, (0.1, 1.5))


def test_the_cases_go_to_workers(start: Start) -> None:
    cases = balances(start.setup, start, LOOSE)
    assert len(cases) == len(OFFSETS)
    assert pickle.loads(pickle.dumps(cases)) == cases


def test_a_car_with_its_downforce_at_the_rear_is_the_more_stable(start: Start) -> None:
    case = balances(start.setup, start, LOOSE, (0.2,))["a_off = 0.2"]
    result = balanced_lap(**case)
    found, base = Drivability.from_result(result), Drivability.of(start.lap())
    assert found.name == "a_off = 0.2"
    assert found.largest_growth < base.largest_growth
    assert found.unstable_share < base.unstable_share
    assert abs(found.lap_time - base.lap_time) < 0.5


def test_the_front_keeps_what_no_other_lap_beats() -> None:
    laps = [
        Drivability("slow and stable", 84.0, 0.1, 1.0),
        Drivability("fast", 83.0, 0.4, 9.0),
        Drivability("beaten", 84.1, 0.2, 1.0),
        Drivability("between", 83.5, 0.2, 5.0),
        Drivability("as fast and less stable", 83.0, 0.5, 9.0),
    ]
    assert [each.name for each in fastest_for_stability(laps)] == ["fast", "between", "slow and stable"]
