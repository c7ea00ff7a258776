"""Every way gives the derivative by hand, each with the error that theory predicts."""

import numpy as np
import pytest

from thesislib.classical.derivatives import (
    Dual,
    automatic,
    central_difference,
    complex_step,
    forward_difference,
)

CASES = {
    "power": (lambda x: x**4.5, lambda x: 4.5 * x**3.5),
    "quotient": (lambda x: (2 - x) / (1 + x * x), lambda x: (x * x - 4 * x - 1) / (1 + x * x) ** 2),
    "reciprocal": (lambda x: 3 / x - 1, lambda x: -3 / x**2),
    "waves": (lambda x: np.sin(x) * np.cos(x), lambda x: np.cos(2 * x)),
    "growth": (lambda x: np.exp(x) * np.log(x), lambda x: np.exp(x) * (np.log(x) + 1 / x)),
    "tyre": (
        lambda x: np.sin(1.9 * np.arctan(0.7 * x)),
        lambda x: np.cos(1.9 * np.arctan(0.7 * x)) * 1.9 * 0.7 / (1 + 0.49 * x * x),
    ),
    "root": (lambda x: np.sqrt(1 + x), lambda x: 0.5 / np.sqrt(1 + x)),
}


@pytest.mark.parametrize("name", CASES)
def test_automatic_and_complex_derivatives_are_exact_to_rounding(name):
    f, derivative = CASES[name]
    # a dozen operations, each rounded
    assert automatic(f, 1.3) == pytest.approx(derivative(1.3), rel=3e-15)
    assert complex_step(f, 1.3, 1e-30) == pytest.approx(derivative(1.3), rel=3e-15)


@pytest.mark.parametrize("name", CASES)
def test_differences_have_their_orders(name):
    f, derivative = CASES[name]
    for way, order in ((forward_difference, 1), (central_difference, 2), (complex_step, 2)):
        errors = [abs(way(f, 1.3, step) - derivative(1.3)) for step in (1e-2, 1e-3)]
        # next order of the series: a few per cent at these steps
        assert np.log10(errors[0] / errors[1]) == pytest.approx(order, abs=0.05)


def test_forward_difference_of_a_small_step_is_lost_to_cancellation():
    f, derivative = CASES["growth"]
    assert abs(forward_difference(f, 1.3, 1e-14) / derivative(1.3) - 1) > 1e-4


def test_value_of_a_dual_number_is_the_functions():
    f, _ = CASES["quotient"]
    assert f(Dual(0.4, 1.0)).value == pytest.approx(f(0.4), rel=1e-15)


@pytest.mark.parametrize("way", (forward_difference, central_difference, complex_step))
def test_step_of_no_length_is_refused(way):
    with pytest.raises(ValueError, match="step = 0 has to be positive"):
        way(np.sin, 1.0, 0.0)
