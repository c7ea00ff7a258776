"""The racing car frozen in mid-corner, against the model of chapter 4."""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb

from thesislib.stability.racing_trim import read_trims

TRIMS = read_trims()
HARDEST = [trim for trim in TRIMS if trim.corner in (5, 8, 10)]


def test_every_corner_of_every_lap_has_a_trim():
    for lap in {trim.lap for trim in TRIMS}:
        assert [trim.corner for trim in TRIMS if trim.lap == lap] == list(range(1, 17))


@pytest.mark.parametrize("trim", TRIMS, ids=str)
def test_at_the_trim_forces_are_those_of_chapter_4(trim):
    whole = trim.whole_car_rates(trim.trim(), held=False)
    # the same tyres at the same slips: only the order of sums differs
    assert np.allclose(trim.inertia, whole * np.array([trim.mass, trim.I_z]), rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("trim", TRIMS, ids=str)
def test_a_trim_is_held_in_equilibrium(trim):
    assert np.abs(trim.rates(trim.trim())).max() < 1e-12


@pytest.mark.parametrize("trim", TRIMS, ids=str)
def test_held_wheel_speeds_hardly_change_how_fast_disturbances_grow(trim):
    step = 1e-6
    moves = step * np.eye(2)
    columns = [
        (trim.whole_car_rates(trim.trim() + move) - trim.whole_car_rates(trim.trim() - move)) / (2 * step)
        for move in moves
    ]
    whole = np.linalg.eigvals(np.column_stack(columns)).real.max()
    # a yaw rate changes a wheel's speed by half a track times it, under one per cent of the car's
    assert trim.growth == pytest.approx(whole, abs=0.1)


@pytest.mark.parametrize("trim", HARDEST, ids=str)
def test_the_jacobian_is_the_derivative_of_the_rates(trim):
    step = 1e-6
    columns = [
        (trim.rates(trim.trim() + move) - trim.rates(trim.trim() - move)) / (2 * step)
        for move in step * np.eye(2)
    ]
    # central differences: rounding of 1e-16 times rates of 1e3, over a step of 1e-6
    assert np.allclose(trim.jacobian(trim.trim()), np.column_stack(columns), atol=1e-6)


@pytest.mark.parametrize("trim", HARDEST, ids=str)
def test_enclosures_hold_force_moment_and_slopes_on_a_whole_ball(trim):
    generator = np.random.default_rng(11)
    for axle in trim.axles:
        # across zero slip as well, where a tyre without longitudinal slip turns within 1e-4 rad
        for middle, radius in ((axle.steer, 2e-3), (axle.steer + 0.08, 1e-3), (axle.steer - 0.3, 1e-2)):
            values, slopes = axle.enclosed(arb(middle, radius))
            xi = middle + radius * generator.uniform(-1, 1, 50)
            for ball, each in zip(
                (*values, *slopes), (*axle.force_and_moment(xi), *axle.slopes(xi)), strict=True
            ):
                slack = 1e-9 * np.abs(each).max()  # of the floating-point values
                assert float(ball.lower()) <= each.min() + slack
                assert float(ball.upper()) >= each.max() - slack


def test_a_wheel_without_load_and_a_car_that_stands_are_refused():
    trim = TRIMS[0]
    with pytest.raises(ValueError, match=r"Corner 1 of row C: F_flz = 0 N is not negative"):
        replace(trim, control={**trim.control, "F_flz": 0.0})
    with pytest.raises(ValueError, match=r"Corner 1 of row C: u = 0 m/s is not positive"):
        replace(trim, motion={**trim.motion, "u": 0.0})
