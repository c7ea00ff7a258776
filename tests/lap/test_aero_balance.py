"""Downforce moved between the axles: the cases, the front they make, and one of them solved on an oval."""

import pickle
from dataclasses import replace

import pytest

from thesislib.lap.aero_balance import (
    OFFSETS,
    Drivability,
    balanced,
    balanced_laps,
    fastest_for_stability,
    sweep,
    swept,
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
        sweep(Setup(), {0.0: start}, LOOSE, (0.1, 1.5))


def test_each_offset_is_reached_from_the_nearest_lap_below(start: Start) -> None:
    other = replace(start, path="other.npz")
    cases = sweep(start.setup, {0.2: other, 0.0: start}, LOOSE, (0.3, 0.1, 0.2, 0.25))
    chains = {case["start"].path: case["offsets"] for case in cases.values()}
    assert chains == {start.path: (0.1, 0.2), "other.npz": (0.25, 0.3)}
    assert list(cases) == ["a_off = 0.1 .. 0.2", "a_off = 0.25 .. 0.3"]
    assert sum(len(case["offsets"]) for case in sweep(start.setup, {0.0: start}, LOOSE).values()) == len(
        OFFSETS
    )
    assert pickle.loads(pickle.dumps(cases)) == cases  # they go to workers


def test_an_offset_below_every_start_is_refused(start: Start) -> None:
    with pytest.raises(ValueError, match=r"a_off = 0.1 lies at or below every lap to start from: 0.2, 0.3"):
        sweep(start.setup, {0.3: start, 0.2: start}, LOOSE, (0.1, 0.25))


def test_a_car_with_its_downforce_at_the_rear_is_the_more_stable(start: Start) -> None:
    cases = sweep(start.setup, {0.0: start}, LOOSE, (0.2, 0.1))
    found = swept({name: balanced_laps(**case) for name, case in cases.items()})
    laps = (Drivability.of(start.lap()), *found)
    assert [each.name for each in laps] == ["base lap", "a_off = 0.1", "a_off = 0.2"]
    assert laps[0].largest_growth > laps[1].largest_growth > laps[2].largest_growth
    assert laps[0].unstable_share > laps[2].unstable_share
    assert all(abs(each.lap_time - laps[0].lap_time) < 0.5 for each in found)


def test_the_front_keeps_what_no_other_lap_beats() -> None:
    laps = [
        Drivability("slow and stable", 84.0, 0.1, 1.0),
        Drivability("fast", 83.0, 0.4, 9.0),
        Drivability("beaten", 84.1, 0.2, 1.0),
        Drivability("between", 83.5, 0.2, 5.0),
        Drivability("as fast and less stable", 83.0, 0.5, 9.0),
    ]
    assert [each.name for each in fastest_for_stability(laps)] == ["fast", "between", "slow and stable"]
