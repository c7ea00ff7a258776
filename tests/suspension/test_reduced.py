"""Claims about the axle in two unknowns: the 26 equations with their rod forces eliminated."""

import numpy as np
import pytest

from thesislib.suspension import WheelLoads
from thesislib.suspension.mechanism import ConvergenceError
from thesislib.suspension.reduced import ReducedAxle


@pytest.mark.parametrize("rigid", [False, True])
def test_two_unknowns_give_what_26_equations_give(reduced, mechanism, loads, rigid):
    fast, full = (one.solve(loads, rigid_tyre=rigid) for one in (reduced, mechanism))
    np.testing.assert_allclose(fast.height, full.height, rtol=0, atol=1e-7)  # the bar: 1e-4 mm
    np.testing.assert_allclose(fast.roll, full.roll, rtol=0, atol=1e-7)
    np.testing.assert_allclose(fast.travel, -full.displacement[:, :, 2], rtol=0, atol=1e-7)
    mirrored = full.rocker * [1.0, -1.0]  # the right rocker counts in the left one's mirrored axes
    np.testing.assert_allclose(fast.rocker, mirrored, rtol=0, atol=1e-6)


def test_agreement_holds_for_every_heave_stiffness(reduced, mechanism, axle, loads):
    K_h = axle.heave_stiffness * np.linspace(0.5, 1.5, len(loads))
    fast, full = (one.solve(loads, heave_stiffness=K_h) for one in (reduced, mechanism))
    np.testing.assert_allclose(fast.height, full.height, rtol=0, atol=1e-7)


def test_spring_derivatives_are_those_of_differences(reduced):
    alpha, step = (np.array([0.1]), np.array([-0.05])), 1e-5

    def length(left, right):
        return reduced.spring((alpha[0] + left, alpha[1] + right), 1e6).length[0]

    spring = reduced.spring(alpha, 1e6)
    gradient = [
        (length(step, 0) - length(-step, 0)) / (2 * step),
        (length(0, step) - length(0, -step)) / (2 * step),
    ]
    np.testing.assert_allclose([one[0] for one in spring.gradient], gradient, rtol=1e-8)
    mixed = (length(step, step) - length(step, -step) - length(-step, step) + length(-step, -step)) / (
        4 * step**2
    )
    assert spring.curvature[1][0] == pytest.approx(
        mixed, abs=2e-6
    )  # rounding of 1e-16 m over the squared step
    own = (length(step, 0) - 2 * length(0, 0) + length(-step, 0)) / step**2
    assert spring.curvature[0][0] == pytest.approx(own, abs=4e-6)


def test_without_couplings_each_wheel_minds_its_own_load(reduced, axle):
    alone = ReducedAxle(axle.with_springs(heave_stiffness=1e-3, anti_roll_stiffness=1e-6))
    heavier = alone.solve(WheelLoads.of([-1500.0, -1600.0], [-1700.0, -1700.0])).travel
    assert abs(heavier[1, 0] - heavier[0, 0]) > 1e-4
    assert heavier[1, 1] == pytest.approx(heavier[0, 1], abs=1e-8)


def test_horizontal_forces_are_left_to_the_26_equations(reduced):
    with pytest.raises(ValueError, match="takes vertical tyre forces alone"):
        reduced.solve(WheelLoads.of(-1e3, -1e3, left=(0.0, 100.0)))


def test_load_beyond_the_travel_is_refused_with_its_place(reduced):
    with pytest.raises(
        ConvergenceError, match=r"no equilibrium at wheel travels .* F_l = -90 kN, F_r = 0 kN"
    ):
        reduced.solve(WheelLoads.of([-1e3, -9e4], [-1e3, 0.0]))
