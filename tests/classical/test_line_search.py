"""The step lengths satisfy the conditions they are named after."""

import numpy as np
import pytest

from thesislib.classical.line_search import armijo, wolfe


def test_armijo_takes_the_first_halving_that_lowers_the_value_enough():
    # phi(a) = (4 a - 1)^2 falls from 1 with slope -8; 1 and 1/2 overshoot to 9 and 1, 1/4 is the minimum
    assert armijo(lambda a: (4 * a - 1) ** 2, 1.0, -8.0) == 0.25


def test_armijo_refuses_a_direction_that_climbs():
    with pytest.raises(ArithmeticError, match=r"does not descend \(2\.16\)"):
        armijo(lambda a: a, 0.0, 1.0)


def test_armijo_gives_up_where_the_slope_is_a_lie():
    with pytest.raises(ArithmeticError, match="no step down to"):
        armijo(lambda a: a, 0.0, -1.0)


@pytest.mark.parametrize("scale", (1e-3, 1.0, 100.0))
def test_wolfe_step_is_neither_too_long_nor_too_short(scale):
    def value(a):
        return np.cosh(scale * a - 1.0)

    def slope(a):
        return scale * np.sinh(scale * a - 1.0)

    alpha = wolfe(value, slope, value(0.0), slope(0.0))
    assert value(alpha) <= value(0.0) + 1e-4 * alpha * slope(0.0)
    assert slope(alpha) >= 0.9 * slope(0.0)


def test_wolfe_gives_up_on_a_line_without_end():
    with pytest.raises(ArithmeticError, match="100 bisections"):
        wolfe(lambda a: -a, lambda a: -1.0, 0.0, -1.0)


def test_wolfe_refuses_a_direction_that_climbs():
    with pytest.raises(ArithmeticError, match="does not descend"):
        wolfe(lambda a: a, lambda a: 1.0, 0.0, 1.0)
