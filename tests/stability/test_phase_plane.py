"""True regions of attraction and windows."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib.stability.phase_plane import Window, escapes, polygon_area, true_region


def squared_norm(x):
    return (x**2).sum(axis=-1)


def test_the_largest_ball_agrees_with_an_independent_tracing(car, magic):
    # both from another program with other seeds: 0.77594 and 0.77354
    assert true_region(car).largest_level(squared_norm) == pytest.approx(0.77594, abs=2e-5)
    assert true_region(magic).largest_level(squared_norm) == pytest.approx(0.77354, abs=2e-5)


def test_motions_on_both_sides_of_the_boundary_part(car, truth):
    manifold = truth.manifolds[1]
    inside = truth.slip_window(0.5).contains(manifold)
    points = manifold[inside][::50]
    # one per cent towards the trim, and one per cent away from it
    assert escapes(car, 0.99 * points) == 0
    assert escapes(car, 1.01 * points) == len(points)


def test_turning_the_wheel_the_other_way_mirrors_the_region(car):
    right, left = (true_region(replace(car, u_0=10.0, delta=d)) for d in (0.08, -0.08))
    assert np.allclose(right.saddles, -left.saddles[::-1], atol=1e-8)
    areas = [each.slip_window().area(each.boundary) for each in (right, left)]
    assert areas[0] == pytest.approx(areas[1], rel=1e-5)


def test_a_window_cuts_a_square_from_a_larger_one():
    square = 2.0 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    window = Window("unit", np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]]), np.ones(4))
    assert window.area(square) == pytest.approx(4.0, rel=1e-12)
    assert window.area(square + 10.0) == 0.0
    assert polygon_area(square) == pytest.approx(16.0)


def test_a_car_without_saddles_is_refused(magic):
    with pytest.raises(ValueError, match="a saddle on neither side of its trim"):
        true_region(replace(magic, a=1.1, b=1.4))
