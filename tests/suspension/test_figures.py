"""Claims about the plots of the suspension: that they show what they are given, with names and units."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from thesislib.suspension import figures, surrogate
from thesislib.suspension.dynamics import DynamicAxle
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
