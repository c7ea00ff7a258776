"""Claims about the 26 equations of section 3.2."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from thesislib.suspension import WheelLoads
from thesislib.suspension.mechanism import (
    UNKNOWNS,
    ConvergenceError,
    Mechanism,
    rotation,
    turned,
    wheel_angles,
    wheel_down,
)
from thesislib.suspension.verification import balances


def number(expression):
    return np.asarray(ca.evalf(ca.DM(expression) if isinstance(expression, ca.DM) else expression))


def test_rotation_of_the_carrier_is_the_product_of_the_three_printed_matrices():
    phi, theta, psi = 0.3, -0.2, 0.5
    about = [
        Rotation.from_euler(axis, angle).as_matrix()
        for axis, angle in zip("zxy", (psi, phi, theta), strict=True)
    ]
    np.testing.assert_allclose(
        number(rotation(ca.SX([phi, theta, psi]))), about[0] @ about[1] @ about[2], atol=1e-15
    )


def test_rocker_turns_about_its_axis():
    axis, arm = np.array([0.6, 0.0, 0.8]), np.array([0.1, -0.2, 0.05])
    expected = Rotation.from_rotvec(0.4 * axis).apply(arm)
    np.testing.assert_allclose(number(turned(axis, ca.SX(0.4), arm)).ravel(), expected, atol=1e-16)


def test_contact_lies_below_the_wheel_in_its_plane():
    spindle = np.array([0.1, 0.97, 0.2]) / np.linalg.norm([0.1, 0.97, 0.2])
    down = number(wheel_down(ca.SX(spindle))).ravel()
    assert down @ spindle == pytest.approx(0.0, abs=1e-15)
    assert np.linalg.norm(down) == pytest.approx(1.0, abs=1e-15)
    assert down[2] == pytest.approx(np.sqrt(1.0 - spindle[2] ** 2), abs=1e-15)  # as low as the plane allows


def test_wheel_that_leans_and_points_has_the_angles_of_its_rotation():
    camber, toe = wheel_angles(Rotation.from_euler("ZX", [0.03, 0.02]).apply([[0.0, 1.0, 0.0]]))
    assert camber[0] == pytest.approx(0.02, abs=1e-15)
    assert toe[0] == pytest.approx(0.03, abs=1e-15)


def test_there_are_26_equations_for_26_unknowns_of_one_size(mechanism, at_rest, axle):
    equations = mechanism.equations
    assert equations.size1_in(0) == equations.size1_out(0) == UNKNOWNS == 26
    x = ca.SX.sym("x", UNKNOWNS)
    given = [0, 0, at_rest, 0, 0, at_rest, *6 * [0], 0.32, 0.32, 0]
    given += [axle.heave_stiffness, axle.torsion_stiffness, axle.anti_roll_stiffness]
    jacobian = ca.Function("J", [x], [ca.jacobian(equations(x, given)[0], x)])
    # the unscaled equations are at several millions; more than a thousand would mean that a scale is wrong
    assert np.linalg.cond(np.asarray(jacobian(np.zeros(UNKNOWNS)))) < 1e3


def test_car_stands_at_rest_as_designed(mechanism, at_rest, nominal):
    solution = mechanism.solve(WheelLoads.of(at_rest, at_rest))
    assert solution.height[0] == pytest.approx(nominal, abs=1e-8)  # the file's preload has eight decimals
    np.testing.assert_allclose(solution.displacement, 0.0, atol=1e-8)
    assert solution.roll[0] == pytest.approx(0.0, abs=1e-14)


def test_every_body_is_in_balance_and_every_link_as_long_as_before(mechanism, axle, loads):
    found = balances(axle, loads, mechanism.solve(loads))
    # Newton stops at 1e-8 of a kN, of 0.1 kN m and of a mm; forces are of the order of kN
    assert found.force < 1e-4
    assert found.moment < 1e-4
    assert found.torque < 1e-4
    assert found.length < 1e-10


def test_balance_holds_with_steer_horizontal_forces_and_moments(mechanism, axle, forces):
    F_l, F_r = forces
    loads = WheelLoads.of(
        F_l,
        F_r,
        left=(0.4 * F_l, 1.3 * F_l),
        right=(0.4 * F_r, 1.3 * F_r),
        left_moment=(5.0, -20.0, 60.0),
        right_moment=(0.0, 10.0, -40.0),
        steer=0.6,
    )
    found = balances(axle, loads, mechanism.solve(loads))
    assert max(found.force, found.moment, found.torque) < 1e-4
    assert found.length < 1e-10


def test_pinion_steers_both_front_wheels_to_the_same_side(front):
    steered = Mechanism(front).solve(WheelLoads.of(-1500.0, -1500.0, steer=0.3))
    assert np.all(np.abs(steered.toe) > np.radians(1.0))
    assert np.sign(steered.toe[0, 0]) == np.sign(steered.toe[0, 1])


def test_mirrored_loads_mirror_the_car(mechanism, forces):
    F_l, F_r = forces
    here, mirrored = mechanism.solve(WheelLoads.of(F_l, F_r)), mechanism.solve(WheelLoads.of(F_r, F_l))
    np.testing.assert_allclose(mirrored.height, here.height, rtol=0, atol=1e-13)  # 1e-10 mm
    np.testing.assert_allclose(mirrored.roll, -here.roll, rtol=0, atol=1e-13)
    np.testing.assert_allclose(mirrored.rod_forces, here.rod_forces[:, ::-1], rtol=0, atol=1e-6)


def test_large_mesh_has_the_solutions_that_its_cases_have_alone(mechanism, heaviest):
    F_l, F_r = np.meshgrid(np.linspace(0.0, heaviest, 26), np.linspace(0.0, heaviest, 26))
    mesh = mechanism.solve(WheelLoads.of(F_l, F_r))
    few = slice(None, None, 97)
    alone = mechanism.solve(WheelLoads.of(F_l.ravel()[few], F_r.ravel()[few]))
    # both end at a residual of 1e-8 mm at most
    np.testing.assert_allclose(mesh.height[few], alone.height, rtol=0, atol=1e-10)


def test_heave_stiffness_of_each_case_is_its_own(mechanism, axle, at_rest):
    load = 2.0 * at_rest
    both = mechanism.solve(WheelLoads.of([load, load], [load, load]), heave_stiffness=[4e5, 9e5])
    for K_h, height in zip((4e5, 9e5), both.height, strict=True):
        alone = Mechanism(axle.with_springs(heave_stiffness=K_h)).solve(WheelLoads.of(load, load))
        assert height == pytest.approx(alone.height[0], abs=1e-12)


def test_rigid_tyre_takes_the_squash_out_of_the_ride_height(mechanism, at_rest):
    loads = WheelLoads.of(at_rest, at_rest)
    soft, rigid = mechanism.solve(loads), mechanism.solve(loads, rigid_tyre=True)
    squash = 0.326 - (0.326 + 4.00e-6 * at_rest + 4.075e-11 * at_rest**2)
    # the wheel stands upright to a tenth of a degree, so that squash and height agree to 1e-6 of it
    assert soft.height[0] - rigid.height[0] == pytest.approx(squash, rel=1e-5)


def test_load_that_no_spring_can_hold_is_refused_with_its_place(mechanism):
    with pytest.raises(ConvergenceError, match=r"load cases were not solved|past its dead centre"):
        mechanism.solve(WheelLoads.of(-4e5, -1e3))


def test_spring_without_stiffness_is_refused(mechanism):
    with pytest.raises(ValueError, match="heave_stiffness = 0 N/m must be above zero"):
        mechanism.solve(WheelLoads.of([-1e3, -2e3], -1e3), heave_stiffness=[1e6, 0.0])
