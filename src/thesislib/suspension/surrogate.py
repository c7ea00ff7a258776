"""Metamodels of one axle: polynomials that stand in for the suspension's equations (section 3.2.1).

A sweep solves the axle on a mesh of loads, and of heave stiffnesses if wanted; a fit turns the sweep into
two polynomials, ride height and roll angle, which know the box of inputs they were fitted on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thesislib.polynomials import basis_size, design_matrix, exponents, fit, monomials
from thesislib.suspension.axle import Axle
from thesislib.suspension.loads import WheelLoads
from thesislib.suspension.reduced import ReducedAxle

Array = NDArray[np.float64]

_UNITS = (1e-3, 1e-3, 1e-3)  # loads in kN, stiffness in kN/m, as the thesis's tables have them


@dataclass(frozen=True)
class Sweep:
    """An axle solved on a mesh of loads and, if there is more than one, of heave stiffnesses.

    Attributes
    ----------
    F_l, F_r : numpy.ndarray
        Vertical tyre forces, N, shape (n, n) or (n, n, k).
    K_h : numpy.ndarray or None
        Heave stiffness, N/m, of that shape; None if the axle's own was kept.
    height, roll : numpy.ndarray
        Ride height in m and roll angle in rad, of that shape.
    """

    F_l: Array
    F_r: Array
    K_h: Array | None
    height: Array
    roll: Array

    @property
    def points(self) -> Array:
        """Inputs in kN (and kN/m), one row per case: the experiments of (A.2)."""
        columns = [self.F_l, self.F_r] + ([] if self.K_h is None else [self.K_h])
        return 1e-3 * np.column_stack([column.ravel() for column in columns])

    @property
    def box(self) -> tuple[tuple[float, float], ...]:
        """Least and largest value of each input, N (and N/m)."""
        columns = [self.F_l, self.F_r] + ([] if self.K_h is None else [self.K_h])
        return tuple((float(column.min()), float(column.max())) for column in columns)


def sweep(
    axle: Axle | ReducedAxle, heaviest: float, *, points: int = 31, stiffnesses: ArrayLike | None = None
) -> Sweep:
    """Solve an axle on a mesh of loads from zero to `heaviest` per wheel.

    Parameters
    ----------
    axle : Axle or ReducedAxle
    heaviest : float
        Largest vertical tyre force, N (SAE, negative).
    points : int
        Loads per wheel.
    stiffnesses : array_like, shape (k,), optional
        Heave stiffnesses, N/m; the axle's own if not given.

    Raises
    ------
    ValueError
        If the heaviest load does not press the tyre on the road or there are fewer than two loads.
    ConvergenceError
        If the axle has no equilibrium under some of the loads.
    """
    if not heaviest < 0.0 or points < 2:
        raise ValueError(
            f"A mesh of {points} loads from 0 to {heaviest:g} N is none: the heaviest load must be below "
            "zero (SAE), and there must be two loads at least."
        )
    solver = axle if isinstance(axle, ReducedAxle) else ReducedAxle(axle)
    load = np.linspace(0.0, heaviest, points)
    K_h = None
    if stiffnesses is None:
        F_l, F_r = np.meshgrid(load, load, indexing="ij")
    else:
        F_l, F_r, K_h = np.meshgrid(load, load, np.asarray(stiffnesses, dtype=float), indexing="ij")
    solution = solver.solve(WheelLoads.of(F_l, F_r), heave_stiffness=K_h)
    shape = F_l.shape
    return Sweep(F_l, F_r, K_h, solution.height.reshape(shape), solution.roll.reshape(shape))


@dataclass(frozen=True)
class AxleMetamodel:
    """Ride height and roll angle of one axle as polynomials of total degree `degree`.

    Attributes
    ----------
    name : str
    degree : int
    h, phi : tuple of float
        Coefficients in mm and rad for loads in kN (and stiffness in kN/m), in the order of appendix A.
    box : tuple of pairs of float
        Least and largest value of F_l, F_r (N) and, if it is an input, K_h (N/m) that were fitted.
    """

    name: str
    degree: int
    h: tuple[float, ...]
    phi: tuple[float, ...]
    box: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        size = basis_size(len(self.box), self.degree)
        for quantity in ("h", "phi"):
            coefficients = getattr(self, quantity)
            if len(coefficients) != size or not all(math.isfinite(one) for one in coefficients):
                raise ValueError(
                    f"{quantity} of the metamodel {self.name} needs {size} finite coefficients, "
                    f"not {coefficients}."
                )

    def __call__(self, *inputs: Any) -> tuple[Any, Any]:
        """Return ride height in m and roll angle in rad.

        Parameters
        ----------
        *inputs : float, numpy.ndarray or casadi expression
            F_l and F_r in N (SAE) and, if the metamodel has it, K_h in N/m. Outside the box the
            polynomials are continued; :meth:`inside` says where that is.

        Raises
        ------
        ValueError
            If the number of inputs is not the metamodel's.
        """
        if len(inputs) != len(self.box):
            raise ValueError(f"{self.name} has {len(self.box)} inputs, not {len(inputs)}.")
        terms = monomials([unit * one for unit, one in zip(_UNITS, inputs, strict=False)], self.degree)
        height, roll = self.h[0], self.phi[0]
        for c_h, c_phi, term in zip(self.h[1:], self.phi[1:], terms[1:], strict=True):
            height = height + c_h * term if c_h else height
            roll = roll + c_phi * term if c_phi else roll
        return 1e-3 * height, roll

    def inside(self, *inputs: ArrayLike) -> NDArray[np.bool_]:
        """Return for every case whether all inputs (N, N/m) lie in the box that was fitted."""
        within = [
            (np.asarray(one) >= low) & (np.asarray(one) <= high)
            for one, (low, high) in zip(inputs, self.box, strict=True)
        ]
        result: NDArray[np.bool_] = np.logical_and.reduce(np.broadcast_arrays(*within))
        return result

    def time_outside(self, t: ArrayLike, loads: ArrayLike) -> float:
        """Return how long the loads lie outside the box that was fitted, in s.

        Parameters
        ----------
        t : array_like, shape (N,)
            Time, s, increasing.
        loads : array_like, shape (N, variables)
            The metamodel's inputs, N (and N/m). Half of a step counts for each of its ends.
        """
        times, outside = np.asarray(t, dtype=float), ~self.inside(*np.asarray(loads, dtype=float).T)
        return float(np.sum(0.5 * np.diff(times) * (outside[1:].astype(float) + outside[:-1])))

    def coefficient(self, quantity: str, *powers: int) -> float:
        """Return the coefficient of F_l^a F_r^b (K_h^c) in ``"h"`` (mm) or ``"phi"`` (rad)."""
        coefficients: tuple[float, ...] = getattr(self, quantity)
        return coefficients[exponents(len(self.box), self.degree).index(tuple(powers))]


@dataclass(frozen=True)
class Misfit:
    """Largest and root-mean-square difference of a metamodel and a sweep: m and rad."""

    height: float
    roll: float
    height_rms: float
    roll_rms: float


def misfit(metamodel: AxleMetamodel, data: Sweep) -> Misfit:
    """Compare a metamodel with a sweep, which need not be the one it was fitted to.

    A metamodel without stiffness among its inputs is compared with every stiffness of the sweep.
    """
    inputs = [data.F_l, data.F_r, data.K_h][: len(metamodel.box)]
    height, roll = metamodel(*inputs)
    dh, dphi = data.height - height, data.roll - roll
    return Misfit(
        float(np.abs(dh).max()),
        float(np.abs(dphi).max()),
        float(np.sqrt(np.mean(dh**2))),
        float(np.sqrt(np.mean(dphi**2))),
    )


def fitted(data: Sweep, degree: int = 2, name: str = "identified") -> AxleMetamodel:
    """Fit both polynomials to a sweep by least squares, (A.5).

    A sweep with several stiffnesses gives a metamodel that has K_h among its inputs, as Table 3.2.
    """
    h = fit(data.points, 1e3 * data.height.ravel(), degree)
    phi = fit(data.points, data.roll.ravel(), degree)
    return AxleMetamodel(name, degree, tuple(h.coefficients), tuple(phi.coefficients), data.box)


def reciprocal_fit(data: Sweep, half_track: float, degree: int = 2, name: str = "energy") -> AxleMetamodel:
    """Fit one complementary energy to ride height and roll angle at once, so that reciprocity holds.

    The contact heights of a conservative axle are derivatives of one function of the loads, Psi: with
    h = c - (Psi_l + Psi_r) / 2 and phi = (Psi_l - Psi_r) / (2 w), where Psi_l = dPsi/dF_l. A symmetric
    polynomial Psi of degree `degree` + 1 gives polynomials h and phi of degree `degree` with fewer
    coefficients than two separate ones, symmetric and reciprocal whatever the data.

    Parameters
    ----------
    data : Sweep
        Loads alone as inputs.
    half_track : float
        w, m: roll counts as the height that it gives the wheel.
    degree : int

    Raises
    ------
    ValueError
        If the sweep varies the stiffness.
    """
    if data.K_h is not None:
        raise ValueError("The energy polynomial takes loads alone; this sweep varies the heave stiffness.")
    w = 1e3 * half_track
    phi_matrix = design_matrix(data.points, degree)
    order = exponents(2, degree)
    pairs = [(a, total - a) for total in range(2, degree + 2) for a in range(total, (total - 1) // 2, -1)]
    rows_h: list[Array] = []
    rows_phi: list[Array] = []
    for a, b in pairs:
        left, right = np.zeros(len(order)), np.zeros(len(order))
        for p, q in {(a, b), (b, a)}:  # the mirrored monomial has the same coefficient
            if p:
                left[order.index((p - 1, q))] += p
            if q:
                right[order.index((p, q - 1))] += q
        rows_h.append(-0.5 * (left + right))
        rows_phi.append((left - right) / (2.0 * w))
    constant = np.eye(len(order))[0]
    h_basis, phi_basis = np.array([constant, *rows_h]).T, np.array([0.0 * constant, *rows_phi]).T
    matrix = np.vstack((phi_matrix @ h_basis, w * (phi_matrix @ phi_basis)))
    outcome = np.concatenate((1e3 * data.height.ravel(), w * data.roll.ravel()))
    scale = np.abs(matrix).max(axis=0)
    solution, *_ = np.linalg.lstsq(matrix / scale, outcome, rcond=None)
    parameters = solution / scale
    h, phi = h_basis @ parameters, phi_basis @ parameters
    return AxleMetamodel(name, degree, tuple(h), tuple(phi), data.box)
