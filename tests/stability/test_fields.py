"""The rational field in slip coordinates."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from thesislib.stability.ascent import scaling
from thesislib.stability.fields import TIME_UNIT, ExactCar, decimal


def field_rates(field, z):
    """Return dz/dt in 1/s."""
    n_1, n_2, d = field.floats
    return np.array([n_1(*z), n_2(*z)]) / d(*z) / float(TIME_UNIT)


@pytest.mark.parametrize("delta_deg", [0.0, 4.0])
def test_the_field_is_the_car_in_other_coordinates(car, delta_deg):
    turning = replace(car, u_0=12.0, delta=np.radians(delta_deg))
    to_state, trim = scaling(turning.matrix), turning.trim()
    field = ExactCar.at_trim(turning).field
    for z in ([0.3, -0.2], [-0.7, 0.4], [0.05, 0.6]):
        expected = np.linalg.solve(to_state, turning.rates(trim + to_state @ z))
        # the trim of the field is rounded to 40 binary digits
        assert np.allclose(field_rates(field, z), expected, rtol=1e-8, atol=1e-8)


def test_the_rounded_trim_in_a_corner_is_an_equilibrium_exactly(car):
    exact = ExactCar.at_trim(replace(car, u_0=12.0, delta=0.07))
    assert all((0, 0) not in n.support for n in exact.field.n)
    assert abs(exact.delta - Fraction(7, 100)) < 1e-9
    assert abs(exact.rear_factor - 1) < 1e-9


def test_an_accelerating_car_s_slips_change_with_its_speed(car):
    """Differences of (v + a omega)/u along a motion with changing u."""
    a_x, u, z = 2.0, car.u_0, np.array([0.4, -0.3])
    exact = ExactCar.at_trim(car, factors=(0.95, 1.05), acceleration=a_x)
    x = scaling(car.matrix) @ z
    loaded = replace(
        car,
        front=replace(car.front, numerator=tuple(0.95 * c for c in car.front.numerator)),
        rear=replace(car.rear, numerator=tuple(1.05 * c for c in car.rear.numerator)),
    )
    x_dot, step = loaded.rates(x), 1e-6

    def slips(t):
        return np.array([[1, car.a], [1, -car.b]]) @ (x + t * x_dot) / (u + t * a_x)

    expected = (slips(step) - slips(-step)) / (2 * step)
    assert np.allclose(field_rates(exact.field, z) * 0.25, expected, rtol=1e-7)


def test_what_has_no_rational_field_is_refused(car, magic):
    with pytest.raises(TypeError, match="needs RationalTyre axles, not MagicFormula"):
        ExactCar.at_trim(magic)
    with pytest.raises(ValueError, match="linear slip angles"):
        ExactCar.at_trim(replace(car, slip="arctan"))
    with pytest.raises(ValueError, match="move the equilibrium of a car in a corner"):
        ExactCar.at_trim(replace(car, u_0=10.0, delta=0.05), acceleration=1.0)


def test_a_float_is_read_as_it_is_written():
    assert decimal(1.2) == Fraction(6, 5)


def test_a_car_held_at_any_slips_is_in_equilibrium_exactly(exact):
    held = replace(exact, front_moment=(Fraction(40), Fraction(-900)), scale=Fraction(1, 16)).held_at(
        0.05, -0.11
    )
    n_1, n_2 = held.field.n
    assert n_1.coefficients[0, 0] == 0 and n_2.coefficients[0, 0] == 0
    assert any(held.forcing)


def test_an_axle_s_own_moment_and_the_forcing_act_as_newton_says(car, exact):
    moment = (Fraction(40), Fraction(-900))
    held = replace(exact, front_moment=moment).held_at(0.05, -0.11)
    z = np.array([0.1, -0.3])
    alpha = np.array([0.05, -0.11]) + 0.25 * z
    xi = alpha + np.array([float(held.delta), 0.0])
    M_f = np.polynomial.polynomial.polyval(alpha[0], [40.0, -900.0]) / np.polynomial.polynomial.polyval(
        alpha[0], car.front.denominator
    )
    side, yaw = map(float, held.forcing)
    state = car.from_slip(xi)
    F_f, F_r = car.front.force(alpha[0]), car.rear.force(alpha[1])
    v_dot = (F_f + F_r - side) / car.mass - car.u_0 * state[1]
    omega_dot = (car.a * F_f - car.b * F_r + M_f - yaw) / car.I_z
    expected = car.to_slip([v_dot, omega_dot]) / 0.25
    # the trim is rounded to 40 binary digits
    assert np.allclose(field_rates(held.field, z), expected, rtol=1e-8, atol=1e-8)
