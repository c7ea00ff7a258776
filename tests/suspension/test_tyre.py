"""Claims about the loaded radius of the tyre, (3.18)."""

import casadi
import numpy as np
import pytest

from thesislib.suspension.tyre import force_at_radius, loaded_radius, vertical_stiffness


def test_radius_is_that_of_figure_3_5():
    # by hand: 326 - 4e-3 * 6000 + 4.075e-8 * 36e6 = 303.467 mm
    assert loaded_radius(0.0) == 0.326
    assert loaded_radius(-6000.0) == pytest.approx(0.303467, abs=1e-12)


def test_unloaded_tyre_has_250_kilonewtons_per_metre():
    assert vertical_stiffness(0.0) == pytest.approx(250e3)


def test_stiffness_is_the_slope_of_the_radius():
    slope = (loaded_radius(-3000.0 + 1e-3) - loaded_radius(-3000.0 - 1e-3)) / 2e-3
    assert 1.0 / slope == pytest.approx(vertical_stiffness(-3000.0), rel=1e-8)  # cancellation of 1e-9 m


def test_force_is_the_inverse_of_the_radius():
    F = np.linspace(-12e3, 0.0, 50)
    np.testing.assert_allclose(force_at_radius(loaded_radius(F), xp=np), F, atol=1e-9)


def test_tyre_that_has_left_the_road_carries_nothing():
    assert force_at_radius(0.330, xp=np) == 0.0


def test_rigid_tyre_keeps_its_radius():
    np.testing.assert_array_equal(loaded_radius(np.array([0.0, -5000.0]), rigid=True), 0.326)


def test_casadi_and_numpy_give_the_same_force():
    R = casadi.SX.sym("R")
    force = casadi.Function("F", [R], [force_at_radius(R, xp=casadi)])
    assert float(force(0.31)) == pytest.approx(float(force_at_radius(0.31, xp=np)), rel=1e-14)
