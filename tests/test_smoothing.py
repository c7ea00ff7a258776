"""Claims about the smooth stand-ins of section 2.8.1."""

import casadi
import numpy as np
import pytest

from thesislib.smoothing import smooth_absolute, smooth_maximum, smooth_minimum

X = np.linspace(-5.0, 5.0, 1001)
EPSILON = 1e-4


def test_maximum_is_never_below_the_true_one_and_misses_it_most_at_the_corner():
    excess = smooth_maximum(X, EPSILON, floor=1.0) - np.maximum(X, 1.0)
    assert np.all(excess > 0.0)
    assert X[np.argmax(excess)] == pytest.approx(1.0)
    assert excess.max() == pytest.approx(np.sqrt(EPSILON) / 2, rel=1e-12)


def test_minimum_is_the_mirror_image_of_the_maximum():
    np.testing.assert_array_equal(smooth_minimum(X, EPSILON), -smooth_maximum(-X, EPSILON))
    assert np.all(smooth_minimum(X, EPSILON, ceiling=2.0) < np.minimum(X, 2.0))


def test_maximum_and_minimum_add_up_to_their_arguments():
    total = smooth_maximum(X, EPSILON, floor=0.7) + smooth_minimum(X, EPSILON, ceiling=0.7)
    np.testing.assert_allclose(total, X + 0.7, atol=1e-14)


def test_derivative_of_the_maximum_is_that_of_equation_2_166():
    x = casadi.SX.sym("x")
    slope = casadi.Function("slope", [x], [casadi.jacobian(smooth_maximum(x, EPSILON), x)])
    for value in (-0.3, 0.0, 0.02):
        printed = 0.5 * (value / np.sqrt(value**2 + EPSILON) + 1)
        assert float(slope(value)) == pytest.approx(printed, rel=1e-14)


def test_absolute_value_is_rounded_at_zero_only():
    assert smooth_absolute(0.0, EPSILON) == pytest.approx(0.01)
    np.testing.assert_allclose(
        smooth_absolute(X[np.abs(X) > 1], EPSILON), np.abs(X[np.abs(X) > 1]), atol=5e-5
    )


@pytest.mark.parametrize("epsilon", [0.0, -1e-6, float("nan")])
def test_a_corner_without_width_is_refused(epsilon):
    with pytest.raises(ValueError, match="not positive"):
        smooth_maximum(1.0, epsilon)
