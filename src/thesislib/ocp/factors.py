"""Factors of a large symmetric saddle-point matrix, and solutions as exact as the matrix allows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import qdldl
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from thesislib.ocp.problem import ProblemError
from thesislib.ocp.quadrature import Array

# Passes of symmetric scaling. The stiffness of active bounds and the slack of idle constraints span twenty
# decades; after three passes the largest entry of every row is near one.
PASSES = 3

# What is added to the scaled diagonal, with the sign of its block. Of a lap's matrix, with 135,000 unknowns,
# 1e-8 takes five refinements, 1e-6 and 1e-10 a dozen, and 1e-12 never gets there.
SHIFTS = (1e-8, 1e-6)

# The residual, relative to the terms of the equations, at which refinement ends; and what is accepted. It
# is also compared with the right-hand side: what solves a singular system is so large that any residual is
# small beside it.
REFINED, ACCEPTED, MEANT = 1e-15, 1e-11, 1e-6
REFINEMENTS = 20

_Approximate = Callable[[Array], Array]


class Factors:
    """Factors of [[A, Bᵀ], [B, -C]] with symmetric A and C, C positive semidefinite.

    The matrix is scaled, moved a little towards a quasi-definite one, which has factors L D Lᵀ in any
    ordering and thus in one that keeps them sparse, and factorised by QDLDL. Every solution is then refined
    with the matrix as it is. Where that does not converge, it is factorised with pivoting, by SuperLU.

    Parameters
    ----------
    matrix : scipy.sparse array, shape (n + m, n + m)
        Symmetric.
    leading : int
        Size n of A.
    """

    def __init__(self, matrix: sp.csc_array, leading: int) -> None:
        self.scale = np.ones(matrix.shape[0])
        self.scaled = sp.csc_array(matrix)
        for _ in range(PASSES):
            largest = abs(self.scaled).max(axis=0).toarray().ravel()
            step = 1.0 / np.sqrt(np.where(largest > 0.0, largest, 1.0))
            self.scale *= step
            self.scaled = sp.csc_array(sp.diags_array(step) @ self.scaled @ sp.diags_array(step))
        self.size = abs(self.scaled)
        self.signs = np.where(np.arange(len(self.scale)) < leading, 1.0, -1.0)
        self.kept: list[_Approximate] = []

    def solve(self, right: Array) -> Array:
        """Return the solution for one right-hand side.

        Raises
        ------
        ProblemError
            If no factors give one: the matrix is singular.
        """
        scaled = self.scale * right
        for place in range(len(SHIFTS) + 1):
            if place == len(self.kept):
                self.kept.append(self._factorised(place))
            found, error = self._refined(self.kept[place], scaled)
            missed = float(np.abs(scaled - self.scaled @ found).max())
            if error <= ACCEPTED and missed <= MEANT * float(np.abs(scaled).max()):
                return np.asarray(self.scale * found)
        raise ProblemError(
            "the first-order system is singular: the solution is not an isolated one, or has constraints "
            "that depend on each other"
        )

    def _factorised(self, place: int) -> _Approximate:
        if place < len(SHIFTS):
            shifted = self.scaled + sp.diags_array(SHIFTS[place] * self.signs)
            return qdldl.Solver(sp.csc_matrix(sp.triu(shifted, format="csc")), upper=True).solve
        try:
            return splu(self.scaled).solve
        except RuntimeError:  # SuperLU found a pivot of exactly zero
            return np.zeros_like

    def _refined(self, approximate: _Approximate, right: Array) -> tuple[Array, float]:
        """Return a solution and its residual, relative to the largest term of the equations."""
        found, error = np.zeros_like(right), np.inf
        best = found
        for _ in range(REFINEMENTS):
            with np.errstate(all="ignore"):
                residual = right - self.scaled @ found
                terms = np.abs(right) + self.size @ np.abs(found)
                now = float(np.abs(residual).max() / max(float(terms.max()), np.finfo(float).tiny))
            if not now < error:  # also where it is not a number
                break
            best, error = found, now
            if error <= REFINED:
                break
            found = found + np.asarray(approximate(residual))
        return best, error
