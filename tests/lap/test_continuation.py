"""Rows solved one from another on a small road."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from thesislib import studies
from thesislib.lap.continuation import continued_row, solve_rows
from thesislib.lap.rows import rows

LOOSE = 5e-2  # of a lap that is a test; what is compared is solved on one mesh


@pytest.fixture(scope="module")
def solved(start, tmp_path_factory):
    folder = tmp_path_factory.mktemp("rows")
    every = rows(start.setup)
    chosen = {name: every[name] for name in ("C", "H", "M", "B", "Q")}
    chosen["M"] = replace(chosen["M"], steps=({"a_off": 0.05},))
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("THESIS_STORE", str(folder / "store"))
        yield chosen, folder, solve_rows(chosen, start, folder / "laps", tolerance=LOOSE)


def test_what_may_be_chosen_makes_no_lap_slower(solved):
    _, _, found = solved
    for letter in "HMQ":
        assert found[letter].lap_time < found["C"].lap_time
    # a balance that may differ from place to place is worth more than a fixed one
    assert found["Q"].lap_time < found["M"].lap_time
    # without (4.19) the optimiser chooses the split of the roll couple point by point
    assert found["B"].lap_time < found["C"].lap_time


def test_rows_are_solved_to_their_tolerance_and_say_how(solved):
    _, _, found = solved
    for row in found.values():
        assert row.error <= LOOSE
        assert row.solved.summary()["converged"]
        assert row.solved.summary()["iterations"] > 0


def test_adjustments_stay_within_their_bounds(solved):
    _, _, found = solved
    steer = found["H"].adjustments
    assert set(steer) == {"dC_L_front_delta2", "dC_L_rear_delta2"}
    assert all(abs(value) <= 0.15 + 1e-6 for value in steer.values())
    assert set(found["M"].adjustments) == {"a_off"}


def test_an_adjusted_lap_is_the_lap_of_the_changed_car(solved, start):
    """The optimum of row (M), solved again with its balance written into the car's own numbers."""
    _, _, found = solved
    lap, a_off = found["M"].lap(), found["M"].adjustments["a_off"]
    car = start.setup.car().values
    moved = {"C_L_front_0": car["C_L_front_0"] - a_off, "C_L_rear_0": car["C_L_rear_0"] + a_off}
    changed = replace(start.setup, values=moved)
    again = continued_row(changed, found["M"].start, LOOSE, "written in")
    assert again.time == pytest.approx(lap.time, abs=2e-5)  # one mesh, two ends of one iteration
    for name in ("C_L_front", "F_az_rear", "h_f"):
        at_points = np.interp(again.s, lap.s, lap[name])
        assert np.allclose(again[name], at_points, rtol=2e-2, atol=2e-4)
    assert lap.values["C_L_rear_0"] == pytest.approx(car["C_L_rear_0"] + a_off)


def test_the_continuous_balance_is_a_channel(solved):
    _, _, found = solved
    lap = found["Q"].lap()
    assert np.ptp(lap["u_CoP"]) > 0.1
    assert np.allclose(lap.values["C_L_rear_0"] + lap.values["C_L_front_0"], 2.1494)


def test_finished_rows_are_found_again(solved, start):
    chosen, folder, found = solved
    again = solve_rows(chosen, start, folder / "laps", tolerance=LOOSE)
    assert all(row.stored for row in again.values())
    assert {name: row.lap_time for name, row in again.items()} == {
        name: row.lap_time for name, row in found.items()
    }
    for row in again.values():
        Path(row.start.path).unlink()
    lap = solve_rows(chosen, start, folder / "laps", tolerance=LOOSE)["M"].lap()
    assert lap.time == found["M"].lap_time


def test_a_row_that_fails_is_named_and_what_is_finished_is_kept(solved, start, tmp_path, monkeypatch):
    chosen, _, _ = solved
    monkeypatch.setenv("THESIS_STORE", str(tmp_path / "store"))
    springs = replace(chosen["H"], name="E", setup=replace(start.setup, free={"dK_h_front": (-5e5, 5e5)}))
    after = replace(chosen["H"], name="F", parent="E")
    rows_with_it = {"C": chosen["C"], "E": springs, "F": after, "H": chosen["H"]}
    with pytest.raises(studies.StudyError, match=r"1 of 3 cases failed. case 'row E': .*Table 3\.2"):
        solve_rows(rows_with_it, start, tmp_path, tolerance=LOOSE)
    # rows (C) and (H) were finished before the failure was told; what starts from (E) was not begun
    kept = solve_rows({"C": chosen["C"], "H": chosen["H"]}, start, tmp_path, tolerance=LOOSE)
    assert all(row.stored for row in kept.values())


def test_rows_without_a_start_are_refused_before_the_first_solve(solved, start, tmp_path):
    chosen, _, _ = solved
    with pytest.raises(KeyError, match="rows without a start: H from C"):
        solve_rows({"H": chosen["H"]}, start, tmp_path, tolerance=LOOSE)
