"""Claims about the pictures of the suspension: that they show what they are given, with names and units."""

import json
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from thesislib.suspension import WheelLoads, drawings, figures, surrogate
from thesislib.suspension.dynamics import DynamicAxle
from thesislib.suspension.linked import SCRIPT, turnable_axles
from thesislib.suspension.mechanism import Mechanism
from thesislib.suspension.tyre import loaded_radius

LOAD = np.linspace(0.0, -6000.0, 21)


@pytest.fixture
def figure():
    return Figure(figsize=(6.4, 3.4), layout="constrained")


@pytest.fixture(scope="module")
def small_sweep(front):
    return surrogate.sweep(front, -6000.0, points=7)


def curve(axes, label):
    """The line that the legend calls `label`."""
    return next(line for line in axes.get_lines() if line.get_label() == label)


def test_tyre_leaves_its_tangent_at_no_load(figure):
    (axes,) = figures.tyre_radius(figure, LOAD, loaded_radius(LOAD)).axes
    radius, tangent = (
        curve(axes, "loaded radius, (3.18)").get_ydata(),
        curve(axes, "tangent at no load").get_ydata(),
    )
    assert radius[0] == tangent[0] == 326.0
    assert radius[-1] == pytest.approx(303.467)
    assert radius[-1] > tangent[-1]  # it hardens
    assert axes.get_xlim() == (0.0, -6.0)  # more load to the right
    assert "(mm)" in axes.get_ylabel()


def test_wheel_angles_are_in_degrees(figure):
    (axes,) = figures.wheel_angles(figure, LOAD, np.radians(LOAD / 6e4), np.radians(LOAD / 3e4)).axes
    assert curve(axes, "camber, (3.21)").get_ydata()[-1] == pytest.approx(-0.1)
    assert curve(axes, "toe, (3.22)").get_ydata()[-1] == pytest.approx(-0.2)
    assert "(°)" in axes.get_ylabel()


def test_contact_displacements_are_in_millimetres(figure):
    shift = np.outer(LOAD / -6000.0, [0.0, -0.004, -0.02])
    (axes,) = figures.contact_displacement(figure, LOAD, shift).axes
    assert [curve(axes, f"Δ{name}").get_ydata()[-1] for name in "xyz"] == pytest.approx([0.0, -4.0, -20.0])


def test_maps_name_height_and_roll_with_units(figure, small_sweep):
    figures.stance_maps(figure, small_sweep)
    named = [axes.get_xlabel() for axes in figure.axes]
    assert {"ride height (mm)", "roll angle (°)"} <= set(named)
    left, right = figure.axes[:2]
    assert left.get_xlabel() == right.get_xlabel() == "force on the left tyre (kN)"
    assert left.get_ylabel() == "force on the right tyre (kN)"
    assert left.xaxis_inverted() and left.yaxis_inverted()


def test_every_spring_has_a_solid_and_a_dashed_curve(figure):
    curves = {5e5: LOAD, 1e6: 2 * LOAD}
    (axes,) = figures.over_stiffness(figure, LOAD, curves, curves, ("force (kN)", "height (mm)")).axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "500 kN/m",
        "1000 kN/m",
        "Table 3.2",
    ]
    assert [line.get_linestyle() for line in axes.get_lines()] == ["-", "--", "-", "--", "--"]


def test_mesh_of_the_table_is_marked_where_it_ends(figure, front):
    far = surrogate.sweep(front, -9000.0, points=7)
    table = surrogate.fitted(surrogate.sweep(front, -6000.0, points=7))
    axes = figures.table_errors(figure, far, table).axes[0]
    np.testing.assert_array_equal(curve(axes, "mesh of the table").get_xydata(), [[-6, 0], [-6, -6], [0, -6]])


def test_errors_stand_over_the_degree_on_a_logarithmic_axis(figure):
    (axes,) = figures.degree_errors(figure, (2, 3), {"front": (0.1, 0.01), "rear": (0.2, 0.03)}).axes
    assert axes.get_yscale() == "log"
    np.testing.assert_array_equal(curve(axes, "rear").get_ydata(), (0.2, 0.03))


def test_conditions_and_errors_stand_beside_each_other(figure):
    degrees = np.array([1, 2])
    left, right = figures.conditioning(figure, degrees, {"Φ": degrees * 10.0}, {"QR": degrees * 0.0}).axes
    np.testing.assert_array_equal(curve(left, "Φ").get_ydata(), [10.0, 20.0])
    np.testing.assert_array_equal(curve(right, "QR").get_ydata(), [1e-18, 1e-18])  # zero is drawn as rounding


