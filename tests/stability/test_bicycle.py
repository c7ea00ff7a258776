"""The single-track car: its equations, equilibria and linear theory."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib.stability.bicycle import Bicycle, linear_theory


def test_jacobian_is_the_derivative_of_the_rates(magic):
    car = replace(magic, slip="arctan", delta=0.05)
    x, step = np.array([0.7, -0.2]), 1e-6
    differences = [(car.rates(x + e) - car.rates(x - e)) / (2 * step) for e in step * np.eye(2)]
    # central differences of step 1e-6 lose ten digits of rates of the order of 10
    assert np.allclose(car.jacobian(x), np.transpose(differences), rtol=1e-7, atol=1e-7)


def test_jacobian_at_rest_is_the_matrix_7_34(magic):
    C_f, C_r, M, u = magic.front.slope(0.0), magic.rear.slope(0.0), magic.mass, magic.u_0
    moment = magic.a * C_f - magic.b * C_r
    printed = [
        [(C_f + C_r) / (M * u), moment / (M * u) - u],
        [moment / (magic.I_z * u), (magic.a**2 * C_f + magic.b**2 * C_r) / (magic.I_z * u)],
    ]
    assert np.allclose(magic.jacobian(np.zeros(2)), printed, rtol=1e-13)


def test_determinant_7_36_is_that_of_7_34(magic):
    determinant = np.linalg.det(magic.jacobian(np.zeros(2))) * magic.mass * magic.I_z * magic.u_0**2
    assert linear_theory(magic).determinant == pytest.approx(determinant, rel=1e-12)


def test_slip_angle_7_9_equals_7_7(magic):
    car = replace(magic, slip="arctan", delta=0.1)
    v, w, u, a, d = 1.5, 0.3, car.u_0, car.a, car.delta
    across = np.cos(d) * (w * a + v) - np.sin(d) * u
    along = np.cos(d) * u + np.sin(d) * (w * a + v)
    assert car.slip_angles(car.to_slip([v, w]))[0] == pytest.approx(np.arctan(across / along), rel=1e-14)


def test_this_car_always_understeers(magic):
    for change in ({}, {"u_0": 40.0}, {"mass": 1700.0}, {"rear": magic.rear.scaled(peak=0.9)}):
        theory = linear_theory(replace(magic, **change))
        assert theory.understeer > 0
        assert theory.determinant > 0


def test_equilibria_mirror_each_other_and_are_at_rest(car):
    points = car.equilibria()
    assert len(points) == 3
    assert np.allclose(points, -points[::-1], atol=1e-9)
    assert np.abs(car.rates(points)).max() < 1e-9


def test_saddle_of_the_magic_formula_is_where_an_independent_search_found_it(magic):
    assert magic.equilibria()[-1] == pytest.approx([3.100732, -0.377069], abs=1e-6)


def test_a_car_that_cannot_hold_its_steering_angle_says_so(car):
    with pytest.raises(ValueError, match=r"no stable equilibrium at u_0 = 30 m/s and delta = 4"):
        replace(car, u_0=30.0, delta=np.radians(4.0)).trim()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"mass": 0.0}, "mass = 0 of the single-track car is not positive"),
        ({"delta": 0.6}, "delta = 0.6 rad is outside -0.5 .. 0.5"),
        ({"slip": "none"}, "slip = 'none' is not one of linear, arctan"),
    ],
)
def test_bad_numbers_are_refused(car, change, said):
    with pytest.raises(ValueError, match=said):
        replace(car, **change)


def test_values_out_of_range_are_refused():
    with pytest.raises(ValueError, match=r"u_0 = 100 m/s is outside 5 \.\. 60"):
        Bicycle.from_file(u_0=100.0)
