"""Factors of saddle-point matrices against dense arithmetic."""

import numpy as np
import pytest
import scipy.sparse as sp

from thesislib import ocp
from thesislib.ocp.factors import Factors


def saddle(block: np.ndarray, rows: np.ndarray, slack: np.ndarray) -> sp.csc_array:
    return sp.csc_array(np.block([[block, rows.T], [rows, -np.diag(slack)]]))


@pytest.fixture
def parts():
    random = np.random.default_rng(3)
    square = random.normal(size=(30, 30))
    return square @ square.T, random.normal(size=(12, 30)), random.normal(size=42)


def test_solution_is_that_of_dense_elimination(parts) -> None:
    block, rows, right = parts
    matrix = saddle(block, rows, np.zeros(12))
    # of a condition number of 1e5, sixteen digits leave eleven
    np.testing.assert_allclose(
        Factors(matrix, 30).solve(right), np.linalg.solve(matrix.toarray(), right), rtol=1e-9, atol=1e-9
    )


def test_active_and_idle_bounds_twenty_decades_apart_leave_the_solution_exact(parts) -> None:
    block, rows, _ = parts
    stiff = np.ones(30)
    stiff[::3] = 1e11  # held at a bound
    idle = np.where(np.arange(12) % 2, 1e14, 0.0)  # constraints that hold nothing
    matrix = saddle(block + np.diag(stiff), rows, idle)
    expected = np.random.default_rng(4).normal(size=42)
    expected[:30][::3] *= 1e-11
    expected[30:][1::2] *= 1e-14
    found = Factors(matrix, 30).solve(matrix @ expected)
    size = np.where(expected == 0.0, 1.0, np.abs(expected))
    # the right-hand side itself is rounded by sixteen digits of its largest term
    assert np.abs((found - expected) / size).max() < 1e-8


def test_block_that_is_indefinite_is_solved_all_the_same(parts) -> None:
    block, rows, right = parts
    matrix = saddle(block - 20.0 * np.eye(30), rows, np.zeros(12))
    assert np.linalg.eigvalsh(block - 20.0 * np.eye(30)).min() < -10.0
    np.testing.assert_allclose(matrix @ Factors(matrix, 30).solve(right), right, atol=1e-9)


def test_several_right_hand_sides_share_one_factorisation(parts) -> None:
    block, rows, right = parts
    factors = Factors(saddle(block, rows, np.zeros(12)), 30)
    factors.solve(right)
    factors.solve(-right)
    assert len(factors.kept) == 1


def test_constraints_that_depend_on_each_other_are_refused(parts) -> None:
    block, rows, right = parts
    rows[5] = rows[4]
    with pytest.raises(ocp.ProblemError, match="first-order system is singular"):
        Factors(saddle(block, rows, np.zeros(12)), 30).solve(right)
