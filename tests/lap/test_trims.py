"""Mid-corner trims, on a lap whose channels are given."""

import numpy as np
import pytest

from thesislib.lap.trims import HARD, mid_corner_trims
from thesislib.roads import Corner
from thesislib.vehicles.racing_car import CONTROLS

LENGTH = 1000.0
GYRATION = 0.8


class GivenLap:
    """One corner from 100 to 300 m, and one across the start line."""

    def __init__(self):
        self.s = np.arange(0.0, LENGTH, 1.0)
        self.track = self
        self.length = LENGTH
        s = self.s
        self.channels = dict.fromkeys(CONTROLS, np.zeros_like(s)) | {
            "u": 30.0 + 0.01 * s,
            "v": -0.5 + 0 * s,
            "omega": 0.3 + 0 * s,
            "slowness": np.full_like(s, 1 / 30.0),
            # hardest at 200 m, nine tenths of it out to 220 m
            "a_y": np.maximum(20.0 - 2.0 * ((s - 200.0) / 20.0) ** 2, 1.0),
            # steadiest at 215 m in v, at 205 m in omega; the car is steadier still where it hardly corners
            "dv_ds": 0.01 * (s - 215.0) / 30.0,
            "domega_ds": 0.01 * (s - 205.0) / 30.0,
        }

    def __getitem__(self, name):
        return self.channels[name]


def trims(*corners):
    return mid_corner_trims(GivenLap(), corners, radius_of_gyration=GYRATION)


@pytest.fixture(scope="module")
def found():
    return trims(Corner(1, 200.0, "R", 100.0, 300.0, 1.0))


def test_the_trim_is_where_energy_changes_least(found):
    # (s - 215)² + k² (s - 205)² is least at (215 + k² 205)/(1 + k²) = 211.1, to the metre
    assert found["s"][0][0] == pytest.approx((215 + GYRATION**2 * 205) / (1 + GYRATION**2), abs=0.5)


def test_the_car_corners_hard_there():
    lap = GivenLap()
    lap.channels["dv_ds"] = 0.01 * (lap.s - 290.0) / 30.0
    lap.channels["domega_ds"] = lap.channels["dv_ds"]
    corner = Corner(1, 200.0, "R", 100.0, 300.0, 1.0)
    s = mid_corner_trims(lap, [corner], radius_of_gyration=GYRATION)["s"][0][0]
    assert 20.0 - 2.0 * ((s - 200.0) / 20.0) ** 2 >= HARD * 20.0 - 1e-9
    assert s == pytest.approx(220.0, abs=0.01)


def test_motion_and_control_are_those_of_the_place(found):
    assert found["u"][0][0] == pytest.approx(30.0 + 0.01 * found["s"][0][0], abs=1e-12)
    assert set(found) == {"corner", "s", "u", "v", "omega", *CONTROLS}
    assert (found["u"][1], found["F_flz"][1], found["kappa_rl"][1]) == ("m/s", "N", "")


def test_a_corner_across_the_start_line_has_its_trim_on_the_lap():
    s = trims(Corner(2, 990.0, "L", 950.0, 1040.0, 1.0))["s"][0][0]
    assert 0.0 <= s < LENGTH
