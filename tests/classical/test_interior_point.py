"""The interior-point method against analytic solutions, and the barrier problem against IPOPT."""

import casadi as ca
import numpy as np
import pytest

from thesislib.classical.interior_point import (
    barrier_matrix,
    central_point,
    interior_point,
    primal_dual_matrix,
)
from thesislib.classical.ipopt import ipopt
from thesislib.classical.programme import NotConvergedError, Programme


@pytest.mark.parametrize("start", ([2.0, 2.0], [0.0, 0.0], [-3.0, 5.0]))
def test_analytic_optimum_is_found(hs14, start):
    found = interior_point(hs14, start)
    # 1e-8: what a barrier of 1e-9 shifts, by mu = 1.8 and a Jacobian near one
    assert hs14.value(found.x) == pytest.approx(9 - 23 * np.sqrt(7) / 8, abs=1e-8)
    np.testing.assert_allclose(found.x, [(np.sqrt(7) - 1) / 2, (np.sqrt(7) + 1) / 4], atol=1e-8)


@pytest.mark.parametrize("start", ([1.0, 5.0, 5.0, 1.0], [3.0, 3.0, 3.0, 3.0]))
def test_point_and_multipliers_agree_with_ipopt(hs71, start):
    found, peer = interior_point(hs71, start, tolerance=1e-9), ipopt(hs71, start, tolerance=1e-10)
    np.testing.assert_allclose(found.x, peer.x, atol=1e-7)
    np.testing.assert_allclose(found.lam, peer.lam, atol=1e-7)
    np.testing.assert_allclose(found.mu, peer.mu, atol=1e-7)


def test_slacks_and_multipliers_stay_positive(hs71):
    found = interior_point(hs71, [1.0, 5.0, 5.0, 1.0])
    assert found.slacks.min() > 0
    assert found.multipliers.min() > 0
    assert np.all(np.diff(found.barriers) <= 0)


def test_central_point_of_a_bounded_line_is_that_by_hand():
    # minimise x with x >= 0: 1 - mu = 0 and mu x = gamma
    line = Programme(lambda x: x[0], 1, inequalities=lambda x: [-x[0]])
    x, _, mu = central_point(line, [3.0], 0.01)
    assert x == pytest.approx([0.01], abs=1e-12)
    assert mu == pytest.approx([1.0], abs=1e-12)


def test_central_point_minimises_the_barrier_problem(hs14):
    gamma = 0.02
    barrier = Programme(
        lambda x: hs14.objective(x) - gamma * ca.log(-hs14.inequalities(x)[0]), 2, hs14.equalities
    )
    peer = ipopt(barrier, [0.5, 0.7], tolerance=1e-11)
    x, lam, mu = central_point(hs14, [0.5, 0.7], gamma)
    np.testing.assert_allclose(x, peer.x, atol=1e-9)
    np.testing.assert_allclose(lam, peer.lam, atol=1e-9)
    # the sign of the multiplier that (2.30c) has and the text after (2.32) has not
    np.testing.assert_allclose(mu, -gamma / hs14.constraints(peer.x)[1], rtol=1e-8)


def test_distance_of_the_central_path_is_proportional_to_the_barrier(hs14):
    optimum = np.array([(np.sqrt(7) - 1) / 2, (np.sqrt(7) + 1) / 4])
    errors = [
        np.linalg.norm(central_point(hs14, [0.5, 0.7], gamma)[0] - optimum) for gamma in (1e-4, 1e-5, 1e-6)
    ]
    # second order in gamma is 1e-4 of the first here
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=1e-3)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=1e-3)


def test_matrices_are_the_jacobians_of_their_conditions(hs71):
    x, lam, mu = np.array([1.3, 4.5, 3.9, 1.5]), np.array([0.2]), np.linspace(0.1, 0.9, 9)
    gamma, n, step = 0.3, 4, 1e-6

    def perturbed(z):
        x, lam, mu = z[:n], z[n : n + 1], z[n + 1 :]
        df, g, dg, h, dh = hs71.first_order(x)
        return np.concatenate((df + dg @ lam + dh @ mu, g, mu * h + gamma))

    def barrier(z):
        df, g, dg, h, dh = hs71.first_order(z[:n])
        return np.concatenate((df - gamma * dh @ (1 / h) + dg @ z[n:], g))

    for conditions, matrix, z in (
        (perturbed, primal_dual_matrix(hs71, x, lam, mu), np.concatenate((x, lam, mu))),
        (barrier, barrier_matrix(hs71, x, lam, gamma), np.concatenate((x, lam))),
    ):
        columns = [(conditions(z + step * e) - conditions(z - step * e)) / (2 * step) for e in np.eye(z.size)]
        # second derivatives of the barrier near the bounds are a few hundred: error step^2 of them
        np.testing.assert_allclose(matrix, np.array(columns).T, atol=1e-6)


def test_contradictory_constraints_are_named():
    nowhere = Programme(lambda x: x[0] ** 2, 1, inequalities=lambda x: [x[0] - 1, 2 - x[0]], name="nowhere")
    with pytest.raises(
        NotConvergedError, match=r"nowhere: .* grow without bound; .* inequality \(2\.22c\) 2"
    ):
        interior_point(nowhere, [0.0])


def test_unbounded_programme_does_not_converge():
    slope = Programme(lambda x: x[0], 1, inequalities=lambda x: [x[0] - 1], name="slope")
    with pytest.raises(
        NotConvergedError, match=r"slope: the interior-point method stopped: the iterates grow"
    ):
        interior_point(slope, [0.5])


def test_too_few_iterations_raise(hs71):
    with pytest.raises(NotConvergedError, match="2 iterations are over; the most violated condition is"):
        interior_point(hs71, [1.0, 5.0, 5.0, 1.0], most=2)


def test_barrier_that_is_not_positive_is_refused(hs14):
    with pytest.raises(ValueError, match="gamma = 0 has to be positive"):
        interior_point(hs14, [0.0, 0.0], gamma=0.0)
    with pytest.raises(ValueError, match="gamma = -1 has to be positive"):
        central_point(hs14, [0.0, 0.0], -1.0)
