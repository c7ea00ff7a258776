"""Combined slip and brake share of a lap as numbers."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib.lap.channels import brake_share, time_shares
from thesislib.lap.setups import Start
from thesislib.lap.tyre_use import tyre_use
from thesislib.vehicles.tyres import peak_combined_slip


@pytest.fixture(scope="module")
def lap(start: Start):
    return start.lap()


def test_every_moment_of_the_lap_stands_for_one_point(lap, synthetic_lap) -> None:
    for each in (lap, synthetic_lap):
        assert time_shares(each).sum() == pytest.approx(each.time, abs=1e-9)
        assert (time_shares(each) > 0.0).all()


def test_the_shares_are_those_of_time_and_not_of_points(lap) -> None:
    use = tyre_use(lap)
    peak = peak_combined_slip(lap.car.values["Q_x"])
    time = lap.solution.weights * lap["slowness"]  # the quadrature's own, instead of half-way points
    rears = (lap["rho_rl"] > peak) | (lap["rho_rr"] > peak)
    assert use.beyond_peak_rear == pytest.approx(time @ rears / lap.time, abs=0.02)
    assert 0.0 < use.beyond_peak_front < 1.0
    assert use.largest_slip["fl"] == lap["rho_fl"].max()


def test_a_tenth_of_the_braking_time_lies_below_the_low_share_and_a_tenth_above_the_high_one(lap) -> None:
    use = tyre_use(lap)
    share, time = brake_share(lap), time_shares(lap)
    braking = time[np.isfinite(share)].sum()
    largest = time[np.isfinite(share)].max() / braking  # one point's time is as fine as it gets
    for value, part in (
        (use.brake_share_low, 0.1),
        (use.brake_share_median, 0.5),
        (use.brake_share_high, 0.9),
    ):
        assert time[share <= value].sum() / braking == pytest.approx(part, abs=largest)


def test_two_shape_factors_have_no_common_peak(lap) -> None:
    other = replace(lap, car=lap.car.replace(Q_x=1.7))
    with pytest.raises(ValueError, match=r"Q_x = 1.7 and Q_y = 1.9 differ"):
        tyre_use(other)
