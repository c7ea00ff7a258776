"""Claims about the linkage of one wheel over its travel."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from thesislib.suspension import GeometryError
from thesislib.suspension.kinematics import Curves, kinematics


@pytest.fixture(scope="module")
def wheel(axle):
    return kinematics(axle)


@pytest.fixture(scope="module")
def travels(axle):
    return np.linspace(*axle.travel, 37)


def carriers(wheel, q):
    phi, theta, psi = wheel.pose(q)[3:]
    return Rotation.from_euler("ZXY", np.column_stack((psi, phi, theta)))


def test_links_keep_their_lengths_over_the_whole_travel(axle, wheel, travels):
    turn, centre = carriers(wheel, travels), wheel.centre(travels).T
    rocker = Rotation.from_rotvec(wheel.rocker(travels)[0][:, None] * axle.rocker_axis)
    inner = [*axle.chassis, axle.pivot + rocker.apply(axle.rod_end - axle.pivot)]
    for end, point, length in zip(inner, axle.carrier, axle.link_lengths, strict=True):
        apart = np.linalg.norm(centre + turn.apply(point - axle.wheel_centre) - end, axis=1)
        np.testing.assert_allclose(apart, length, atol=1e-8)  # ten nanometres: the polynomials' own error


def test_polynomials_follow_the_linkage_between_their_nodes(wheel):
    assert wheel.fit_error < 1e-8


def test_bump_lifts_the_wheel_by_the_travel(wheel, travels):
    np.testing.assert_allclose(wheel.centre(travels)[2] - wheel.centre(np.zeros(1))[2], -travels, atol=1e-9)


def test_spin_is_the_rate_of_the_carriers_rotation(wheel):
    q, step = np.array([-0.02, 0.0, 0.03]), 1e-5
    turned = (carriers(wheel, q + step) * carriers(wheel, q - step).inv()).as_rotvec() / (2 * step)
    np.testing.assert_allclose(wheel.spin(q).T, turned, atol=1e-6)  # second-order differences


def test_rocker_stands_at_zero_at_rest(wheel):
    assert wheel.rocker(np.zeros(1))[0, 0] == pytest.approx(0.0, abs=1e-8)


def test_derivative_of_curves_is_that_of_differences(wheel):
    q, step = np.array([-0.03, 0.01]), 1e-5
    numerical = (wheel.rocker(q + step) - wheel.rocker(q - step)) / (2 * step)
    np.testing.assert_allclose(wheel.rocker.derivative()(q), numerical, rtol=1e-7)


def test_curves_through_a_polynomial_are_that_polynomial():
    q = 0.04 * np.cos(np.pi * (np.arange(41) + 0.5) / 41) + 0.01
    curves = Curves.through(q, np.column_stack((q**3, 1.0 - 2.0 * q)), (-0.03, 0.05))
    at = np.array([-0.02, 0.0, 0.045])
    np.testing.assert_allclose(curves(at), [at**3, 1.0 - 2.0 * at], atol=1e-14)
    np.testing.assert_allclose(curves.derivative()(at), [3.0 * at**2, -2.0 + 0.0 * at], atol=1e-11)


def test_travel_beyond_the_links_reach_is_refused_with_its_place(front):
    with pytest.raises(GeometryError, match=r"at a wheel travel of -?\d+\.\d mm the links do not meet"):
        kinematics(front, travel=(-0.9, 0.9))


def test_rocker_that_cannot_follow_is_refused_with_its_place(front):
    # a rocker arm of 25 mm cannot turn far enough for a travel of 5 cm
    short = front.pivot + 0.25 * (front.rod_end - front.pivot)
    stubby = replace(front, rod_end=short, link_lengths=np.array([]))
    with pytest.raises(GeometryError, match=r"at a wheel travel of .* the rocker cannot follow the push rod"):
        kinematics(stubby)


def test_steer_turns_the_wheel_about_the_wishbones(front):
    angle = [kinematics(front, steer).pose(np.zeros(1))[5, 0] for steer in (-0.3, 0.0, 0.3)]
    assert angle[1] == pytest.approx(0.0, abs=1e-8)
    assert angle[0] * angle[2] < 0.0
    assert abs(angle[2]) > np.radians(1.0)
