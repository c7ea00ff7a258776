"""Claims about the moving axle: that it rests, falls into step with equilibria, and vibrates as it should."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thesislib.suspension import WheelLoads
from thesislib.suspension.dynamics import DynamicAxle, sprung_share
from thesislib.suspension.mechanism import ConvergenceError
from thesislib.suspension.tyre import vertical_stiffness
from thesislib.suspension.verification import rates_in_closed_form


@pytest.fixture(scope="module")
def body_mass(axle, at_rest):
    return sprung_share(axle, at_rest)


@pytest.fixture(scope="module")
def moving(axle, body_mass):
    return DynamicAxle(axle, body_mass, 0.12 * body_mass)


def test_body_and_wheels_weigh_what_the_tyres_carry(axle, at_rest, body_mass):
    assert (body_mass + 2 * axle.carrier_mass) * 9.80665 == pytest.approx(-2 * at_rest)


def test_axle_under_constant_unequal_loads_stays_where_it_is(moving):
    still = moving.replay(np.linspace(0.0, 1.0, 5), np.full(5, -3500.0), np.full(5, -2000.0))
    # the statics of the reduced axle are those of the equations of motion to rounding
    np.testing.assert_allclose(still.height_difference, 0.0, atol=1e-9)
    np.testing.assert_allclose(still.roll_difference, 0.0, atol=1e-9)
    np.testing.assert_allclose(still.tyre_forces, np.tile([-3500.0, -2000.0], (5, 1)), atol=1e-2)


def test_slow_change_of_load_follows_the_equilibria(moving, at_rest):
    t = np.linspace(0.0, 40.0, 401)
    share = 0.5 - 0.5 * np.cos(np.pi * t / 40.0)
    slow = moving.replay(t, at_rest * (1 + share), at_rest * (1 + 0.5 * share))
    # forty seconds against a fifth of a second of a period: inertia is five orders below the spring forces
    assert np.abs(slow.height_difference).max() < 1e-5
    assert np.ptp(slow.height) > 1e-3


def test_replay_is_what_another_integrator_finds(moving, at_rest):
    t = np.array([0.0, 0.05, 0.1, 0.3])
    F_l, F_r = at_rest * np.array([1.0, 1.0, 2.0, 1.5]), at_rest * np.array([1.0, 1.3, 1.3, 1.3])
    loads = WheelLoads.of(F_l, F_r)
    rest = moving.reduced.solve(loads)
    P, N = moving.wrench(rest, loads)

    def motion(at, x):
        return np.asarray(moving.rates(x, np.interp(at, t, P), np.interp(at, t, N))[0]).ravel()

    start = moving.state(rest)[0]
    other = solve_ivp(motion, (0.0, 0.3), start, "DOP853", t, rtol=1e-10, atol=1e-12, max_step=0.01).y
    found = moving.replay(t, F_l, F_r)
    np.testing.assert_allclose(found.roll, other[1], atol=1e-7)  # ten times the tolerance of the replay
    np.testing.assert_allclose(found.travel, other[2:4].T, atol=1e-7)
    assert np.abs(found.height_difference).max() > 1e-4  # it does move


def test_energy_is_kept_without_dampers(axle, body_mass):
    free = DynamicAxle(replace(axle, heave_damping=0.0, rocker_damping=0.0), body_mass, 0.12 * body_mass)
    # an axle without dampers has no real part in its eigenvalues
    modes = free.modes(-2500.0)
    assert np.all(np.abs(modes.real) < 1e-6 * np.abs(modes.imag))


def test_dampers_damp_every_mode(moving, at_rest):
    assert np.all(moving.modes(at_rest).real < 0.0)


def test_heave_frequency_is_that_of_springs_and_tyres_in_series(moving, axle, at_rest, body_mass):
    rate = rates_in_closed_form(axle, at_rest).heave
    tyre = vertical_stiffness(at_rest)
    in_series = 2.0 * rate * tyre / (rate + tyre)
    frequency = min(abs(one) for one in moving.modes(at_rest))
    # the wheels' own mass takes part in the motion by the tyres' share of it
    assert frequency == pytest.approx(np.sqrt(in_series / body_mass), rel=0.06)


@pytest.mark.parametrize(("t", "loads"), [([0.0, 1.0, 1.0], 3), ([0.0], 1), ([0.0, 1.0], 3)])
def test_history_without_increasing_times_is_refused(moving, t, loads):
    with pytest.raises(ValueError, match="A load history needs increasing times"):
        moving.replay(t, np.full(loads, -1e3), np.full(loads, -1e3))


def test_history_beyond_the_travel_is_refused(moving):
    with pytest.raises(ConvergenceError, match="no equilibrium"):
        moving.replay([0.0, 1.0], [-1e3, -9e4], [-1e3, -1e3])


@pytest.mark.parametrize("values", [(0.0, 10.0), (200.0, -1.0)])
def test_body_without_mass_or_inertia_is_refused(axle, values):
    with pytest.raises(ValueError, match=r"(body_mass|roll_inertia) = .* must be above zero"):
        DynamicAxle(axle, *values)
