"""The control-rate regularisation (2.171) as a quadratic form on the mesh."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise


def rate_penalty(pointwise: Pointwise, mesh: Mesh, point_index: np.ndarray, variables: int) -> sp.csc_array:
    """Return Q such that the regulariser is half of xᵀQx.

    Each control û with weight ε contributes ε/2 ∫ (dû/dŝ)² dŝ, with first differences
    between neighbouring collocation points; û is the scaled control and ŝ the independent
    variable in units of its scale, or the fraction of the range where the end is free.

    Parameters
    ----------
    pointwise : Pointwise
        Brings the problem.
    mesh : Mesh
        The mesh, N collocation points.
    point_index : ndarray of int, shape (n_z, N)
        Variable of every state and control at every point.
    variables : int
        Number of variables.

    Returns
    -------
    scipy.sparse array, shape (variables, variables)
    """
    problem = pointwise.problem
    gaps = np.diff(mesh.collocation)
    pairs = np.column_stack((np.arange(mesh.points - 1), np.arange(1, mesh.points)))
    if problem.states and len(problem.periodic) == len(problem.states):
        gaps = np.append(gaps, 1.0 - mesh.collocation[-1] + mesh.collocation[0])
        pairs = np.vstack((pairs, (mesh.points - 1, 0)))
    if not problem.independent.is_free:
        _, span = pointwise.range(np.empty(0))
        gaps = gaps * float(span) / problem.independent.scale
    total = sp.csc_array((variables, variables))
    for j, control in enumerate(problem.controls):
        if control.rate_weight == 0:
            continue
        places = point_index[len(problem.states) + j][pairs]
        rows = np.repeat(np.arange(len(pairs)), 2)
        signs = np.tile([-1.0, 1.0], len(pairs))
        difference = sp.csr_array((signs, (rows, places.ravel())), shape=(len(pairs), variables))
        total = total + difference.T @ sp.diags_array(control.rate_weight / gaps) @ difference
    penalty = sp.csc_array(total)
    penalty.sort_indices()  # a product's indices are unsorted, which CasADi does not take
    return penalty
