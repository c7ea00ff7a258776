"""Figures 4.13 to 4.18 show each lap under its own name, and the gain on an axis of its own."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex

from thesislib.lap import channels, comparison, figures_setups, style


@pytest.fixture(scope="module")
def other(synthetic_lap):
    """The same car on a mesh too coarse for its corners, so that its channels and its time differ."""
    return type(synthetic_lap)(synthetic_lap.track, intervals=60)


def lines(axes):
    return {str(line.get_label()): line for line in axes.get_lines()}


def values_at(lap, line):
    """Values of a line at the lap's own collocation points."""
    inside = np.isin(line.get_xdata(), lap.s[lap.s > 0.0])
    return np.asarray(line.get_ydata())[inside]


def legend(figure):
    named = [text.get_text() for axes in figure.axes if axes.get_legend() for text in axes.get_legend().texts]
    assert len(set(named)) == len(named)
    return named


def test_ride_heights_are_solid_for_the_lap_and_dashed_for_the_reference(synthetic_lap, other):
    figure = figures_setups.ride_heights_of_two(synthetic_lap, other, names=("stiff", "soft"))
    curves = lines(figure.axes[0])
    for axle, channel, colour in (("front", "h_f", style.FRONT), ("rear", "h_r", style.REAR)):
        for name, lap, stroke in (("stiff", synthetic_lap, "-"), ("soft", other, "--")):
            line = curves[f"{axle}, {name}"]
            np.testing.assert_allclose(values_at(lap, line), 1e3 * lap[channel][lap.s > 0.0])
            assert (line.get_color(), line.get_linestyle()) == (colour, stroke)
    assert list(curves["bound, 15 mm"].get_ydata()) == [15.0, 15.0]
    assert len(legend(figure)) == 5


def test_ride_heights_can_do_without_a_bound(synthetic_lap, other):
    assert len(legend(figures_setups.ride_heights_of_two(synthetic_lap, other, bound_mm=None))) == 4


@pytest.mark.parametrize(
    ("draw", "channel", "names"),
    [
        (figures_setups.front_downforce_of_two, "C_L_front", ("row F", "row E")),
        (figures_setups.rear_downforce_of_two, "C_L_rear", ("row I", "row C")),
    ],
)
def test_each_downforce_coefficient_is_that_of_the_lap_it_is_named_after(
    draw, channel, names, synthetic_lap, other
):
    curves = lines(draw(synthetic_lap, other).axes[0])
    for name, lap in zip(names, (synthetic_lap, other), strict=True):
        np.testing.assert_allclose(values_at(lap, curves[name]), lap[channel][lap.s > 0.0])
    assert curves[names[0]].get_color() != curves[names[1]].get_color()


@pytest.mark.parametrize("draw", [figures_setups.front_downforce_of_two, figures_setups.speed_gain])
def test_time_gained_has_a_green_axis_and_ends_at_the_difference_of_the_lap_times(draw, synthetic_lap, other):
    figure = draw(synthetic_lap, other)
    right = figure.axes[1]
    (line,) = right.get_lines()
    gained = other.time - synthetic_lap.time
    assert line.get_ydata()[-1] == pytest.approx(gained, abs=1e-12)
    assert line.get_label() == f"gained, {gained:.2f} s"
    assert legend(figure)[-1] == line.get_label()
    colours = [line.get_color(), right.yaxis.label.get_color(), right.spines["right"].get_edgecolor()]
    assert {to_hex(colour) for colour in colours} == {style.GREEN.lower()}
    assert right.spines["right"].get_visible()


def test_roll_angle_of_the_first_lap_stands_below_in_degrees_and_in_the_legend(synthetic_lap, other):
    figure = figures_setups.rear_downforce_of_two(synthetic_lap, other)
    roll = lines(figure.axes[1])["roll angle, row I"]
    expected = np.degrees(synthetic_lap["phi_r"][synthetic_lap.s > 0.0])
    np.testing.assert_allclose(values_at(synthetic_lap, roll), expected)
    assert legend(figure) == ["row I", "row C", "roll angle, row I"]


def test_aero_balance_stands_above_the_speed(synthetic_lap):
    figure = figures_setups.aero_balance(synthetic_lap)
    upper, lower = (lines(axes) for axes in figure.axes)
    inside = synthetic_lap.s > 0.0
    balance = next(line for name, line in upper.items() if name.startswith("balance"))
    np.testing.assert_allclose(values_at(synthetic_lap, balance), synthetic_lap["u_CoP"][inside])
    kmh = 3.6 * channels.speed(synthetic_lap)[inside]
    np.testing.assert_allclose(values_at(synthetic_lap, lower["speed"]), kmh)
    assert len(legend(figure)) == 2


def test_forces_are_in_kilonewtons_and_drag_points_up(synthetic_lap, other):
    curves = lines(figures_setups.aerodynamic_forces_of_two(synthetic_lap, other).axes[0])
    for name, lap in (("row P", synthetic_lap), ("row C", other)):
        inside = lap.s > 0.0
        for force, kilo in (("F_az_front", 1e-3), ("F_az_rear", 1e-3), ("F_ax", -1e-3)):
            label = {"F_az_front": "front", "F_az_rear": "rear", "F_ax": "drag"}[force]
            np.testing.assert_allclose(values_at(lap, curves[f"{label}, {name}"]), kilo * lap[force][inside])


def test_speed_difference_is_positive_where_the_first_lap_is_faster(synthetic_lap, other):
    curves = lines(figures_setups.speed_gain(synthetic_lap, other).axes[0])
    line = curves["speed, row P less row C"]
    s = np.asarray(line.get_xdata())
    expected = [3.6 * channels.along_lap(lap, channels.speed(lap), s) for lap in (synthetic_lap, other)]
    np.testing.assert_allclose(line.get_ydata(), expected[0] - expected[1], atol=1e-12)
    np.testing.assert_array_equal(s, comparison.common_points(synthetic_lap, other))
