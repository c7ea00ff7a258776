"""Each figure shows the lap's own numbers, with units, and north up."""

from __future__ import annotations

import re

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import LineCollection

from thesislib.lap import channels, figures, figures_setups, maps, style, views


def downforce(h_f, h_r):
    """The rows of Table 4.1 for the ride heights."""
    return 1.2 + 10.0 * h_f - 5.0 * h_r, 0.9494 + h_f - 22.2222 * h_r - 222.2222 * h_r**2


def of_two(draw):
    """Draw a lap against another one, on a coarser mesh."""
    return lambda lap, corners=None: draw(lap, type(lap)(lap.track, intervals=200), corners)


ALONG = {
    "speed": figures.speed_trace,
    "ride heights": figures.ride_heights,
    "roll angles": figures.roll_angles,
    "coefficients": figures.aerodynamic_coefficients,
    "forces": figures.aerodynamic_forces,
    "slip": views.combined_slip,
    "brake share": views.front_brake_share,
    "steer rate": views.steering_rate,
    "constraints": views.active_constraints,
    "ride heights of two": of_two(figures_setups.ride_heights_of_two),
    "front downforce of two": of_two(figures_setups.front_downforce_of_two),
    "rear downforce of two": of_two(figures_setups.rear_downforce_of_two),
    "balance": figures_setups.aero_balance,
    "forces of two": of_two(figures_setups.aerodynamic_forces_of_two),
    "speed gain": of_two(figures_setups.speed_gain),
}
OTHER = {
    "maps of downforce": lambda lap: figures.downforce_maps(downforce, lap=lap),
    "racing line": maps.racing_line,
    "mesh": maps.mesh_on_map,
    "g-g": views.g_g,
}
MAPS = {"racing line": maps.racing_line, "mesh": maps.mesh_on_map}


def curve(axes, label):
    found = [line for line in axes.get_lines() if str(line.get_label()).startswith(label)]
    assert len(found) == 1, f"{label}: {[line.get_label() for line in axes.get_lines()]}"
    return found[0]


def by_name(drawings):
    return pytest.mark.parametrize("draw", drawings.values(), ids=drawings.keys())


@by_name(ALONG | OTHER)
def test_every_axis_label_carries_a_unit(draw, synthetic_lap):
    labels = [
        label
        for axes in draw(synthetic_lap).axes
        for label in (axes.get_xlabel(), axes.get_ylabel())
        if label
    ]
    assert labels
    for label in labels:
        if not label.startswith("lap-time"):
            assert re.search(r"\((m|mm|km/h|kN|g|°|°/s|%|s|1)\)$", label), label


@by_name(ALONG)
def test_distance_axis_spans_the_lap_and_shows_every_corner(draw, synthetic_lap, corners):
    axes = draw(synthetic_lap, corners).axes
    assert all(panel.get_xlim() == (0.0, synthetic_lap.track.length) for panel in axes)
    numbers = [text for panel in axes for text in panel.texts if text.get_text().isdigit()]
    assert [(int(text.get_text()), text.xy[0]) for text in numbers] == [(n, s) for n, s, _ in corners]


@by_name(ALONG)
def test_corners_are_optional(draw, synthetic_lap):
    assert not [
        text for panel in draw(synthetic_lap).axes for text in panel.texts if text.get_text().isdigit()
    ]


@by_name(MAPS)
def test_north_is_up_and_both_scales_are_one(draw, synthetic_lap):
    axes = draw(synthetic_lap).axes[0]
    assert axes.yaxis_inverted()
    assert axes.get_aspect() == 1.0
    assert "south" in axes.get_ylabel()


@by_name(ALONG | OTHER)
def test_drawing_leaves_matplotlibs_settings_as_they_were(draw, synthetic_lap):
    before = dict(matplotlib.rcParams)
    draw(synthetic_lap)
    assert dict(matplotlib.rcParams) == before


def test_a_picture_shows_itself_as_png_without_pyplot(synthetic_lap):
    assert figures.roll_angles(synthetic_lap)._repr_png_().startswith(b"\x89PNG\r\n")


def test_speed_is_that_of_the_mass_centre_in_km_per_hour(synthetic_lap):
    line = curve(figures.speed_trace(synthetic_lap).axes[0], "lap time")
    expected = 3.6 * np.hypot(synthetic_lap["u"], synthetic_lap["v"])
    inside = np.isin(line.get_xdata(), synthetic_lap.s)
    np.testing.assert_allclose(np.asarray(line.get_ydata())[inside], expected)
    assert f"{synthetic_lap.time:.2f} s" in line.get_label()


