"""The open choices as variants of a set-up, solved on a small oval from its base lap."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from thesislib.lap.readings import Variant, choices, continued, drive_on_brakes, solved_variant
from thesislib.lap.setups import Setup, Start
from thesislib.studies.store import canonical
from thesislib.vehicles import Readings

LOOSE = 2e-2  # a coarse oval, on which a choice moves the lap time by a tenth


def choice(setup: Setup, name: str):
    return next(each for each in choices(setup) if each.name == name)


def test_the_choices_of_the_issue_are_all_there_and_each_is_taken_alone() -> None:
    base = Setup(values={"mass": 700.0})
    changed = [
        "readings",
        "readings",
        "values",
        "values",
        "readings",
        "readings",
        "readings",
        "rear_constant",
        "front_slip_limit",
        "offset_rms_m",
        "offset_rms_m",
    ]
    found = []
    for each in choices(base):
        different = [name for name in vars(base) if getattr(each.setup, name) != getattr(base, name)]
        assert len(different) == 1, each.name
        found += different
    assert found == changed


def test_a_choice_of_a_reading_keeps_the_other_readings_of_the_base() -> None:
    base = Setup(readings=Readings(power_law="hub"))
    assert choice(base, "drag at the mass centre").setup.readings == Readings(
        power_law="hub", drag_moment="mass_centre"
    )


def test_another_damping_keeps_the_mass_of_the_base() -> None:
    car = choice(Setup(values={"mass": 700.0}), "k_d = 955").setup.car()
    assert car.values["mass"] == 700.0
    assert car.values["k_d"] == pytest.approx(954.93, abs=0.01)  # 6000 / 2 pi


def test_names_are_unique_and_sentences_end() -> None:
    every = choices(Setup())
    assert len({each.name for each in every}) == len(every)
    assert all(each.sentence.endswith(".") for each in every)


def test_a_set_up_goes_to_a_worker_and_into_a_key() -> None:
    for each in choices(Setup(values={"a": 1.75})):
        assert pickle.loads(pickle.dumps(each.setup)) == each.setup
        assert canonical(each.setup) != canonical(Setup(values={"a": 1.75}))


def test_another_rear_constant_lowers_the_rear_by_a_millimetre() -> None:
    printed, text = Setup().car().values, Setup(rear_constant="text").car().values
    assert text["h_r_unloaded"] - printed["h_r_unloaded"] == pytest.approx(1e-3)


def test_a_smoother_road_has_milder_corners() -> None:
    sharpest = [
        abs(Setup(offset_rms_m=rms_m).road().station_curvature).max() for rms_m in (-0.1, 0.0, 0.1, 0.3)
    ]
    assert sharpest == sorted(sharpest, reverse=True)


def test_a_solved_start_is_read_as_it_was_solved(start: Start) -> None:
    lap = start.lap()
    assert lap.solution.error <= start.tolerance
    assert lap.solution.converged
    assert lap.time == pytest.approx(lap.t[-1] + lap["slowness"][-1] * (lap.period - lap.s[-1]), rel=1e-3)


def test_a_start_is_found_again_only_when_stored_solutions_are_asked_for(start: Start, monkeypatch) -> None:
    kept = replace(start, path=start.path.replace(".npz", "-again.npz"))
    monkeypatch.setenv("THESIS_FROM_SOLUTION", "1")
    assert kept.solve("oval")
    assert kept.lap().time == start.lap().time


def test_going_on_from_a_lap_to_the_same_lap_changes_nothing(start: Start) -> None:
    again = continued(start.setup, start, start.tolerance, "again")
    assert again.solution.history[-1].iterations <= 15
    assert again.time == pytest.approx(start.lap().time, abs=1e-5)


def test_slip_that_costs_no_power_makes_a_faster_lap(start: Start) -> None:
    easier = choice(start.setup, "power at the hubs")
    variant = Variant.from_result(easier, solved_variant(easier.setup, start, LOOSE, easier.name))
    # 10 ms of 13.6 s on this oval; a hundredth of it would be noise
    assert -0.05 < variant.lap_time - start.lap().time < -0.002
    assert variant.top_speed > variant.lowest_speed > 30.0
    assert variant.solved.summary()["error_estimate"] <= LOOSE


def test_a_choice_with_one_equation_less_starts_from_the_course_alone(start: Start) -> None:
    free = choice(start.setup, "front brakes free")
    lap = continued(free.setup, start, LOOSE, free.name)
    assert "brake_difference" not in lap.car.equations
    assert lap.time < start.lap().time - 0.02


def test_brakes_of_a_fixed_ratio_leave_the_engine_no_force_to_hold_back_with(start: Start) -> None:
    share = 0.8  # of a road with two corners: this car brakes with more than 0.6 in front there
    ratio = next(
        each for each in choices(start.setup, front_brake_share=share) if each.name == "brake ratio 0.8"
    )
    base, lap = start.lap(), continued(ratio.setup, start, LOOSE, ratio.name)

    def axles(lap):
        front, rear = (-(lap[f"F_{axle}lx"] + lap[f"F_{axle}rx"]) for axle in "fr")
        return front, front * (1 - share) / share - rear

    assert np.any(axles(base)[1] < -200.0), "the ratio would not matter on this road"
    front, drive = axles(lap)
    assert np.all(drive > -1.0), "the rear brakes with more than its share"
    assert np.median(drive[front > 2000.0]) < 50.0, "brakes alone, as a rule"
    assert lap.time > base.time + 1e-4
    told = Variant.from_result(ratio, solved_variant(ratio.setup, start, LOOSE, ratio.name))
    both = (front > 500.0) & (drive > 500.0)
    assert told.drive_on_brakes == pytest.approx(lap.solution.weights @ (lap["slowness"] * both), rel=1e-9)
    assert drive_on_brakes(base) == 0.0
