"""Claims about the aerodynamic map of Table 4.1."""

import numpy as np
import pytest

from thesislib.vehicles import ParameterSet
from thesislib.vehicles.aerodynamics import AeroCoefficients, Attitude, aero_coefficients, aero_forces

LEVEL = {"phi_f": 0.0, "phi_r": 0.0, "beta": 0.0, "delta": 0.0}


@pytest.fixture(scope="module")
def p():
    return ParameterSet.union(
        "car", [ParameterSet.from_file("racing_car"), ParameterSet.from_file("racing_car_aerodynamics")]
    ).values


def test_coefficients_at_the_nominal_ride_heights_are_those_computed_by_hand(p):
    # 1.2 - 0.14 + 0.3705; 0.9494 - 0.014 + 1.646665 - 1.220180; 0.9455 - 0.0014 + 0.00741
    coefficients = aero_coefficients(Attitude(-0.014, -0.0741, **LEVEL), p)
    assert coefficients.C_L_front == pytest.approx(1.4305, abs=1e-12)
    assert coefficients.C_L_rear == pytest.approx(1.361885, abs=1e-6)
    assert pytest.approx(0.95151, abs=1e-12) == coefficients.C_D


def test_rear_downforce_is_largest_at_fifty_millimetres(p):
    h_r = np.linspace(-0.09, -0.02, 7001)
    rear = aero_coefficients(Attitude(-0.014, h_r, **LEVEL), p).C_L_rear
    assert h_r[np.argmax(rear)] == pytest.approx(-0.050, abs=1e-5)


def test_sixteen_degrees_of_side_slip_cost_0_4_front_and_0_8_rear(p):
    straight, slipping = (
        aero_coefficients(Attitude(-0.014, -0.0741, 0.0, 0.0, beta, 0.0), p)
        for beta in (0.0, np.radians(16.0))
    )
    assert straight.C_L_front - slipping.C_L_front == pytest.approx(0.4, abs=1e-4)
    assert straight.C_L_rear - slipping.C_L_rear == pytest.approx(0.8, abs=1e-4)


def test_every_angle_costs_downforce_and_its_sign_does_not_matter(p):
    base = aero_coefficients(Attitude(-0.014, -0.0741, **LEVEL), p)
    for name in LEVEL:
        left, right = (
            aero_coefficients(Attitude(-0.014, -0.0741, **{**LEVEL, name: angle}), p)
            for angle in (-0.03, 0.03)
        )
        assert vars(left) == vars(right)
        assert left.C_L_front + left.C_L_rear < base.C_L_front + base.C_L_rear
        assert left.C_D == base.C_D


def test_angles_taken_out_of_force_change_nothing(p):
    level, tilted = Attitude(-0.01, -0.06, **LEVEL), Attitude(-0.01, -0.06, 0.03, 0.03, 0.08, 0.1)
    assert aero_coefficients(tilted, p, angles=False) == aero_coefficients(level, p)


def test_forces_are_the_coefficients_times_dynamic_pressure_and_area(p):
    # 1/2 * 1.2 * 1.5 * 80^2 = 5760 N
    forces = aero_forces(80.0, AeroCoefficients(1.4, 1.3, 0.95), p)
    assert forces.F_az_front == pytest.approx(8064.0)
    assert forces.F_az_rear == pytest.approx(7488.0)
    assert forces.F_ax == pytest.approx(-5472.0)
