"""Claims about the drawings of the suspension: that they are the geometry and the forces they are given."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from thesislib.suspension import WheelLoads, drawings
from thesislib.suspension.mechanism import Mechanism


@pytest.fixture
def figure():
    return Figure(figsize=(6.4, 3.4), layout="constrained")


def curve(axes, label):
    """The line that the legend calls `label`."""
    return next(line for line in axes.get_lines() if line.get_label() == label)


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
