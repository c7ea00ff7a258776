"""QDLDL in the place of IPOPT's linear solver: its factors, its optima, and what happens without it."""

import ctypes
import logging
import threading

import numpy as np
import pytest
import qdldl

from thesislib import ocp
from thesislib.ocp import compilation, ipopt, linear_solver
from thesislib.ocp.ldl import SHIFT, Ldl, routines

GUESS = {"theta": 0.5, "t_final": 1.0}


@pytest.fixture(autouse=True)
def available():
    """QDLDL as IPOPT's solver, as on the lock's machines; tests of its absence take it away themselves."""
    assert compilation.find_compiler(), "these tests need a C compiler: install one, or run the rest"
    assert linear_solver.linear_solver(1) is not None


def saddle_point(seed=0, n=60, m=25, weight=1.0):
    """A matrix [[A, Bᵀ], [B, 0]] in triplets of its lower triangle, some of them twice, and whole."""
    rng = np.random.default_rng(seed)
    a = rng.standard_normal((n, n)) * (rng.random((n, n)) < 0.1)
    b = rng.standard_normal((m, n)) * (rng.random((m, n)) < 0.2)
    b[:, :m] += 3.0 * np.eye(m)
    upper_left = a + a.T + weight * np.eye(n)
    whole = np.block([[upper_left, b.T], [b, np.zeros((m, m))]])
    rows, columns = np.nonzero(np.tril(whole))
    values = whole[rows, columns]
    # every third value in two parts, the second in the other triangle
    twice = np.arange(0, len(rows), 3)
    values[twice] *= 0.25
    rows, columns = np.concatenate((rows, columns[twice])), np.concatenate((columns, rows[twice]))
    return rows, columns, np.concatenate((values, 3.0 * values[twice])), whole


@pytest.mark.parametrize("weight", [8.0, 1.0, -4.0])
def test_factors_have_the_inertia_of_the_matrix_whether_it_is_that_of_a_minimum_or_not(weight):
    for seed in range(5):
        rows, columns, values, whole = saddle_point(seed, weight=weight)
        factors = Ldl(routines(), len(whole), rows, columns, 25)
        assert factors.factorise(values) == int((np.linalg.eigvalsh(whole) < 0.0).sum())


def test_refined_solutions_are_those_of_the_matrix_that_was_not_shifted():
    rows, columns, values, whole = saddle_point()
    factors = Ldl(routines(), len(whole), rows, columns, 25)
    factors.factorise(values)
    right = np.arange(1.0, len(whole) + 1.0)
    found = factors.solve(right)
    # the shift moves the solution by its size times the inverse's; two refinements square that twice
    for _ in range(2):
        found += factors.solve(right - whole @ found)
    exact = np.linalg.solve(whole, right)
    assert np.abs(found - exact).max() <= 1e-11 * np.abs(exact).max()


def test_factors_of_one_pattern_take_new_values():
    rows, columns, values, whole = saddle_point()
    factors = Ldl(routines(), len(whole), rows, columns, 25)
    assert factors.factorise(values) == factors.factorise(3.0 * values)
    right = np.ones(len(whole))
    # to the shift's effect: 1e-8 times an inverse of about ten
    assert np.allclose(3.0 * (whole @ factors.solve(right)), right, atol=1e3 * SHIFT)


def test_matrix_with_a_zero_pivot_has_no_factors():
    factors = Ldl(routines(), 2, np.array([0, 1, 1]), np.array([0, 0, 1]), 1)
    assert factors.factorise(np.array([0.0, 1.0, 0.0]), shift=0.0) is None
    assert factors.factorise(np.array([np.nan, 1.0, 0.0])) is None


def test_optimum_is_that_of_mumps_in_about_as_many_iterations(brachistochrone):
    found = {
        solver: ocp.solve(brachistochrone(), GUESS, tolerance=1e-8, linear_solver=solver)
        for solver in ("mumps", "ldl")
    }
    # both are IPOPT's at 1e-8, and an objective is a hundred times as good as its variables
    assert found["ldl"].objective == pytest.approx(found["mumps"].objective, rel=1e-9)
    iterations = [sum(mesh.iterations for mesh in each.history) for each in found.values()]
    # a matrix of nearly wrong inertia may be judged one way or the other, which costs some steps
    assert max(iterations) <= 1.5 * min(iterations)


def test_large_programmes_use_qdldl_and_small_ones_mumps(brachistochrone, monkeypatch):
    asked = []
    monkeypatch.setattr(ipopt, "linear_solver", lambda rows: asked.append(rows))
    ocp.solve(brachistochrone(), GUESS, tolerance=1e-3)
    assert asked == []
    monkeypatch.setattr(ipopt, "LARGE", 100)
    ocp.solve(brachistochrone(), GUESS, tolerance=1e-3)
    assert asked


def test_solve_that_gets_stuck_is_done_again_with_mumps(brachistochrone, monkeypatch, caplog):
    monkeypatch.setattr(Ldl, "solve", lambda self, right: np.zeros_like(right))
    with caplog.at_level(logging.INFO):
        found = ocp.solve(brachistochrone(), GUESS, tolerance=1e-6, linear_solver="ldl")
    assert "again with MUMPS" in caplog.text
    assert found.objective == pytest.approx(
        0.82433866944, rel=1e-6
    )  # known to eleven digits; the mesh's 1e-6


def test_what_goes_wrong_inside_ipopt_is_raised_after_it(brachistochrone, monkeypatch):
    def interrupted(self, values, shift=SHIFT):
        raise KeyboardInterrupt

    monkeypatch.setattr(Ldl, "factorise", interrupted)
    with pytest.raises(KeyboardInterrupt):
        ocp.solve(brachistochrone(), GUESS, linear_solver="ldl")
    monkeypatch.undo()
    assert ocp.solve(brachistochrone(), GUESS, tolerance=1e-3, linear_solver="ldl").converged


def test_solver_in_use_is_not_given_to_another_solve():
    with linear_solver.linear_solver(1):
        seen = []
        other = threading.Thread(target=lambda: seen.append(linear_solver.linear_solver(1)))
        other.start()
        other.join()
        assert seen == [None]
        assert linear_solver.linear_solver(1) is None
    assert linear_solver.linear_solver(1) is not None


def test_unknown_linear_solver_is_refused():
    with pytest.raises(ocp.ProblemError, match="linear_solver = 'ma57' is not one of auto, mumps, ldl"):
        ocp.Settings(linear_solver="ma57")


def test_without_a_compiler_mumps_is_used_and_qdldl_refused(brachistochrone, monkeypatch):
    monkeypatch.setenv("THESIS_COMPILE", "0")
    monkeypatch.setattr(ipopt, "LARGE", 0)
    assert ocp.solve(brachistochrone(), GUESS, tolerance=1e-3).converged
    with pytest.raises(ocp.ProblemError, match="needs a C compiler"):
        ocp.solve(brachistochrone(), GUESS, linear_solver="ldl")


def test_module_without_the_c_functions_is_no_solver(monkeypatch):
    monkeypatch.setattr(qdldl, "__file__", ctypes.__file__)  # a file that is no library
    routines.cache_clear()
    try:
        assert routines() is None
    finally:
        routines.cache_clear()