def test_mesh_points_on_the_map_are_the_laps_on_the_racing_line(synthetic_lap):
    axes = maps.mesh_on_map(synthetic_lap, from_m=1000.0, to_m=2500.0).axes[0]
    mesh = synthetic_lap.mesh_points
    mesh = mesh[(mesh >= 1000.0) & (mesh <= 2500.0)]
    # the first collocation point of a Radau interval is its mesh point, so no interpolation shows
    at_mesh = np.isin(synthetic_lap.s, mesh)
    assert np.count_nonzero(at_mesh) == mesh.size
    expected = channels.beside(synthetic_lap.track, mesh, synthetic_lap["n"][at_mesh])
    line = next(line for line in axes.get_lines() if "mesh points" in str(line.get_label()))
    np.testing.assert_allclose(line.get_data(), expected, atol=1e-9)
    assert line.get_label() == f"{mesh.size} mesh points"


def test_collocation_points_on_the_map_are_the_laps(synthetic_lap):
    axes = maps.mesh_on_map(synthetic_lap).axes[0]
    line = next(line for line in axes.get_lines() if "collocation" in str(line.get_label()))
    inside = (synthetic_lap.s >= 3000.0) & (synthetic_lap.s <= 4500.0)
    assert len(line.get_xdata()) == np.count_nonzero(inside)


def test_a_part_of_the_map_off_the_lap_is_refused(synthetic_lap):
    with pytest.raises(ValueError, match=r"must lie within 0 \.\. 4650"):
        maps.mesh_on_map(synthetic_lap, from_m=3000.0, to_m=5000.0)


def test_racing_line_is_coloured_by_speed(synthetic_lap):
    figure = maps.racing_line(synthetic_lap)
    line = next(item for item in figure.axes[0].collections if isinstance(item, LineCollection))
    speed = 3.6 * channels.speed(synthetic_lap)
    low, high = line.get_clim()
    # segments carry the mean of their ends
    assert speed.min() <= low <= speed.min() + 1.0
    assert speed.max() - 1.0 <= high <= speed.max()
    assert figure.axes[1].get_xlabel() == "speed (km/h)"


def test_racing_line_names_corners_with_their_distance(synthetic_lap, corners):
    names = [text.get_text() for text in maps.racing_line(synthetic_lap, corners).axes[0].texts]
    for number, s, _ in corners:
        assert f"{number}\n{s:.0f} m" in names


def test_names_of_corners_keep_clear_of_the_road_and_each_other(synthetic_lap, corners):
    half = np.array([0.0128, 0.0082]) * synthetic_lap.track.length
    places = maps.places_beside_road(
        synthetic_lap.track, corners, (0.0128, 0.0082), (0.017, 0.022, 0.028, 0.036)
    )
    road = np.column_stack(synthetic_lap.track.position(np.linspace(0.0, 4650.0, 500)))
    for index, place in enumerate(places):
        assert np.count_nonzero(np.all(np.abs(road - place) < 0.9 * half, axis=1)) == 0
        assert not np.any(np.all(np.abs(places[:index] - place) < 2.0 * half, axis=1))


def test_bound_of_the_front_ride_height_is_drawn_at_15_mm(synthetic_lap):
    bound = curve(figures.ride_heights(synthetic_lap).axes[0], "bound")
    assert list(bound.get_ydata()) == [15.0, 15.0]
    assert bound.get_label() == "bound, 15 mm"


def test_front_ride_height_is_in_millimetres_and_stays_below_its_bound(synthetic_lap):
    line = curve(figures.ride_heights(synthetic_lap).axes[0], "front")
    assert np.max(line.get_ydata()) == pytest.approx(1e3 * synthetic_lap["h_f"].max())
    assert np.max(line.get_ydata()) <= 15.0 + 1e-9


@pytest.mark.parametrize(
    ("draw", "below"),
    [(figures.ride_heights, "speed"), (figures.aerodynamic_coefficients, "drag, $C_D$")],
)
def test_the_legend_above_two_panels_names_the_curve_in_the_lower_one(draw, below, synthetic_lap):
    upper, lower = draw(synthetic_lap).axes
    assert [text.get_text() for text in upper.get_legend().texts][-1] == below
    assert lower.get_legend() is None


def test_roll_angles_are_in_degrees(synthetic_lap):
    line = curve(figures.roll_angles(synthetic_lap).axes[0], "rear")
    assert np.max(line.get_ydata()) == pytest.approx(np.degrees(synthetic_lap["phi_r"].max()))


