"""Polynomials in two variables, as arrays of coefficients.

``coefficients[i, j]`` belongs to x^i y^j. The entries are floats, or exact numbers (`fractions.Fraction`,
`flint.fmpq`) in an array of objects: the arithmetic is the same. A third axis makes the polynomial
*affine in unknowns*: ``coefficients[i, j, 0]`` is the known part and ``coefficients[i, j, k]`` what the k-th
unknown contributes, so that the constraints of a sum-of-squares program are written like the mathematics.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Exponents = tuple[int, int]


class Polynomial:
    """A polynomial in two variables.

    Parameters
    ----------
    coefficients : array of shape (I, J) or (I, J, 1 + unknowns)
        Coefficient of x^i y^j; with a third axis, affine in the unknowns of a program.
    """

    __array_ufunc__ = None  # numpy's scalars leave products to __rmul__

    def __init__(self, coefficients: NDArray[Any]) -> None:
        self.coefficients = np.asarray(coefficients)

    @classmethod
    def from_terms(cls, terms: Mapping[Exponents, Any]) -> Polynomial:
        """Return the polynomial with these coefficients; exact ones if any is no float."""
        exact = any(not isinstance(value, float | int) for value in terms.values())
        shape = tuple(1 + max((e[axis] for e in terms), default=0) for axis in (0, 1))
        coefficients = np.zeros(shape, dtype=object if exact else float)
        for exponents, value in terms.items():
            coefficients[exponents] = value
        return cls(coefficients)

    @property
    def affine(self) -> bool:
        """Whether the coefficients depend on unknowns."""
        return self.coefficients.ndim == 3

    def terms(self) -> Iterator[tuple[Exponents, Any]]:
        """Iterate over the exponents and the coefficients that are not zero."""
        occupied = self.coefficients != 0
        for i, j in zip(*np.nonzero(occupied.any(axis=2) if self.affine else occupied), strict=True):
            yield (int(i), int(j)), self.coefficients[i, j]

    @property
    def support(self) -> list[Exponents]:
        """Exponents of the monomials that occur."""
        return [exponents for exponents, _ in self.terms()]

    @property
    def degree(self) -> int:
        """Total degree; 0 for the zero polynomial."""
        return max((i + j for i, j in self.support), default=0)

    def __add__(self, other: Any) -> Polynomial:
        if not isinstance(other, Polynomial):
            other = Polynomial(np.array([[other]]))
        left, right = self.coefficients, other.coefficients
        if left.ndim < right.ndim:
            left = left[..., None]
        elif right.ndim < left.ndim:
            right = right[..., None]
        shape = tuple(max(sizes) for sizes in zip(left.shape, right.shape, strict=True))
        total = np.zeros(shape, dtype=np.result_type(left, right))
        for part in (left, right):
            total[tuple(map(slice, part.shape))] += part
        return Polynomial(total)

    __radd__ = __add__

    def __neg__(self) -> Polynomial:
        return Polynomial(-self.coefficients)

    def __sub__(self, other: Any) -> Polynomial:
        return self + (-other)

    def __mul__(self, other: Any) -> Polynomial:
        if not isinstance(other, Polynomial):
            return Polynomial(self.coefficients * other)
        known, factor = (other, self) if self.affine else (self, other)
        if known.affine:
            raise TypeError("The product of two polynomials with unknowns is not affine in the unknowns.")
        (rows, columns), (K, L) = known.coefficients.shape, factor.coefficients.shape[:2]
        shape = (rows + K - 1, columns + L - 1, *factor.coefficients.shape[2:])
        product = np.zeros(shape, dtype=np.result_type(known.coefficients, factor.coefficients))
        for (i, j), value in known.terms():
            product[i : i + K, j : j + L] += value * factor.coefficients
        return Polynomial(product)

    __rmul__ = __mul__

    def derivative(self, axis: int) -> Polynomial:
        """Return the partial derivative with respect to x (axis 0) or y (axis 1)."""
        moved = np.moveaxis(self.coefficients, axis, 0)
        if moved.shape[0] == 1:
            return Polynomial(np.zeros_like(self.coefficients))
        powers = np.arange(1, moved.shape[0]).reshape(-1, *([1] * (moved.ndim - 1)))
        if moved.dtype == object:
            powers = powers.astype(object)
        return Polynomial(np.moveaxis(moved[1:] * powers, 0, axis))

    def __call__(self, x: Any, y: Any) -> Any:
        """Evaluate at points; of a polynomial with unknowns, the affine form's coefficients at each point."""
        if self.affine:
            monomials = (
                _powers(x, self.coefficients.shape[0])[:, :, None]
                * (_powers(y, self.coefficients.shape[1])[:, None, :])
            )
            return np.tensordot(monomials, self.coefficients, axes=([1, 2], [0, 1]))
        return np.polynomial.polynomial.polyval2d(x, y, self.coefficients)

    def value_at(self, unknowns: NDArray[np.float64]) -> Polynomial:
        """Return the polynomial for these values of the unknowns."""
        if not self.affine:
            return self
        known = self.coefficients[..., 0]
        return Polynomial(known + self.coefficients[..., 1:] @ unknowns[: self.coefficients.shape[2] - 1])


def _powers(x: Any, count: int) -> NDArray[np.float64]:
    return np.asarray(x, dtype=float).reshape(-1)[:, None] ** np.arange(count)


def monomial(exponents: Exponents) -> Polynomial:
    """Return x^i y^j."""
    return Polynomial.from_terms({exponents: 1.0})


def exponents_between(lowest: int, highest: int, *, even: bool = False) -> list[Exponents]:
    """Return the exponents of total degree `lowest` to `highest`; with `even`, of even degree only."""
    return [
        (total - j, j)
        for total in range(lowest, highest + 1)
        if not (even and total % 2)
        for j in range(total + 1)
    ]
