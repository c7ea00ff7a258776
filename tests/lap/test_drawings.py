"""The drawings follow the conventions that their captions claim."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.patches import FancyArrowPatch

from thesislib.lap import drawings, sketching

ALL = [
    drawings.plan_view,
    drawings.curvilinear_coordinates,
    drawings.tyre_force_system,
    drawings.aero_suspension_data_flow,
]


def texts(figure):
    return {text.get_text() for text in figure.axes[0].texts}


def arrows(figure):
    return [
        np.array(patch._posA_posB) for patch in figure.axes[0].patches if isinstance(patch, FancyArrowPatch)
    ]


@pytest.mark.parametrize("drawing", ALL, ids=lambda drawing: drawing.__name__)
def test_y_points_down_the_page_so_that_it_is_to_the_right_of_x(drawing):
    axes = drawing().axes[0]
    assert axes.yaxis_inverted()
    assert not axes.xaxis_inverted()
    assert axes.get_aspect() == 1.0


@pytest.mark.parametrize("drawing", ALL, ids=lambda drawing: drawing.__name__)
def test_no_symbol_leaves_the_sheet(drawing):
    figure = drawing()
    figure.draw_without_rendering()
    sheet = figure.bbox
    for text in figure.axes[0].texts:
        box = text.get_window_extent()
        assert sheet.x0 <= box.x0 and box.x1 <= sheet.x1, text.get_text()
        assert sheet.y0 <= box.y0 and box.y1 <= sheet.y1, text.get_text()


@pytest.mark.parametrize("drawing", ALL, ids=lambda drawing: drawing.__name__)
def test_no_two_symbols_cover_each_other(drawing):
    figure = drawing()
    figure.draw_without_rendering()
    boxes = [(text.get_text(), text.get_window_extent()) for text in figure.axes[0].texts]
    for index, (one, box) in enumerate(boxes):
        for other, second in boxes[index + 1 :]:
            assert not box.overlaps(second), f"{one} and {other}"


def test_plan_view_is_drawn_to_the_scale_of_its_lengths():
    lengths = {"a": 2.0, "b": 1.4, "w_f": 0.8, "w_r": 0.6}
    ends = arrows(drawings.plan_view(**lengths))
    sizes = np.array([np.linalg.norm(tip - tail) for tail, tip in ends])
    for name, length in lengths.items():
        assert np.any(np.abs(sizes - length) < 1e-12), name


def test_plan_view_names_each_of_its_lengths_and_axes():
    assert {"$a$", "$b$", "$w_f$", "$w_r$", "$x_b$", "$y_b$", "$M_c$"} <= texts(drawings.plan_view())


def test_coordinates_of_the_road_are_all_named():
    names = texts(drawings.curvilinear_coordinates())
    assert {
        "$s$",
        r"$\mathbf{n}$",
        r"$\xi$",
        r"$\theta$",
        r"$\psi$",
        r"$\mathcal{R} = 1/\mathcal{C}$",
    } <= names
    assert {r"$\mathcal{N}_r$", r"$\mathcal{N}_l$"} <= names


def test_each_wheel_has_a_force_along_it_and_one_to_its_right():
    names = texts(drawings.tyre_force_system())
    assert {f"$F_{{{wheel}{axis}}}$" for wheel in ("fl", "fr", "rl", "rr") for axis in "xy"} <= names
    assert {r"$\delta$", r"$\beta$", r"$\psi$"} <= names


def test_lateral_forces_stand_a_quarter_turn_clockwise_of_the_longitudinal_ones():
    by_tail: dict[tuple[float, float], list] = {}
    for tail, tip in arrows(drawings.tyre_force_system()):
        by_tail.setdefault(tuple(tail), []).append(tip - tail)
    wheels = [found for tail, found in by_tail.items() if len(found) == 2 and tail != (0.0, 0.0)]
    assert len(wheels) == 4
    for along, across in wheels:
        assert np.dot(along, across) == pytest.approx(0.0, abs=1e-12)
        assert along[0] * across[1] - along[1] * across[0] > 0.0


def test_an_angle_from_x_to_y_is_a_right_hand_turn():
    assert sketching.away((0.0, 0.0), 0.5 * np.pi, 1.0) == pytest.approx((0.0, 1.0))
    assert sketching.away((0.0, 0.0), 0.0, 0.0, 1.0) == pytest.approx((0.0, 1.0))


def test_data_flow_closes_from_the_loads_over_the_heights_to_the_forces():
    names = " ".join(texts(drawings.aero_suspension_data_flow()))
    for symbol in ("F_{flz}", "h_f", r"\phi_r", r"\delta", "C_L^f", "C_D", "F_{az}^r", "F_{ax}"):
        assert symbol in names
    assert len(arrows(drawings.aero_suspension_data_flow())) == 6
