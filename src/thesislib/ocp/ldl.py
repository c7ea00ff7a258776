"""Factors L D Lᵀ, without pivoting, of the linear systems of an interior point method."""

from __future__ import annotations

import ctypes
from functools import lru_cache

import numpy as np
import qdldl
import scipy.sparse as sp

from thesislib.ocp.quadrature import Array

Integers = np.ndarray

# What is added to the diagonal, with the sign of its block, for factors to exist in any ordering. Of a
# lap's systems, 1e-8 leaves a residual of 1e-11 after one refinement; 1e-10 takes five and loses to
# rounding where curvature and slack are both small, and 1e-11 has no correct digit there.
SHIFT = 1e-8


@lru_cache(maxsize=1)
def routines() -> ctypes.CDLL | None:
    """Return QDLDL and AMD as C functions, or None where they are not to be had.

    The Python package's own class keeps D, whose signs are the inertia, behind a copy of all factors. Its
    module exports the C functions too. They are tried on a system with a known solution before use.
    """
    try:
        library = ctypes.CDLL(qdldl.__file__)
        integer, pointer = ctypes.c_longlong, ctypes.c_void_p
        for name, pointers, answer in (
            ("amd_l_order", 5, ctypes.c_int),
            ("QDLDL_etree", 5, integer),
            ("QDLDL_factor", 13, integer),
            ("QDLDL_solve", 5, None),
        ):
            function = getattr(library, name)
            function.argtypes, function.restype = [integer, *[pointer] * pointers], answer
    except (OSError, AttributeError):
        return None
    # [[2, 1], [1, -3]] has one negative eigenvalue and takes (1, 2) to (4, -5)
    trial = Ldl(library, 2, np.array([0, 1, 1]), np.array([0, 0, 1]), 1)
    works = trial.factorise(np.array([2.0, 1.0, -3.0])) == 1
    found = trial.solve(np.array([4.0, -5.0]))
    return library if works and np.allclose(found, [1.0, 2.0], atol=1e-6) else None


class Ldl:
    """Factors of symmetric matrices of one pattern.

    Parameters
    ----------
    library : ctypes.CDLL
        `routines()`.
    size : int
        Number of rows.
    rows, columns : ndarray of int, shape (nz,)
        Places of the values, from zero, each in either triangle; values of the same place are added.
    multipliers : int
        How many of the last rows belong to multipliers: the matrix is to be positive on the others, once
        these are eliminated, for a step of the method to be one of descent.

    Raises
    ------
    ValueError
        If the pattern cannot be ordered.
    """

    def __init__(
        self, library: ctypes.CDLL, size: int, rows: Integers, columns: Integers, multipliers: int
    ) -> None:
        self.library, self.size, self.count = library, size, len(rows)
        every = np.arange(size)  # QDLDL wants every entry of the diagonal
        low = np.concatenate((np.minimum(rows, columns), every))
        high = np.concatenate((np.maximum(rows, columns), every))
        pattern = sp.csc_array((np.ones(len(low)), (low, high)), shape=(size, size))
        self.order = np.empty(size, dtype=np.int64)
        starts, places = pattern.indptr.astype(np.int64), pattern.indices.astype(np.int64)
        if library.amd_l_order(size, *_at(starts, places, self.order), None, None) < 0:
            raise ValueError(f"AMD cannot order a matrix of {size} rows and {pattern.nnz} entries")
        place = np.empty(size, dtype=np.int64)
        place[self.order] = every
        low, high = place[low], place[high]
        keys, inverse = np.unique(np.maximum(low, high) * size + np.minimum(low, high), return_inverse=True)
        self.where = inverse[: self.count].copy()
        self.rows = keys % size
        self.starts = np.searchsorted(keys, np.arange(size + 1) * size)
        self.diagonal = self.starts[1:] - 1
        self.signs = np.where(self.order < size - multipliers, 1.0, -1.0)
        self.tree, self.counts = np.empty(size, np.int64), np.empty(size, np.int64)
        self.integers, self.flags, self.floats = (
            np.empty(3 * size, np.int64),
            np.empty(size, np.int64),
            np.empty(size),
        )
        entries = library.QDLDL_etree(
            size, *_at(self.starts, self.rows, self.integers, self.counts, self.tree)
        )
        self.l_starts, self.l_rows, self.l_values = (
            np.empty(size + 1, np.int64),
            np.empty(entries, np.int64),
            np.empty(entries),
        )
        self.d, self.inverse_d = np.empty(size), np.empty(size)

    def factorise(self, values: Array, shift: float = SHIFT) -> int | None:
        """Factorise the matrix of given values, shifted.

        Parameters
        ----------
        values : ndarray, shape (nz,)
            In the order of `rows` and `columns`.
        shift : float
            What is added to the diagonal, and taken from it in the rows of multipliers.

        Returns
        -------
        int or None
            The number of negative eigenvalues, or None where there are no factors.
        """
        entries = np.bincount(self.where, weights=values, minlength=len(self.rows))
        entries[self.diagonal] = entries[self.diagonal] + shift * self.signs
        positive = self.library.QDLDL_factor(
            self.size,
            *_at(self.starts, self.rows, entries, self.l_starts, self.l_rows, self.l_values, self.d),
            *_at(self.inverse_d, self.counts, self.tree, self.flags, self.integers, self.floats),
        )
        if positive < 0 or not np.isfinite(self.d).all():
            return None
        return self.size - int(positive)

    def solve(self, right: Array) -> Array:
        """Return the solution for the shifted matrix; its refinement is the caller's."""
        found = np.ascontiguousarray(right[self.order])
        self.library.QDLDL_solve(
            self.size, *_at(self.l_starts, self.l_rows, self.l_values, self.inverse_d, found)
        )
        answer = np.empty(self.size)
        answer[self.order] = found
        return answer


def _at(*arrays: np.ndarray) -> list[int]:
    return [array.ctypes.data for array in arrays]
