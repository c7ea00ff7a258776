"""Sparse nonlinear programmes, and several of them joined by what holds between their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np
import scipy.sparse as sp

from thesislib.ocp.assembly import Part, assemble, selection, stored
from thesislib.ocp.endpoints import EndFunctions
from thesislib.ocp.quadrature import Array


@dataclass(frozen=True)
class Programme:
    """A nonlinear programme as CasADi functions of (variables, parameters).

    Attributes
    ----------
    nlp : dict
        Symbols `x`, `p` and expressions `f`, `g`.
    derivatives : dict
        Functions `grad_f`, `jac_g`, `hess_lag` in the form `casadi.nlpsol` takes; the first two
        also return the values of objective and constraints.
    lower, upper : ndarray, shape (n,)
        Bounds of the variables.
    rows_lower, rows_upper : ndarray, shape (m,)
        Bounds of the constraints.
    """

    nlp: dict[str, ca.MX]
    derivatives: dict[str, ca.Function]
    lower: Array
    upper: Array
    rows_lower: Array
    rows_upper: Array


def functions(
    x: ca.MX, p: ca.MX, first: tuple[ca.MX, ca.MX, ca.MX, ca.MX], second: tuple[ca.MX, ca.MX, ca.MX]
) -> dict[str, ca.Function]:
    """Return the derivative functions of a programme.

    Parameters
    ----------
    x, p : casadi.MX
        Variables and parameters.
    first : (casadi.MX, casadi.MX, casadi.MX, casadi.MX)
        Objective, its gradient, constraints, their Jacobian.
    second : (casadi.MX, casadi.MX, casadi.MX)
        Multiplier of the objective, multipliers of the constraints, and the upper triangle of the
        Lagrangian's Hessian.
    """
    f, gradient, g, jacobian = first
    lam_f, lam_g, hessian = second
    return {
        "grad_f": ca.Function("nlp_grad_f", [x, p], [f, gradient], ["x", "p"], ["f", "grad_f_x"]),
        "jac_g": ca.Function("nlp_jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        "hess_lag": ca.Function(
            "nlp_hess_l",
            [x, p, lam_f, lam_g],
            [hessian],
            ["x", "p", "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
    }


def end_hessian_part(hessian: ca.MX, index: np.ndarray) -> Part:
    """Return where the nonzeros of an end function's Hessian go in that of the programme.

    Parameters
    ----------
    hessian : casadi.MX
        Upper triangle with respect to the end values.
    index : ndarray of int
        Variable of every end value.
    """
    k, m = (np.array(part, dtype=int) for part in hessian.sparsity().get_triplet())
    k_index, m_index = index[k], index[m]
    # a periodic state is one variable at both ends: its off-diagonal term counts twice
    doubled = 1.0 + ((k != m) & (k_index == m_index))
    return np.minimum(k_index, m_index), np.maximum(k_index, m_index), doubled, np.arange(len(k)), len(k)


def end_jacobian_part(ends: EndFunctions, rows: np.ndarray, index: np.ndarray) -> Part:
    """Return where the nonzeros of the end conditions' Jacobian go in that of the programme."""
    triplet = ends.conditions_jacobian.sparsity_out(0).get_triplet()
    row, column = (np.array(part, dtype=int) for part in triplet)
    return rows[row], index[column], np.ones(len(row)), np.arange(len(row)), len(row)


@dataclass(frozen=True, eq=False)
class Joint:
    """What holds between the ends of several programmes.

    Attributes
    ----------
    functions : EndFunctions
        Cost and conditions of the ends of all programmes, in order.
    ends : ndarray of int
        The variable of every end value among the joined variables.
    constants : ndarray of int
        The place of every constant among the joined parameters.
    lower, upper : ndarray
        Bounds of the conditions.
    """

    functions: EndFunctions
    ends: np.ndarray
    constants: np.ndarray
    lower: Array
    upper: Array


