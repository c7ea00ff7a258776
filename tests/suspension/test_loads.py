"""Claims about load cases and about how a car stands on two contact points (figure 3.8)."""

import numpy as np
import pytest

from thesislib.suspension.loads import WheelLoads, stance


def test_loads_of_a_mesh_are_flattened_and_remember_their_shape():
    loads = WheelLoads.of(np.zeros((3, 4)), -100.0, left=(1.0, 2.0))
    assert (len(loads), loads.shape) == (12, (3, 4))
    np.testing.assert_array_equal(loads.left[5], [1.0, 2.0, 0.0])
    np.testing.assert_array_equal(loads.right[5], [0.0, 0.0, -100.0])
    assert not loads.vertical_only


def test_tyre_that_pulls_the_wheel_down_is_refused():
    with pytest.raises(ValueError, match="vertical tyre force of 5 N pulls the wheel to the road"):
        WheelLoads.of([-1.0, 5.0], -1.0)


def test_loads_that_are_no_numbers_are_refused():
    with pytest.raises(ValueError, match="not a finite number"):
        WheelLoads.of(-1.0, -1.0, steer=float("nan"))


def test_level_car_stands_as_high_as_its_reference_plane():
    here = stance(np.array([[0.0, -0.7, 0.32]]), np.array([[0.0, 0.7, 0.32]]), 0.25)
    assert here.height[0] == pytest.approx(-0.07, abs=1e-15)
    assert here.roll[0] == 0.0


def test_rolled_car_is_turned_about_the_road():
    # points on a road that is turned by 3 degrees in the chassis; the height is a distance along its normal
    angle = np.radians(3.0)
    y = np.array([-0.7, 0.72])
    z = 0.3 - np.tan(angle) * y
    here = stance(np.array([[0.0, y[0], z[0]]]), np.array([[0.0, y[1], z[1]]]), 0.2)
    assert here.roll[0] == pytest.approx(angle, abs=1e-15)
    assert here.height[0] == pytest.approx(-0.1 * np.cos(angle), abs=1e-15)


def test_more_compressed_left_side_rolls_the_car_to_the_left():
    # the left contact point is higher in the chassis: SAE roll is negative, as in a right-hand bend
    here = stance(np.array([[0.0, -0.7, 0.30]]), np.array([[0.0, 0.7, 0.33]]), 0.25)
    assert here.roll[0] < 0.0
