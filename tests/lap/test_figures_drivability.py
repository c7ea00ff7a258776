"""Pictures of drivability show the numbers they are given, with units."""

import re

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection

from thesislib.lap import figures_drivability as figures
from thesislib.lap.aero_balance import Drivability
from thesislib.lap.channels import time_shares
from thesislib.lap.handling import STANDARD_GRAVITY, linear_understeer_gradient, steady_cornering
from thesislib.lap.setups import Setup
from thesislib.lap.yaw_stability import YawStability


@pytest.fixture(scope="module")
def stability(synthetic_lap) -> YawStability:
    growth = 8.0 * np.sin(6.0 * np.pi * synthetic_lap.s / synthetic_lap.track.length) - 2.0
    eigenvalues = np.column_stack((growth, growth - 10.0)).astype(complex)
    return YawStability(synthetic_lap.s, eigenvalues, time_shares(synthetic_lap) / synthetic_lap.time)


@pytest.fixture(scope="module")
def branches():
    car = Setup().car()
    return [steady_cornering(car, kmh / 3.6) for kmh in (80.0, 200.0, 300.0)]


SWEPT = [
    Drivability(f"a_off = {offset:g}", 84.6 - 5.0 * offset, 0.4 - offset, 13.0 - 20.0 * offset)
    for offset in (0.0, 0.1, 0.2)
]
ROWS = [Drivability("row M", 83.7, 0.08, 8.3)]


@pytest.fixture(scope="module")
def drawn(synthetic_lap, stability, branches, corners):
    s = synthetic_lap.s
    return {
        "along": figures.growth_along_lap(
            {"base": stability, "other": stability}, synthetic_lap.track.length, corners
        ),
        "map": figures.growth_on_map(synthetic_lap, stability, corners),
        "front": figures.time_and_stability(SWEPT, ROWS, front=SWEPT[1:]),
        "handling": figures.handling_diagram(branches),
        "speeds": figures.cornering_over_speed(branches),
        "cost": figures.cost_along_lap(
            {f"tyres {'with a long name ' * 2}": (s, 1e-5 * s, 0.0465)}, synthetic_lap.track.length, corners
        ),
    }


def test_every_axis_label_carries_a_unit(drawn) -> None:
    for name, figure in drawn.items():
        labels = [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
        assert labels, name
        for label in labels:
            assert re.search(r"\((m|s|ms|km/h|g|°|°/g|%|1/s)\)(, red unstable)?$", label), label


def test_the_unstable_stretches_are_filled_and_their_share_is_said(drawn, stability) -> None:
    axes = drawn["along"].axes[0]
    [filled] = [each for each in axes.collections if isinstance(each, PolyCollection)]
    assert f"{100.0 * stability.unstable_share:.0f} %" in filled.get_label()
    heights = np.concatenate([path.vertices[:, 1] for path in filled.get_paths()])
    assert heights.min() >= 0.0
    assert heights.max() == pytest.approx(stability.largest_growth)


def test_the_map_turns_red_where_growth_is_positive(drawn, stability) -> None:
    [line] = [each for each in drawn["map"].axes[0].collections if isinstance(each, LineCollection)]
    assert line.norm(0.0) == 0.5
    assert line.get_array().max() == pytest.approx(stability.largest_growth, rel=0.05)


def test_every_lap_is_a_point_with_its_name(drawn) -> None:
    for axes, ordinates in (
        (drawn["front"].axes[0], [100.0 * each.unstable_share for each in SWEPT]),
        (drawn["front"].axes[1], [each.largest_growth for each in SWEPT]),
    ):
        curve = axes.get_lines()[0]
        np.testing.assert_allclose(curve.get_xdata(), [each.lap_time for each in SWEPT])
        np.testing.assert_allclose(curve.get_ydata(), ordinates)
    assert [text.get_text() for text in axes.texts] == ["0", "0.1", "0.2", "M"]


def test_the_handling_diagram_ends_at_the_limit_and_is_dashed_where_the_car_is_unstable(
    drawn, branches
) -> None:
    axes = drawn["handling"].axes[0]
    for branch, label in zip(branches, ("80", "200", "300"), strict=True):
        [stable] = [line for line in axes.get_lines() if line.get_label() == f"{label} km/h"]
        colour = stable.get_color()
        mine = [line for line in axes.get_lines() if line.get_color() == colour]
        [dashed] = [line for line in mine if line.get_linestyle() == "--"]
        unstable = np.isfinite(dashed.get_ydata())
        assert (branch.growth[unstable][1:] > 0.0).all()
        assert unstable.any() == (branch.growth > 0.0).any()
        [end] = [line for line in mine if line.get_marker() == "o"]
        assert end.get_xdata()[0] == pytest.approx(branch.limit / STANDARD_GRAVITY)
        crosses = [line for line in mine if line.get_marker() == "x"]
        assert len(crosses) == (branch.power_limit < branch.limit)


def test_the_linear_car_stands_beside_the_full_one(drawn, branches) -> None:
    dashed = drawn["speeds"].axes[0].get_lines()[1]
    expected = [np.degrees(linear_understeer_gradient(each)) * STANDARD_GRAVITY for each in branches]
    np.testing.assert_allclose(dashed.get_ydata(), expected)


def test_a_cost_says_its_total(drawn) -> None:
    line = drawn["cost"].axes[0].get_lines()[0]
    assert line.get_label().endswith(", +46 ms")
    assert max(line.get_ydata()) == pytest.approx(46.5, rel=0.01)