def joined(programmes: Sequence[Programme], joint: Joint) -> Programme:
    """Return one programme of several: variables and constraints in order, the joint conditions last."""
    sizes = [len(programme.lower) for programme in programmes]
    rows = [len(programme.rows_lower) for programme in programmes]
    parameters = [programme.derivatives["grad_f"].size1_in(1) for programme in programmes]
    variables, above = sum(sizes), sum(rows)
    x, p = ca.MX.sym("x", variables), ca.MX.sym("p", sum(parameters))
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", above + joint.functions.count)
    arguments = list(zip(_cut(x, sizes), _cut(p, parameters), strict=True))
    ends, constants = x[joint.ends.tolist()], p[joint.constants.tolist()]
    at_each = list(zip(programmes, arguments, strict=True))
    f = joint.functions.cost(ends, constants)
    for programme, at in at_each:
        f += _expression(programme, "f")(*at)
    gradient = ca.vertcat(*(programme.derivatives["grad_f"](*at)[1] for programme, at in at_each))
    gradient += ca.mtimes(
        ca.DM(selection(joint.ends, variables)), joint.functions.cost_gradient(ends, constants)
    )
    conditions = joint.functions.conditions(ends, constants)
    g = ca.densify(ca.vertcat(*(_expression(programme, "g")(*at) for programme, at in at_each), conditions))
    below = assemble(
        (joint.functions.count, variables),
        [end_jacobian_part(joint.functions, np.arange(joint.functions.count), joint.ends)],
        sp.coo_array((joint.functions.count, variables)),
    )
    jacobian = ca.vertcat(
        ca.diagcat(*(programme.derivatives["jac_g"](*at)[1] for programme, at in at_each)),
        below(stored(joint.functions.conditions_jacobian(ends, constants))),
    )
    multipliers = _cut(lam_g, [*rows, joint.functions.count])
    curvature = joint.functions.hessian(ends, constants, lam_f, multipliers[-1])
    between = assemble(
        (variables, variables),
        [end_hessian_part(curvature, joint.ends)],
        sp.coo_array((variables, variables)),
    )
    hessian = ca.diagcat(
        *(
            programme.derivatives["hess_lag"](*at, lam_f, lam)
            for (programme, at), lam in zip(at_each, multipliers[:-1], strict=True)
        )
    ) + between(stored(curvature))
    derivatives = functions(x, p, (f, ca.densify(gradient), g, jacobian), (lam_f, lam_g, hessian))
    return Programme(
        {"x": x, "p": p, "f": f, "g": g},
        derivatives,
        np.concatenate([programme.lower for programme in programmes]),
        np.concatenate([programme.upper for programme in programmes]),
        np.concatenate([*(programme.rows_lower for programme in programmes), joint.lower]),
        np.concatenate([*(programme.rows_upper for programme in programmes), joint.upper]),
    )


def _expression(programme: Programme, name: str) -> ca.Function:
    """Return the objective or the constraints of a programme as a function of its own."""
    nlp = programme.nlp
    return ca.Function(name, [nlp["x"], nlp["p"]], [nlp[name]])


def _cut(column: ca.MX, lengths: Sequence[int]) -> list[ca.MX]:
    """Cut a column into parts of the given lengths."""
    offsets = np.concatenate(([0], np.cumsum(lengths))).tolist()
    return [column[low:high] for low, high in pairwise(offsets)]


def recombined(programme: Programme, matrix: sp.csc_array) -> Programme:
    """Return the programme whose constraints are combinations of another one's.

    Parameters
    ----------
    programme : Programme
        The programme; what is combined must be equations.
    matrix : scipy.sparse array, shape (m, m)
        Regular; constraints that are no equations keep their rows.

    Returns
    -------
    Programme
        With the constraints `matrix @ g`. Its multipliers λ' belong to λ = matrixᵀ λ'.
    """
    by, back = ca.DM(matrix), ca.DM(sp.csc_array(matrix.T))
    x, p = programme.nlp["x"], programme.nlp["p"]
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", matrix.shape[0])
    f, gradient = programme.derivatives["grad_f"](x, p)
    g, jacobian = programme.derivatives["jac_g"](x, p)
    hessian = programme.derivatives["hess_lag"](x, p, lam_f, ca.mtimes(back, lam_g))
    combined = ca.densify(ca.mtimes(by, programme.nlp["g"]))
    first = (f, gradient, ca.densify(ca.mtimes(by, g)), ca.mtimes(by, jacobian))
    return Programme(
        {"x": x, "p": p, "f": programme.nlp["f"], "g": combined},
        functions(x, p, first, (lam_f, lam_g, hessian)),
        programme.lower,
        programme.upper,
        programme.rows_lower,
        programme.rows_upper,
    )