def test_replayed_lap_shows_motion_rest_and_their_difference(figure, front):
    t = np.linspace(0.0, 0.2, 5)
    history = DynamicAxle(front, 265.0, 30.0).replay(t, np.linspace(-1500, -3000, 5), np.full(5, -1500.0))
    upper, lower = figures.replayed_lap(figure, {"front": history, "rear": history}).axes
    gap = curve(upper, "front, moving").get_ydata() - curve(upper, "front, at rest").get_ydata()
    np.testing.assert_allclose(curve(lower, "front").get_ydata(), gap, atol=1e-12)
    assert upper.get_ylabel() == "ride height (mm)"
    assert lower.get_xlabel() == "time (s)"


def test_both_axles_are_drawn_a_wheelbase_apart(figure, axles):
    (axes,) = drawings.both_axles(figure, axles["front"], axles["rear"], 3.4).axes
    wishbones = [line.get_data_3d() for line in axes.get_lines() if line.get_color() == drawings.WISHBONE]
    drawn = [np.array(one) for one in wishbones if len(one[0])]
    assert len(drawn) == 16  # four arms at each of four wheels
    outer = np.array([one[:, 1] for one in drawn])
    assert np.ptp(outer[:, 0]) == pytest.approx(3.4, abs=0.02)
    # left and right wheels mirror each other
    np.testing.assert_allclose(np.sort(outer[:, 1]), -np.sort(outer[:, 1])[::-1], atol=1e-12)


def test_joints_of_the_left_corner_are_named_once_in_each_view(figure, front):
    for axes in drawings.left_corner(figure, front).axes:
        named = re.findall(r"[PQ]_\d", " ".join(text.get_text() for text in axes.texts))
        assert sorted(named) == [f"P_{i}" for i in range(1, 7)] + [f"Q_{i}" for i in range(1, 7)]


def test_rocker_drawing_names_both_sides(figure, front):
    (axes,) = drawings.rocker_assembly(figure, front).axes
    named = " ".join(text.get_text() for text in axes.texts)
    assert all(f"{{{point}{side}}}" in named for point in ("RP", "6", "H") for side in "LR")
    assert "$K_h$" in named


def test_free_body_states_the_solved_forces(figure, front):
    loads = WheelLoads.of(-1523.0, -1523.0)
    solution = Mechanism(front).solve(loads)
    (axes,) = drawings.free_body(figure, front, solution, loads.left[0]).axes
    stated = [text.get_text() for text in axes.texts]
    for i, force in enumerate(np.abs(solution.rod_forces[0, 0])):
        name = f"$R_{{L{i + 1}}}$" if i < 5 else "$F_{PL}$"
        assert f"{name} {force:.0f} N" in stated
    assert "$F_{TL}$ 1523 N" in stated


def test_rolled_axle_stands_on_the_road_at_its_height(figure, axles):
    standing = Mechanism(axles["rear"]).solve(WheelLoads.of(-6000.0, -2000.0))
    (axes,) = drawings.rolled_axle(figure, axles["rear"], standing).axes
    plane = curve(axes, "reference plane").get_xydata()
    height = np.interp(0.0, plane[:, 0], plane[:, 1])
    assert height == pytest.approx(1e3 * standing.height[0], abs=1e-9)
    assert np.arctan2(*(plane[1] - plane[0])[::-1]) == pytest.approx(standing.roll[0], abs=1e-12)
    tyres = axes.patches[1:]
    lowest = [patch.get_xy()[:, 1].max() for patch in tyres]
    # the contact point lies on the road, half a tyre's width beside it a few millimetres off
    assert lowest == pytest.approx([0.0, 0.0], abs=6.0)


def test_turnable_axles_hold_every_joint_and_fetch_nothing(axles):
    scene = turnable_axles(axles["front"], axles["rear"], 3.4)
    joints = next(trace for trace in scene.traces if trace["name"] == "joints")
    assert len(joints["text"]) == len(set(joints["text"])) == 2 * 2 * 12
    page = scene._repr_html_()
    assert SCRIPT in page
    assert not re.search(r"https?://", page)
    json.dumps(scene.traces, allow_nan=False)


def test_same_axles_make_the_same_page(axles):
    pages = {turnable_axles(axles["front"], axles["rear"], 3.4)._repr_html_() for _ in range(2)}
    assert len(pages) == 1
    assert turnable_axles(axles["front"], axles["rear"], 3.3)._repr_html_() not in pages
