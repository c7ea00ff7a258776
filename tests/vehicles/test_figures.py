"""Claims about the plots of appendices B and C: that they show what they are given, with units."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from thesislib.vehicles import figures


@pytest.fixture
def figure():
    return Figure(figsize=(6.4, 3.4), layout="constrained")


def labels(figure):
    return [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel())]


def test_heavier_load_is_darker_and_smaller_slip_angle_is_darker(figure):
    kappa = np.linspace(-0.1, 0.1, 5)
    by_load = {1000.0 * n: 1000.0 * n * kappa for n in (1, 2, 3)}
    by_angle = {5.0 * n: 900.0 * kappa / (1 + n) for n in (0, 1, 2)}
    left, right = figures.longitudinal_force(figure, kappa, by_load, by_angle, 2000.0).axes

    def brightness(axes):
        return [sum(line.get_color()[:3]) for line in axes.get_lines()]

    assert brightness(left) == sorted(brightness(left), reverse=True)
    assert brightness(right) == sorted(brightness(right))
    assert [text.get_text() for text in left.get_legend().get_texts()] == ["1 kN", "2 kN", "3 kN"]
    assert [text.get_text() for text in right.get_legend().get_texts()] == ["0°", "5°", "10°"]
    np.testing.assert_allclose(left.get_lines()[2].get_ydata(), 3 * kappa)
    assert "2 kN" in right.get_title()
    assert all("(kN)" in axes.get_ylabel() for axes in (left, right))


def test_force_map_marks_both_values_of_the_combined_slip(figure):
    kappa, alpha = np.linspace(-0.2, 0.2, 41), np.linspace(-0.3, 0.3, 31)
    slip, angle = np.meshgrid(kappa, alpha)
    rho = np.hypot(slip / 0.11, angle / 0.157)
    magnitude = 3000 * np.sin(1.9 * np.arctan(1.45 * rho))
    figures.force_magnitude(figure, kappa, alpha, magnitude, rho, [(0.75, "ridge"), (1.0, "one")])
    contours = figure.axes[1]
    assert [text.get_text() for text in contours.get_legend().get_texts()] == ["ridge", "one"]
    # matplotlib keeps one contour set for the map and one for each marked value
    marked = [one for one in contours.collections if len(one.levels) == 1]
    for one, value in zip(marked, (0.75, 1.0), strict=True):
        vertices = one.get_paths()[0].vertices
        on_line = np.hypot(vertices[:, 0] / 0.11, np.radians(vertices[:, 1]) / 0.157)
        np.testing.assert_allclose(on_line, value, atol=0.02)
    assert "force (kN)" in labels(figure)


def test_readings_of_the_shape_factor_are_marked_at_their_peaks(figure):
    rho = np.linspace(0.0, 2.0, 50)
    (axes,) = figures.shape_factor_readings(figure, rho, np.sin(rho), np.cos(rho), 0.7512).axes
    assert [text.get_text() for text in axes.texts] == ["peak at ρ = 0.751", "peak at ρ = 1"]
    dots = [float(line.get_xdata()[0]) for line in axes.get_lines() if line.get_marker() == "o"]
    assert dots == [0.7512, 1.0]


def test_measured_loads_are_shaded(figure):
    load = np.linspace(100.0, 12000.0, 20)
    friction = 1.9 - load / 1.2e4
    left, right = figures.peak_friction(figure, load, friction, 1.05 * friction, (2000.0, 6000.0)).axes
    for axes in (left, right):
        (shade,) = axes.patches
        assert (shade.get_x(), shade.get_width()) == (2.0, 4.0)
    np.testing.assert_allclose(right.get_lines()[0].get_ydata(), friction * load / 1e3)


def test_straight_line_diagrams_carry_weight_and_engine_power(figure):
    speed = np.linspace(0.0, 100.0, 11)
    left, right = figures.straight_line(
        figure, speed, {"drag": 0.9 * speed**2}, 0.9 * speed**3, 560e3, 6472.0
    ).axes
    levels = {
        line.get_label(): float(line.get_ydata()[0]) for axes in (left, right) for line in axes.get_lines()
    }
    assert levels["weight"] == 6.472
    assert levels["engine"] == 560.0
    assert left.get_xlim() == (0.0, 360.0)
    assert "speed (km/h)" in labels(figure)
