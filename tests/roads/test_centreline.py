"""Claims about the centre line of the real circuit and of a circle."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp
from scipy.interpolate import CubicSpline

from thesislib import provenance, roads


def table_of_barcelona():
    """The file read by other code than the library's."""
    path = provenance.project_root() / "data" / "tracks" / "barcelona.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    head = [line for line in lines if line.startswith("#")]
    period = next(float(line.split(":")[1]) for line in head if line.startswith("# period_m"))
    return np.array([[float(cell) for cell in line.split(",")] for line in lines[len(head) + 1 :]]), period


def integrated(curvature, start, period, points=None):
    """Integrate heading and position over a lap with a high-order method."""
    return solve_ivp(
        lambda s, y: [np.cos(y[2]), np.sin(y[2]), curvature(s)],
        (0.0, period),
        start,
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        t_eval=points,
        max_step=5.0,  # no step may jump over a station, where the third derivative breaks
    ).y


def test_table_alone_closes_to_a_millimetre_under_an_independent_integrator():
    table, period = table_of_barcelona()
    curvature = CubicSpline(
        np.append(table[:, 0], period), np.append(table[:, 1], table[0, 1]), bc_type="periodic"
    )
    x, y, theta = integrated(curvature, table[0, 4:7], period)[:, -1]
    assert np.hypot(x - table[0, 4], y - table[0, 5]) < 1e-3
    assert abs(theta - table[0, 6] - 2 * np.pi) < 1e-6


def test_same_stations_joined_by_straight_lines_do_not_close():
    table, period = table_of_barcelona()
    s, C = np.append(table[:, 0], period), np.append(table[:, 1], table[0, 1])
    points = np.linspace(0.0, period, 200001)
    theta = table[0, 6] + cumulative_trapezoid(np.interp(points, s, C), points, initial=0.0)
    end = [np.trapezoid(np.cos(theta), points), np.trapezoid(np.sin(theta), points)]
    assert np.hypot(*end) > 0.1


def test_closure_reported_is_that_of_the_independent_integrator(barcelona):
    x, y, theta = integrated(barcelona.curvature, barcelona.start, barcelona.length * (1 - 1e-15))[:, -1]
    closure = barcelona.closure()
    gap = np.hypot(x - barcelona.start[0], y - barcelona.start[1])
    # the step-size control of the integrator leaves some micrometres over the lap
    assert closure.distance == pytest.approx(gap, abs=1e-5)
    assert closure.heading == pytest.approx(theta - barcelona.start[2] - 2 * np.pi, abs=1e-7)
    assert closure.turns == 1


def test_positions_between_stations_are_the_integral_of_the_curvature(barcelona):
    s = np.linspace(0.0, barcelona.length - 1.0, 137)
    x, y, theta = integrated(barcelona.curvature, barcelona.start, barcelona.length - 1.0, s)
    np.testing.assert_allclose(np.array(barcelona.position(s)), [x, y], rtol=0, atol=1e-5)
    np.testing.assert_allclose(barcelona.heading(s), theta, rtol=0, atol=1e-7)


def test_casadi_and_numpy_agree_on_the_curvature_to_1e_12(barcelona):
    s = np.linspace(-barcelona.length, 2 * barcelona.length, 20011)
    symbolic = np.array(barcelona.curvature_function()(s.reshape(1, -1))).ravel()
    assert np.abs(symbolic - barcelona.curvature(s)).max() < 1e-12


def test_curvature_goes_through_the_stations_and_repeats_with_the_lap(barcelona):
    np.testing.assert_allclose(barcelona.curvature(barcelona.s), barcelona.station_curvature, atol=1e-15)
    np.testing.assert_allclose(
        barcelona.curvature(barcelona.s + 3 * barcelona.length), barcelona.station_curvature, atol=1e-12
    )


def test_curvature_is_the_periodic_cubic_spline_through_the_stations(barcelona):
    table, period = table_of_barcelona()
    spline = CubicSpline(
        np.append(table[:, 0], period), np.append(table[:, 1], table[0, 1]), bc_type="periodic"
    )
    # the first and last spacings, where another end condition would show, lie on a straight of 6e-6 1/m
    s = np.concatenate(
        [np.linspace(0.0, 30.0, 301), np.linspace(period - 30.0, period, 301)[:-1], barcelona.s]
    )
    np.testing.assert_allclose(barcelona.curvature(s), spline(s), rtol=0, atol=1e-16)


def test_curvature_rate_is_the_derivative_of_the_curvature(barcelona):
    s, step = np.linspace(3.0, 4640.0, 501), 1e-3
    difference = (barcelona.curvature(s + step) - barcelona.curvature(s - step)) / (2 * step)
    np.testing.assert_allclose(barcelona.curvature_rate(s), difference, atol=1e-9)


def test_circle_has_the_positions_of_a_circle(circle_lines, write_road):
    road = roads.load(write_road(circle_lines))
    s = np.linspace(0.0, road.length, 101)
    x, y = road.position(s)
    np.testing.assert_allclose(x, 100 * np.sin(s / 100), atol=1e-4)
    np.testing.assert_allclose(y, 100 * (1 - np.cos(s / 100)), atol=1e-4)
    np.testing.assert_allclose(road.heading(s + road.length), s / 100 + 2 * np.pi, atol=1e-6)


def test_widths_are_linear_between_stations_and_across_the_start(barcelona):
    right, left = barcelona.widths(barcelona.s)
    np.testing.assert_array_equal(right, barcelona.station_width_right)
    np.testing.assert_array_equal(left, barcelona.station_width_left)
    middle = (barcelona.s[-1] + barcelona.length) / 2
    expected = (barcelona.station_width_right[-1] + barcelona.station_width_right[0]) / 2
    assert barcelona.widths(middle)[0] == pytest.approx(expected)


def test_shapes_of_the_arguments_are_kept(barcelona):
    s = np.array([[0.0, 10.0, 20.0], [30.0, 5000.0, -7.0]])
    for value in (barcelona.curvature(s), barcelona.heading(s), *barcelona.position(s), *barcelona.widths(s)):
        assert value.shape == s.shape


def test_road_says_where_it_comes_from_and_under_which_licence(barcelona):
    assert "racetrack-database" in barcelona.attributes["source"]
    assert "OpenStreetMap" in barcelona.attributes["attribution"]
    assert "ODbL-1.0" in barcelona.attributes["licence"]
    assert barcelona.length == 4647.080214
    assert barcelona.s.size == 930
