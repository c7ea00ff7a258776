"""Laps are compared place by place, whatever their meshes: checked on laps known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from thesislib.lap import channels, comparison

LENGTH = 1000.0
WAVE = 2.0 * np.pi / LENGTH


class Road:
    length = LENGTH


class Waving:
    """A lap whose slowness is 20 ms/m, times `factor`, plus one wave of 5 ms/m around the road."""

    track = Road()

    def __init__(self, s, factor=1.0, wave=0.005, power=None):
        self.s = np.asarray(s, dtype=float)
        self.factor, self.wave = factor, wave
        self.t, self.time = self.closed_form(self.s), 0.02 * factor * LENGTH
        self._power = power
        slowness = 0.02 * factor + wave * np.sin(WAVE * self.s)
        self._channels = {"slowness": slowness, "u": 1.0 / slowness, "v": 0.0 * self.s}

    def closed_form(self, s):
        return 0.02 * self.factor * s + self.wave * (1.0 - np.cos(WAVE * s)) / WAVE

    def __getitem__(self, name):
        return self._channels[name]


class Known:
    """Four points of a lap; the engine gives all it has at the first and the third."""

    def __init__(self, **named):
        self._named = {name: np.array(values) for name, values in named.items()}

    def __getitem__(self, name):
        return self._named[name]

    def activity(self, name):
        assert name == "power"
        return np.array([True, False, True, False])


def uneven(points, seed):
    """Distances without the start line, no two meshes with one in common."""
    return np.sort(np.random.default_rng(seed).uniform(1.0, LENGTH - 1.0, points))


def test_elapsed_time_between_the_points_is_within_its_bound_of_the_closed_form():
    lap = Waving(np.arange(0.0, LENGTH, 10.0))
    everywhere = np.linspace(0.0, LENGTH, 3001)
    error = np.abs(comparison.elapsed_time(lap, everywhere) - lap.closed_form(everywhere))
    # the third derivative of the slowness is at most 0.005 s/m times the cube of the wave number
    bound = 10.0**4 / 384.0 * 0.005 * WAVE**3
    assert 0.5 * bound < error.max() < bound + 1e-12


def test_elapsed_time_is_zero_at_the_start_and_the_lap_time_at_the_end():
    lap = Waving(uneven(50, 1))
    np.testing.assert_array_equal(comparison.elapsed_time(lap, [0.0, LENGTH]), [0.0, lap.time])


def test_one_lap_sampled_on_two_meshes_differs_nowhere():
    lap, again = Waving(np.arange(0.0, LENGTH, 2.0)), Waving(np.arange(0.0, LENGTH, 3.0))
    s = comparison.common_points(lap, again)
    # where one lap has a point, the other errs by its interpolation alone: h^4/384 of the slowness's third
    # derivative in time, h^2/8 of the second in the slowness itself
    cubic = 3.0**4 / 384.0 * 0.005 * WAVE**3
    np.testing.assert_allclose(comparison.time_gained(lap, again, s), 0.0, atol=cubic)
    difference = comparison.difference(lap, again, lambda each: each["slowness"], s)
    np.testing.assert_allclose(difference, 0.0, atol=9.0 / 8.0 * 0.005 * WAVE**2)


def test_a_lap_that_is_one_per_cent_slower_loses_in_proportion_to_the_distance():
    lap, slower = Waving(uneven(40, 2), wave=0.0), Waving(uneven(60, 3), factor=1.01, wave=0.0)
    s = np.linspace(0.0, LENGTH, 101)
    # 10 ms a lap of 20 s to a per cent: 0.2 s at the end, a straight line which cubics reproduce
    np.testing.assert_allclose(comparison.time_gained(lap, slower, s), 0.2 * s / LENGTH, atol=1e-12)
    np.testing.assert_allclose(comparison.time_gained(slower, lap, s), -0.2 * s / LENGTH, atol=1e-12)


def test_the_difference_of_a_quantity_has_its_sign_and_size():
    lap, slower = Waving(uneven(40, 2), wave=0.0), Waving(uneven(60, 3), factor=1.25, wave=0.0)
    faster = comparison.difference(lap, slower, channels.speed, [0.0, 333.0, LENGTH])
    np.testing.assert_allclose(faster, [10.0, 10.0, 10.0], rtol=1e-14)  # 50 m/s less 40 m/s


def test_common_points_are_those_of_both_laps_and_the_start_line():
    lap, other = Waving([100.0, 400.0]), Waving([250.0, 400.0, 900.0])
    points = comparison.common_points(lap, other)
    np.testing.assert_array_equal(points, [0.0, 100.0, 250.0, 400.0, 900.0, LENGTH])


def test_time_is_gained_where_the_car_is_faster_and_nowhere_else():
    # quicker by half a wave of 5 ms/m on the first half of the road, slower by the same on the second
    s = np.linspace(0.0, LENGTH, 401)[:-1] + 0.5 * LENGTH / 400
    reference, lap = Waving(s), Waving(np.arange(0.0, LENGTH, 1.0), wave=0.0)
    first = s < 0.5 * LENGTH
    half = 2.0 * 0.005 / WAVE
    # the reference's cubics, 2.5 m long, err by 1.3e-10 s, as above
    assert comparison.time_gained_where(lap, reference, first) == pytest.approx(half, abs=1e-9)
    assert comparison.time_gained_where(lap, reference, ~first) == pytest.approx(-half, abs=1e-9)
    assert comparison.time_gained_where(lap, reference, np.zeros(s.shape, dtype=bool)) == 0.0


def test_phases_are_told_by_the_acceleration_along_the_path_and_the_engine():
    # the last one gains along x, and loses more along y
    lap = Known(
        u=[50.0, 50.0, 50.0, 50.0],
        v=[0.0, 0.0, 0.0, 5.0],
        a_x=[-9.0, 5.0, 3.0, 1.0],
        a_y=[0.0, 0.0, 20.0, -20.0],
    )
    phases = comparison.phases(lap)
    assert {name: list(np.flatnonzero(where)) for name, where in phases.items()} == {
        "slowing": [0, 3],
        "traction": [1],
        "power": [2],
    }


def test_gains_of_the_phases_add_up_to_the_difference_of_the_lap_times(synthetic_lap):
    other = type(synthetic_lap)(synthetic_lap.track, intervals=120)
    phases = comparison.phases(other)
    assert np.all(np.sum(list(phases.values()), axis=0) == 1)
    gains = [comparison.time_gained_where(synthetic_lap, other, where) for where in phases.values()]
    # the two meshes sample the same road so differently that the lap times differ by more than rounding
    assert abs(other.time - synthetic_lap.time) > 1e-3
    assert sum(gains) == pytest.approx(other.time - synthetic_lap.time, abs=1e-9)


@pytest.mark.parametrize("distance", [-1.0, LENGTH + 1.0, np.nan])
def test_a_distance_off_the_lap_is_refused(distance):
    with pytest.raises(ValueError, match=r"the distance \S+ m lies outside the lap of 0 \.\. 1000 m"):
        comparison.elapsed_time(Waving([100.0, 200.0]), [10.0, distance])


@pytest.mark.parametrize(
    "compare",
    [
        comparison.common_points,
        lambda lap, other: comparison.time_gained(lap, other, [1.0]),
        lambda lap, other: comparison.difference(lap, other, channels.speed, [1.0]),
    ],
)
def test_laps_of_different_roads_are_refused(compare, synthetic_lap):
    with pytest.raises(ValueError, match=r"1000\.000 m and one of 4650\.000 m are of different roads"):
        compare(Waving([100.0, 200.0]), synthetic_lap)
