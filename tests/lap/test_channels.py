"""What the pictures derive from a lap, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from thesislib.lap import channels


class Circle:
    """A circle of radius 100 m, driven clockwise from its northernmost point, heading east."""

    length = 200.0 * np.pi

    def heading(self, s):
        return np.asarray(s) / 100.0

    def position(self, s):
        return 100.0 * np.sin(np.asarray(s) / 100.0), -100.0 * np.cos(np.asarray(s) / 100.0)


class Given:
    """A lap of the channels it is given, at the constant speed of 50 m/s."""

    def __init__(self, s, length, **named):
        self.s, self.t, self.time = np.asarray(s), np.asarray(s) / 50.0, length / 50.0
        self.track = Circle()
        self.track.length = length
        self._named = {name: np.asarray(values) for name, values in named.items()}

    def __getitem__(self, name):
        return self._named[name]


def test_right_of_a_clockwise_circle_is_its_inside():
    x, y = channels.beside(Circle(), np.linspace(0.0, 600.0, 7), 4.0)
    np.testing.assert_allclose(np.hypot(x, y), 96.0, atol=1e-12)


def test_whole_lap_has_both_ends_of_the_start_line_at_one_value():
    lap = Given([100.0, 300.0, 700.0], 1000.0, u=[1.0, 3.0, 7.0])
    s, u = channels.whole_lap(lap, lap["u"])
    np.testing.assert_array_equal(s, [0.0, 100.0, 300.0, 700.0, 1000.0])
    # 400 m from the last point to the first across the line: three quarters of the way at 1000 m
    assert u[0] == u[-1] == pytest.approx(7.0 - 0.75 * 6.0)


def test_steer_rate_of_a_sine_is_its_cosine_around_the_start_line_too():
    s = np.arange(0.0, 5000.0, 5.0)
    wave = 2.0 * np.pi * s / 5000.0
    lap = Given(s, 5000.0, delta=0.1 * np.sin(wave))
    expected = 0.1 * np.cos(wave) * 2.0 * np.pi * 50.0 / 5000.0
    # central differences of a wave of 1000 points err by (2 pi / 1000)^2 / 6 of the amplitude
    np.testing.assert_allclose(channels.steer_rate(lap), expected, atol=1e-5 * expected.max())


def test_brake_share_is_that_of_the_front_axle_and_blank_without_braking():
    lap = Given(
        [0.0, 1.0, 2.0],
        3.0,
        F_flx=[-3000.0, 0.0, -900.0],
        F_frx=[-3000.0, 0.0, -900.0],
        F_rlx=[-2000.0, 2000.0, 400.0],
        F_rrx=[-2000.0, 2000.0, 100.0],
    )
    np.testing.assert_allclose(channels.brake_share(lap), [0.6, np.nan, 1.0])


def test_active_stretches_reach_half_way_to_the_neighbours_and_split_at_the_start():
    lap = Given([0.0, 10.0, 20.0, 60.0], 100.0)
    spans = channels.active_spans(lap, np.array([True, False, True, True]))
    assert spans == [(0.0, 5.0), (15.0, 85.0)]


def test_a_constraint_that_is_never_active_has_no_stretch():
    lap = Given([0.0, 10.0, 20.0], 30.0)
    assert channels.active_spans(lap, np.zeros(3, dtype=bool)) == []
