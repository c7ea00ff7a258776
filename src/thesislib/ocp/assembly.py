"""Sparse matrices whose nonzeros are linear in the nonzeros of small matrices."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import scipy.sparse as sp

from thesislib.ocp.quadrature import Array

Part = tuple[np.ndarray, np.ndarray, Array, np.ndarray, int]


def assemble(shape: tuple[int, int], parts: list[Part], constant: sp.coo_array) -> Callable[[ca.MX], ca.MX]:
    """Return the map from stacked source nonzeros to a sparse matrix.

    Parameters
    ----------
    shape : (int, int)
        Shape of the matrix.
    parts : list of (rows, columns, factors, sources, length)
        Each adds factor * source nonzero at (row, column); the sources of the parts are
        stacked in order, each part's of the given length.
    constant : scipy.sparse array
        Added as it is.

    Returns
    -------
    callable
        From a dense MX column of all source nonzeros to the sparse MX matrix.
    """
    rows = np.concatenate([*(part[0].ravel() for part in parts), constant.coords[0]])
    columns = np.concatenate([*(part[1].ravel() for part in parts), constant.coords[1]])
    places, target = np.unique(columns.astype(np.int64) * shape[0] + rows, return_inverse=True)
    column_of, row_of = np.divmod(places, shape[0])
    column_start = np.searchsorted(column_of, np.arange(shape[1] + 1))
    sparsity = ca.Sparsity(shape[0], shape[1], column_start.tolist(), row_of.tolist())
    offsets = np.cumsum([0, *(part[4] for part in parts)])
    sources = np.concatenate(
        [part[3].ravel() + offset for part, offset in zip(parts, offsets[:-1], strict=True)]
    )
    factors = np.concatenate([part[2].ravel() for part in parts])
    varying = len(sources)
    scatter = sp.csc_array((factors, (target[:varying], sources)), shape=(len(places), int(offsets[-1])))
    fixed = np.bincount(target[varying:], weights=constant.data, minlength=len(places))
    scatter_dm, fixed_dm = ca.DM(scatter), ca.DM(fixed)

    def matrix(nonzeros: ca.MX) -> ca.MX:
        return ca.MX(sparsity, ca.mtimes(scatter_dm, nonzeros) + fixed_dm)

    return matrix


def stored(matrix: ca.MX) -> ca.MX:
    """Return the structural nonzeros of a sparse MX as a dense column."""
    return ca.vec(matrix.nz[:]) if matrix.nnz() else ca.MX(0, 1)


def selection(index: np.ndarray, length: int) -> sp.csc_array:
    """Return the matrix that adds entry k of a short vector to entry `index[k]` of a long one."""
    ones = np.ones(len(index))
    return sp.csc_array((ones, (index, np.arange(len(index)))), shape=(length, len(index)))
