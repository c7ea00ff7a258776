"""Claims about the physics of a solved axle, and that the checks go red when the physics is broken."""

import numpy as np
import pytest

from thesislib.suspension import WheelLoads, verification
from thesislib.suspension.mechanism import Mechanism


def test_work_of_the_loads_is_the_energy_of_the_springs(mechanism, forces):
    # central differences of 1 N leave a relative error of 1e-8
    assert verification.virtual_work(mechanism, *forces) < 1e-6


def test_left_rises_with_the_right_load_as_right_with_the_left(mechanism, forces):
    # Maxwell and Betti; differences of 5 N leave 1e-7
    assert verification.reciprocity_by_differences(mechanism, *forces) < 1e-5


def test_wheel_rates_are_those_of_the_closed_form(mechanism, axle, at_rest):
    closed = verification.rates_in_closed_form(axle, at_rest)
    measured = verification.rates_by_differences(mechanism, at_rest)
    # the measured ones have the tyre's change of radius under 2 N in the contact point's motion
    np.testing.assert_allclose(measured, closed, rtol=1e-4)


def test_heave_rate_grows_with_the_heave_spring_alone(axle, at_rest):
    rates = [
        verification.rates_in_closed_form(axle.with_springs(heave_stiffness=K), at_rest) for K in (5e5, 1e6)
    ]
    assert rates[1].heave > rates[0].heave
    assert rates[1].roll == rates[0].roll


def test_balances_of_another_axle_are_out(mechanism, axle, loads):
    solution = mechanism.solve(loads)
    other = axle.with_springs(anti_roll_stiffness=1.01 * axle.anti_roll_stiffness)
    found = verification.balances(other, loads, solution)
    assert found.torque > 0.1
    assert found.force < 1e-4  # rods and tyres are as they were


def test_balances_of_other_loads_are_out(mechanism, axle, forces):
    F_l, F_r = forces
    solution = mechanism.solve(WheelLoads.of(F_l, F_r))
    found = verification.balances(axle, WheelLoads.of(F_l, F_r - 1.0), solution)
    assert found.force == pytest.approx(1.0, abs=1e-3)


def test_energy_of_another_axle_is_not_the_work(axle, forces):
    class WithOtherSprings(Mechanism):
        """Solves one axle and is asked for the energy of another."""

        def solve(self, *given, **named):
            return Mechanism(axle).solve(*given, **named)

    wrong = WithOtherSprings(axle.with_springs(torsion_stiffness=1.01 * axle.torsion_stiffness))
    assert verification.virtual_work(wrong, *forces) > 1e-5
