"""Claims of appendix B about the tyre."""

import casadi
import numpy as np
import pytest

from thesislib.vehicles import ParameterSet
from thesislib.vehicles.tyres import peak_combined_slip, stiffness_factor, tyre_forces


@pytest.fixture(scope="module")
def p():
    return ParameterSet.from_file("racing_tyre", "tyres").values


def test_force_at_reference_load_and_peak_slip_is_the_one_computed_by_hand(p):
    # mu_x1 sin(1.9 atan(S)), S = pi/(2 atan 1.9) = 1.44598; sin = 0.96532; the floor under rho is 1e-6
    force = tyre_forces(2000.0, 0.11, 0.0, p)
    assert stiffness_factor(1.9) == pytest.approx(1.44598, abs=1e-5)
    assert force.F_x == pytest.approx(1.75 * 2000.0 * 0.96532, rel=1e-5)
    assert force.F_y == 0.0
    assert force.rho == pytest.approx(1.0, abs=1e-6)


def test_friction_falls_linearly_from_load_one_to_load_two_and_on(p):
    slip = {"kappa": 0.0, "p": p}
    peaks = []
    for load, alpha_deg in ((2000.0, 9.0), (4000.0, 8.5), (6000.0, 8.0), (8000.0, 7.5)):
        peaks.append(
            tyre_forces(load, alpha=np.radians(alpha_deg), **slip).mu_y / np.sin(1.9 * np.arctan(1.44598))
        )
    np.testing.assert_allclose(peaks, [1.80, 1.625, 1.45, 1.275], rtol=1e-5)


@pytest.mark.parametrize(("reading", "where"), [("printed", 0.7512), ("peak_at_one", 1.0)])
def test_friction_peak_lies_where_the_reading_of_the_shape_factor_puts_it(p, reading, where):
    kappa = np.linspace(0.02, 0.2, 200001)
    force = tyre_forces(2000.0, kappa, 0.0, p, reading)
    best = np.argmax(force.F_x)
    assert peak_combined_slip(1.9, reading) == pytest.approx(where, abs=5e-5)
    assert kappa[best] / 0.11 == pytest.approx(where, abs=1e-4)
    assert force.mu_x[best] == pytest.approx(1.75, rel=1e-9)


def test_tyre_without_a_peak_has_no_peak_slip():
    with pytest.raises(ValueError, match=r"Q = 0\.9 has no friction peak"):
        peak_combined_slip(0.9)


def test_force_opposes_the_sliding_of_the_contact_patch(p):
    kappa, alpha = np.meshgrid(np.linspace(-0.3, 0.3, 61), np.radians(np.linspace(-20.0, 20.0, 61)))
    force = tyre_forces(3000.0, kappa, alpha, p)
    # sliding velocity over u_w: -kappa forwards, tan(alpha) to the right
    dissipation = -(force.F_x * -kappa + force.F_y * np.tan(alpha))
    assert np.all(dissipation[(kappa != 0) | (alpha != 0)] > 0.0)
    assert np.all(dissipation >= 0.0)


def test_force_never_exceeds_the_larger_friction_coefficient_times_load(p):
    kappa, alpha = np.meshgrid(np.linspace(-0.3, 0.3, 101), np.radians(np.linspace(-20.0, 20.0, 101)))
    force = tyre_forces(2000.0, kappa, alpha, p)
    assert np.hypot(force.F_x, force.F_y).max() <= 1.80 * 2000.0 * (1 + 1e-12)


def test_side_slip_takes_longitudinal_force_away(p):
    pure, combined = (tyre_forces(2000.0, 0.05, np.radians(alpha), p).F_x for alpha in (0.0, 5.0))
    assert combined < 0.8 * pure


def test_reversed_slips_reverse_the_forces(p):
    forwards, backwards = tyre_forces(2500.0, 0.04, 0.07, p), tyre_forces(2500.0, -0.04, -0.07, p)
    assert (backwards.F_x, backwards.F_y) == (-forwards.F_x, -forwards.F_y)


def test_tyre_at_rest_in_its_slips_makes_no_force_and_has_a_stiffness(p):
    kappa = casadi.SX.sym("kappa")
    force = tyre_forces(2000.0, kappa, 0.0, p)
    stiffness = casadi.Function("stiffness", [kappa], [force.F_x, casadi.jacobian(force.F_x, kappa)])
    at_zero, slope = stiffness(0.0)
    assert float(at_zero) == 0.0
    # mu N Q S / kappa_max, the slope of the sine of the arc tangent at the origin
    assert float(slope) == pytest.approx(1.75 * 2000 * 1.9 * stiffness_factor(1.9) / 0.11, rel=1e-3)


@pytest.mark.parametrize(("load", "edge"), [(500.0, 2000.0), (9000.0, 6000.0)])
def test_a_tyre_held_within_its_data_grips_outside_them_as_at_their_end(p, load, edge):
    held = tyre_forces(load, 0.05, 0.08, p, load_range="held")
    there = tyre_forces(edge, 0.05, 0.08, p)
    # a corner rounded over 50 N leaves 0.4 N at 1500 N from it, and friction changes by 1e-4 a newton
    assert held.mu_x == pytest.approx(there.mu_x, rel=1e-4)
    assert held.rho == pytest.approx(there.rho, rel=1e-4)
    assert held.F_y / load == pytest.approx(there.F_y / edge, rel=1e-4)
    assert tyre_forces(load, 0.05, 0.08, p).mu_x != pytest.approx(there.mu_x, rel=0.05)


def test_a_tyre_held_within_its_data_is_the_same_inside_and_smooth_at_the_end(p):
    inside = tyre_forces(4000.0, 0.05, 0.08, p, load_range="held")
    assert inside.mu_y == pytest.approx(tyre_forces(4000.0, 0.05, 0.08, p).mu_y, rel=1e-4)
    load = casadi.SX.sym("load")
    force = tyre_forces(load, 0.05, 0.08, p, load_range="held").F_y
    curvature = casadi.Function("curvature", [load], [casadi.hessian(force, load)[0]])
    at = np.array([float(curvature(2000.0 + step)) for step in (-0.01, 0.0, 0.01)])
    np.testing.assert_allclose(at, at[1], rtol=1e-3)  # no jump where the corner is
