"""Sequential quadratic programming against analytic solutions and IPOPT."""

import numpy as np
import pytest

from thesislib.classical.descent import convergence_order
from thesislib.classical.ipopt import ipopt
from thesislib.classical.programme import NotConvergedError, Programme
from thesislib.classical.sqp import newton_kkt_step, sqp


@pytest.mark.parametrize("start", ([2.0, 2.0], [0.0, 0.0], [-3.0, 5.0]))
def test_analytic_optimum_is_found(hs14, start):
    found = sqp(hs14, start)
    assert hs14.value(found.x) == pytest.approx(9 - 23 * np.sqrt(7) / 8, abs=1e-8)
    np.testing.assert_allclose(found.x, [(np.sqrt(7) - 1) / 2, (np.sqrt(7) + 1) / 4], atol=1e-8)


@pytest.mark.parametrize("start", ([1.0, 5.0, 5.0, 1.0], [3.0, 3.0, 3.0, 3.0]))
def test_point_and_multipliers_agree_with_ipopt(hs71, start):
    found, peer = sqp(hs71, start), ipopt(hs71, start, tolerance=1e-10)
    # 1e-7: IPOPT's barrier, 1e-11, over the smallest active multiplier and its conditioning
    np.testing.assert_allclose(found.x, peer.x, atol=1e-7)
    np.testing.assert_allclose(found.lam, peer.lam, atol=1e-7)
    np.testing.assert_allclose(found.mu, peer.mu, atol=1e-7)
    assert found.residuals[-1] <= 1e-8
    assert hs71.value(found.x) == pytest.approx(17.0140173, abs=5e-8)  # Hock and Schittkowski print seven


def test_first_step_of_sqp_is_that_of_newton_where_there_is_no_inequality():
    parabola = Programme(lambda x: (x[0] - 2) ** 4 + (x[1] - 1) ** 2, 2, lambda x: [x[0] ** 2 - x[1]])
    found = sqp(parabola, [2.5, 6.0])
    p, _ = newton_kkt_step(parabola, found.points[0], np.zeros(1))
    np.testing.assert_allclose(found.points[1], found.points[0] + p, atol=1e-9)


def test_newton_step_solves_the_system_of_the_thesis():
    circle = Programme(lambda x: x[0] + x[1], 2, lambda x: [x[0] ** 2 + x[1] ** 2 - 2], name="circle")
    x, lam = np.array([-1.1, -0.8]), np.array([0.4])
    p, after = newton_kkt_step(circle, x, lam)
    df, g, dg, _, _ = circle.first_order(x)
    np.testing.assert_allclose(circle.hessian(x, lam) @ p + dg @ after, -df, atol=1e-14)
    np.testing.assert_allclose(dg.T @ p, -g, atol=1e-14)


def test_newton_on_the_kkt_conditions_converges_quadratically():
    circle = Programme(lambda x: x[0] + x[1], 2, lambda x: [x[0] ** 2 + x[1] ** 2 - 2])
    x, lam, errors = np.array([-1.2, -0.7]), np.array([0.3]), []
    for _ in range(4):
        errors.append(np.hypot(*(x + 1)) + abs(lam[0] - 0.5))
        p, lam = newton_kkt_step(circle, x, lam)
        x = x + p
    # the errors are 0.6, 1e-1 .. 1e-5: the first is still outside the region where the square rules
    assert convergence_order(errors) == pytest.approx(2.0, abs=0.35)


def test_solution_without_active_constraint_has_no_multiplier(hs71):
    bowl = Programme(lambda x: (x[0] - 1) ** 2 + x[1] ** 2, 2, inequalities=lambda x: [x[0] + x[1] - 9])
    found = sqp(bowl, [4.0, 4.0])
    np.testing.assert_allclose(found.x, [1.0, 0.0], atol=1e-12)
    assert found.mu == pytest.approx([0.0], abs=1e-12)


def test_contradictory_constraints_are_named():
    nowhere = Programme(lambda x: x[0] ** 2, 1, inequalities=lambda x: [x[0] - 1, 2 - x[0]], name="nowhere")
    with pytest.raises(NotConvergedError, match=r"nowhere: .* has no solution; .* \(2\.22c\) 2, by 2 where"):
        sqp(nowhere, [0.0])


def test_unbounded_programme_does_not_converge():
    slope = Programme(lambda x: x[0], 1, inequalities=lambda x: [x[0] - 1], name="slope")
    with pytest.raises(
        NotConvergedError, match=r"slope: .* stationarity \(2\.22a\), component 1, by 1 where"
    ):
        sqp(slope, [0.5], most=20)


def test_too_few_iterations_raise(hs71):
    with pytest.raises(NotConvergedError, match="SQP stopped after 2 iterations"):
        sqp(hs71, [1.0, 5.0, 5.0, 1.0], most=2)