def test_drag_is_drawn_as_a_positive_force_and_the_downforces_add_up(synthetic_lap):
    axes = figures.aerodynamic_forces(synthetic_lap).axes[0]
    drag = np.asarray(curve(axes, "drag").get_ydata())
    np.testing.assert_allclose(drag.max(), -1e-3 * synthetic_lap["F_ax"].min())
    total, front, rear = (np.asarray(curve(axes, name).get_ydata()) for name in ("total", "front", "rear"))
    np.testing.assert_allclose(total, front + rear)


def test_downforce_maps_contour_the_function_they_are_given():
    figure = figures.downforce_maps(downforce, h_f_mm=(-10.0, 10.0), h_r_mm=(-70.0, -40.0))
    filled = figure.axes[0].collections[0]
    corner_values = [downforce(h_f, h_r)[0] for h_f in (-0.01, 0.01) for h_r in (-0.07, -0.04)]
    assert filled.zmin == pytest.approx(min(corner_values))
    assert filled.zmax == pytest.approx(max(corner_values))
    # the rear coefficient is greatest at 50 mm, inside the range and on the deepest front height
    assert figure.axes[1].collections[0].zmax == pytest.approx(downforce(0.01, -0.05)[1], abs=1e-4)


def test_g_g_plot_is_in_units_of_gravity_with_right_turns_to_the_right(synthetic_lap):
    points = views.g_g(synthetic_lap).axes[0].collections[0].get_offsets()
    np.testing.assert_allclose(points[:, 0], synthetic_lap["a_y"] / 9.80665)
    np.testing.assert_allclose(points[:, 1], synthetic_lap["a_x"] / 9.80665)


def test_combined_slip_has_a_panel_per_wheel_with_the_peak_at_0751(synthetic_lap):
    axes = views.combined_slip(synthetic_lap).axes
    assert [panel.get_ylabel().split("\n")[0] for panel in axes] == list(channels.WHEEL_NAMES.values())
    assert all(list(curve(panel, "greatest force").get_ydata()) == [0.751, 0.751] for panel in axes)


def test_brake_share_is_broken_where_the_car_does_not_brake(synthetic_lap):
    line = curve(views.front_brake_share(synthetic_lap).axes[0], "front axle")
    share = np.asarray(line.get_ydata())
    braking = ~np.isnan(share)
    assert 0 < np.count_nonzero(braking) < share.size
    # the fake brakes with 30 % on each front wheel and 20 % on each rear wheel
    np.testing.assert_allclose(share[braking], 60.0)


def test_constraint_strip_tells_the_share_of_the_lap(synthetic_lap):
    labels = [label.get_text() for label in views.active_constraints(synthetic_lap).axes[0].get_yticklabels()]
    spans = channels.active_spans(synthetic_lap, synthetic_lap.activity("left_edge"))
    share = 100.0 * sum(length for _, length in spans) / synthetic_lap.track.length
    assert 1.0 < share < 99.0
    assert f"left edge of the road, {share:.1f} %" in labels
    assert "front slip bound, 0.0 %" in labels


def test_lap_time_differences_stand_by_size_with_their_names():
    figure = views.lap_time_differences(["small", "large", "middle"], [0.01, -0.9, 0.3])
    axes = figure.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["large", "middle", "small"]
    assert [bar.get_width() for bar in axes.patches] == [-0.9, 0.3, 0.01]
    assert {text.get_text() for text in axes.texts} == {"−0.900", "+0.300", "+0.010"}


def test_a_choice_without_its_difference_is_refused():
    with pytest.raises(ValueError, match="2 choices cannot have 1 lap-time differences"):
        views.lap_time_differences(["one", "two"], [0.1])


def test_a_corner_off_the_lap_is_refused(synthetic_lap):
    with pytest.raises(ValueError, match=r"corner 7 lies at 9000\.0 m, outside the lap of 0 \.\. 4650"):
        figures.speed_trace(synthetic_lap, [(7, 9000.0, "R")])


def test_close_corners_go_to_rows_of_their_own_and_distant_ones_to_the_first():
    rows = style.corner_rows([(3, 30.0, "R"), (1, 0.0, "R"), (2, 20.0, "L"), (4, 500.0, "R")], 1000.0)
    assert [(corner[0], row) for corner, row in rows] == [(1, 0), (2, 1), (3, 2), (4, 0)]
