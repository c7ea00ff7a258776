"""Claims about the Euler–Lagrange equation, functionals of curves, and polygons."""

import casadi as ca
import numpy as np
import pytest

from thesislib.classical.calculus_of_variations import Curve, EulerLagrange, best_polygon

LENGTH = EulerLagrange(lambda y, slope, x: ca.sqrt(1 + slope**2))


def test_left_hand_side_of_the_path_length_has_the_opposite_sign_of_2_68():
    slope, curvature = np.array([0.0, 0.5, -2.0]), np.array([1.0, 2.0, -0.3])
    expected = -curvature * (1 + slope**2) ** -1.5
    np.testing.assert_allclose(LENGTH.residual(0.0, slope, curvature, 0.0), expected, rtol=1e-14)


def test_first_variation_is_the_integral_of_the_left_hand_side():
    # y'' enters, and x by name: every term of the total derivative is used
    functional = EulerLagrange(lambda y, slope, x: y * slope**2 + ca.exp(x) * slope + x * y**2)
    curve = Curve.parametric(lambda s: (s, np.sin(s)), 1.0)

    def phi(x):
        return x * (1 - x), 1 - 2 * x

    step = 1e-4
    measured = (
        curve.varied(step, phi).functional(functional) - curve.varied(-step, phi).functional(functional)
    ) / (2 * step)
    residual = functional.residual(curve.y, curve.slope, -np.sin(curve.x), curve.x)
    # central differences of a cubic in epsilon are right to step^2
    assert measured == pytest.approx(float(curve.weights @ (residual * phi(curve.x)[0])), abs=1e-8)


def test_first_integral_is_energy_for_an_oscillator():
    action = EulerLagrange(lambda y, slope, x: 0.5 * slope**2 - 0.5 * y**2)
    x = np.linspace(0.0, 6.0, 30)
    first_integral = action.first_integral(np.cos(x), -np.sin(x), x)
    np.testing.assert_allclose(first_integral, -0.5, rtol=1e-14)
    assert np.max(np.abs(action.residual(np.cos(x), -np.sin(x), -np.cos(x), x))) < 1e-15


def test_length_of_a_quarter_circle_is_right_though_its_slope_is_infinite_at_the_end():
    quarter = Curve.parametric(lambda a: (np.sin(a), np.cos(a)), np.pi / 2)
    assert quarter.functional(LENGTH) == pytest.approx(
        np.pi / 2, rel=1e-13
    )  # Gauss's rule, smooth in the angle


def test_shortest_polygon_is_straight():
    x = np.array([0.0, 0.3, 0.5, 1.2, 2.0])
    bent = 1.0 - 0.75 * x + np.sin(np.pi * x / 2)
    y, length = best_polygon(
        lambda dx, upper, lower: ca.sqrt(dx**2 + (lower - upper) ** 2), x, 1.0, -0.5, bent
    )
    assert length == pytest.approx(2.5, rel=1e-12)
    np.testing.assert_allclose(y, 1.0 - 0.75 * x, atol=1e-9)  # of IPOPT's tolerance, 1e-11, by the curvature


def test_least_surface_of_revolution_is_a_catenary():
    # two equal rings, cosh(1/2) in radius and one apart; the first guess is a cylinder
    x = np.linspace(-0.5, 0.5, 201)

    def surface(dx, left, right):
        return np.pi * (left + right) * ca.sqrt(dx**2 + (right - left) ** 2)

    y, _ = best_polygon(surface, x, np.cosh(0.5), np.cosh(0.5))
    np.testing.assert_allclose(y, np.cosh(x), atol=1e-5)  # second order in steps of 1/200


def test_guess_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r"guess of a polygon has shape \(2,\), and \(3,\) is needed"):
        best_polygon(lambda dx, left, right: dx, [0.0, 0.5, 1.0], 0.0, 1.0, [0.0, 1.0])


@pytest.mark.parametrize("x", [[0.0, 1.0], [0.0, 1.0, 0.5]])
def test_abscissae_that_do_not_increase_are_refused(x):
    with pytest.raises(ValueError, match="must be three or more and increase"):
        best_polygon(lambda dx, left, right: dx, x, 0.0, 1.0)
