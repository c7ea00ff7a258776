"""Sum-of-squares programs: unknown polynomials, constraints that something is a sum of squares, one solve.

The program is handed to Clarabel directly. Its unknowns are the free coefficients and the entries of all
Gram matrices; that a polynomial is z'Qz is one equation for each monomial.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import clarabel
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from thesislib.stability.bivariate import Exponents, Polynomial
from thesislib.stability.gram import Basis, products

Affine = NDArray[np.float64]
"""An affine form of the unknowns: its known part, then one factor for each unknown."""

_ACCEPTED = ("Solved", "AlmostSolved")


class ProgramError(RuntimeError):
    """A program has no solution that the solver would vouch for; the message says which and why."""


@dataclass
class Solution:
    """What a solved program says.

    Attributes
    ----------
    unknowns : array
        Values of the free unknowns and of the entries of unknown Gram matrices.
    grams : dict of str to list of arrays
        Gram matrices of each sum of squares, one for each block of its basis.
    objective : float
        Value of what was maximised.
    iterations : int
        Of the interior-point method.
    """

    unknowns: NDArray[np.float64]
    grams: dict[str, list[NDArray[np.float64]]]
    objective: float
    iterations: int


@dataclass
class SosProgram:
    """A sum-of-squares program, stated piece by piece and then solved.

    Attributes
    ----------
    name : str
        What failure messages call the program.
    """

    name: str
    size: int = 0
    _cones: list[tuple[str, list[tuple[slice, int]]]] = field(default_factory=list)
    _equalities: list[tuple[Polynomial, str, Sequence[Basis]]] = field(default_factory=list)
    _rows: list[Affine] = field(default_factory=list)
    _matrices: list[NDArray[np.float64]] = field(default_factory=list)
    _weights: dict[str, Sequence[NDArray[np.float64]]] = field(default_factory=dict)
    _goal: Affine = field(default_factory=lambda: np.zeros(1))

    def _new(self, count: int) -> slice:
        self.size += count
        return slice(self.size - count, self.size)

    def unknown(self) -> Polynomial:
        """Add one free number, as a constant polynomial."""
        return self.polynomial([(0, 0)])

    def polynomial(self, exponents: Sequence[Exponents]) -> Polynomial:
        """Add an unknown polynomial with these monomials."""
        place = self._new(len(exponents))
        shape = [1 + max(e[axis] for e in exponents) for axis in (0, 1)]
        coefficients = np.zeros((*shape, 1 + place.stop))
        for k, (i, j) in enumerate(exponents):
            coefficients[i, j, 1 + place.start + k] = 1.0
        return Polynomial(coefficients)

    def sum_of_squares(self, name: str, blocks: Sequence[Basis]) -> Polynomial:
        """Add an unknown sum of squares with these blocks of monomials."""
        places = self._gram(name, blocks)
        highest = [2 * max(e[axis] for block in blocks for e in block) for axis in (0, 1)]
        coefficients = np.zeros((highest[0] + 1, highest[1] + 1, 1 + self.size))
        for (i, j), found in products(blocks).items():
            for k, a, b in found:
                index, factor = _entry(places[k][0], a, b)
                coefficients[i, j, 1 + index] += factor
        return Polynomial(coefficients)

    def require_sum_of_squares(
        self,
        name: str,
        polynomial: Polynomial,
        blocks: Sequence[Basis],
        weights: Sequence[NDArray[np.float64]] | None = None,
    ) -> None:
        """Require that a polynomial is z'Qz with positive semidefinite Q, in these blocks of monomials.

        With `weights`, the solver works in the monomials times these; the Gram matrices that `solve`
        returns are those of the plain monomials all the same.
        """
        self._gram(name, blocks)
        self._weights[name] = weights or [np.ones(len(block)) for block in blocks]
        self._equalities.append((polynomial, name, blocks))

    def require_nonnegative(self, forms: ArrayLike) -> None:
        """Require affine forms of the unknowns, one in each row, to be nonnegative."""
        self._rows.append(np.atleast_2d(np.asarray(forms, dtype=float)))

    def require_positive_semidefinite(self, matrix: NDArray[np.float64]) -> None:
        """Require a symmetric matrix of affine forms, of shape (n, n, 1 + unknowns), to be semidefinite."""
        self._matrices.append(matrix)

    def maximise(self, form: ArrayLike) -> None:
        """Say which affine form of the unknowns is to become largest."""
        self._goal = np.asarray(form, dtype=float).reshape(-1)

    def _gram(self, name: str, blocks: Sequence[Basis]) -> list[tuple[slice, int]]:
        places = [(self._new(len(block) * (len(block) + 1) // 2), len(block)) for block in blocks]
        self._cones.append((name, places))
        return places

    def solve(self) -> Solution:
        """Solve the program.

        Raises
        ------
        ProgramError
            If Clarabel finds it infeasible or stops without an answer.
        """
        equalities, known = self._coefficient_rows()
        inequalities, least = self._inequality_rows()
        grams = [place for _, places in self._cones for place in places]
        chosen = np.concatenate([np.arange(p.start, p.stop) for p, _ in grams]) if grams else np.zeros(0, int)
        selection = sparse.csr_matrix(
            (-np.ones(len(chosen)), (np.arange(len(chosen)), chosen)), (len(chosen), self.size)
        )
        cones = [clarabel.ZeroConeT(len(known)), clarabel.NonnegativeConeT(len(least))]
        cones += [clarabel.PSDTriangleConeT(n) for _, n in grams]
        parts, bounds = [equalities, inequalities, selection], [known, least, np.zeros(len(chosen))]
        for matrix in self._matrices:
            rows = np.array(
                [
                    matrix[a, b] * (1.0 if a == b else math.sqrt(2.0))
                    for b in range(len(matrix))
                    for a in range(b + 1)
                ]
            )
            parts.append(-sparse.csr_matrix(self._padded(rows)[:, 1:]))
            bounds.append(rows[:, 0])
            cones.append(clarabel.PSDTriangleConeT(len(matrix)))
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_iter = 100
        settings.max_threads = 1
        settings.chordal_decomposition_enable = False  # the blocks are dense
        # a point well inside the cone matters more than the last digits of the objective
        settings.tol_gap_abs = settings.tol_gap_rel = 1e-6
        goal = -self._padded(self._goal[None])[0, 1:]
        found = clarabel.DefaultSolver(
            sparse.csc_matrix((self.size, self.size)),
            goal,
            sparse.vstack(parts, format="csc"),
            np.concatenate(bounds),
            cones,
            settings,
        ).solve()
        if str(found.status) not in _ACCEPTED:
            raise ProgramError(f"{self.name}: Clarabel ends with {found.status}.")
        x = np.asarray(found.x)
        matrices = {name: [_matrix(x[p], n) for p, n in places] for name, places in self._cones}
        for name, weights in self._weights.items():
            matrices[name] = [gram * np.outer(w, w) for gram, w in zip(matrices[name], weights, strict=True)]
        return Solution(x, matrices, float(-goal @ x + self._goal[0]), int(found.iterations))

    def _padded(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.pad(rows, ((0, 0), (0, 1 + self.size - rows.shape[1])))

    def _coefficient_rows(self) -> tuple[sparse.csr_matrix, NDArray[np.float64]]:
        """Return the equations "coefficient of z'Qz = coefficient of the polynomial" of all constraints."""
        known: list[float] = []
        entries: list[tuple[float, int, int]] = []
        places = dict(self._cones)
        for polynomial, name, blocks in self._equalities:
            coefficients = polynomial.coefficients
            if not polynomial.affine:
                coefficients = coefficients[..., None]
            squares = products(blocks)
            for i, j in set(polynomial.support) | set(squares):
                here = len(known)
                inside = i < coefficients.shape[0] and j < coefficients.shape[1]
                form = coefficients[i, j] if inside else np.zeros(1)
                for k, a, b in squares.get((i, j), ()):
                    index, factor = _entry(places[name][k][0], a, b)
                    weight = self._weights[name][k]
                    entries.append((factor * weight[a] * weight[b], here, index))
                entries += [(-form[1 + k], here, k) for k in map(int, np.nonzero(form[1:])[0])]
                known.append(form[0])
        value, row, column = zip(*entries, strict=True)
        rows = sparse.csr_matrix((value, (row, column)), (len(known), self.size))
        # coefficients of high and of low monomials differ by many orders of magnitude
        largest = abs(rows).max(axis=1).toarray().ravel()
        each = 1.0 / np.where(largest > 0, largest, 1.0)
        return sparse.diags_array(each) @ rows, np.array(known) * each

    def _inequality_rows(self) -> tuple[sparse.csr_matrix, NDArray[np.float64]]:
        if not self._rows:
            return sparse.csr_matrix((0, self.size)), np.zeros(0)
        rows = np.concatenate([self._padded(forms) for forms in self._rows])
        return -sparse.csr_matrix(rows[:, 1:]), rows[:, 0]


def _entry(place: slice, a: int, b: int) -> tuple[int, float]:
    """Return the unknown that holds entry (a, b), a <= b, and what one unit of it adds to z'Qz.

    Clarabel stacks the upper triangle by columns, off-diagonal entries times the square root of two.
    """
    return place.start + b * (b + 1) // 2 + a, 1.0 if a == b else math.sqrt(2.0)


def _matrix(stacked: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    matrix = np.zeros((n, n))
    rows, columns = np.tril_indices(n)  # row by row of the lower is column by column of the upper triangle
    matrix[rows, columns] = np.where(rows == columns, stacked, stacked / math.sqrt(2.0))
    return matrix + np.tril(matrix, -1).T
