"""Polynomials along rays from the origin: boundaries of level sets, and the level at which V stops falling.

Along a ray a polynomial is one in the radius. What is found here is where a program begins and ends its
search; what is claimed is certified afterwards.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from thesislib.stability.bivariate import Polynomial

Array = NDArray[np.float64]

_FARTHEST = 6.0  # in units of z: 1.5 rad of slip
_RADII = np.linspace(0.0, _FARTHEST, 301)[1:]
_HALVINGS = 30  # of the distance between two radii: to 2e-11


class Rays:
    """Rays from the origin at even angles.

    Parameters
    ----------
    count : int
        Number of rays over the full turn, or over half of it with `half`.
    half : bool
        For even polynomials, whose other half is the same.
    """

    def __init__(self, count: int, *, half: bool = False) -> None:
        self.angles = np.arange(count) * (np.pi if half else 2 * np.pi) / count
        self.half = half

    @cached_property
    def directions(self) -> Array:
        """Unit vectors, shape (count, 2)."""
        return np.column_stack([np.cos(self.angles), np.sin(self.angles)])

    def radial(self, p: Polynomial) -> Array:
        """Return the coefficients of p along each ray in powers of the radius, shape (count, degree + 1)."""
        cosine, sine = self.directions.T
        coefficients = np.zeros((len(cosine), p.degree + 1))
        for (i, j), value in p.terms():
            coefficients[:, i + j] += value * cosine**i * sine**j
        return coefficients

    def along(self, p: Polynomial, radii: Array = _RADII) -> Array:
        """Return p on each ray at the radii, shape (count, len(radii))."""
        coefficients = self.radial(p)
        return coefficients @ radii ** np.arange(coefficients.shape[1])[:, None]

    def boundary(self, V: Polynomial, level: float = 1.0) -> Array:
        """Return the radius at which V first reaches a level on each ray, shape (count,).

        Raises
        ------
        ValueError
            If a ray never reaches it: the level set is larger than any slip the model is made for.
        """
        excess = self.along(V) - level
        if not (excess[:, -1] > 0).all() and not (excess > 0).any(axis=1).all():
            raise ValueError(f"The set V <= {level:.4g} extends beyond {_FARTHEST:g} units of slip.")
        first = np.argmax(excess > 0, axis=1)
        rays = np.arange(len(first))
        before = np.where(first > 0, excess[rays, first - 1], -level)
        radius = _RADII[first] - (_RADII[1] - _RADII[0]) * excess[rays, first] / (
            excess[rays, first] - before
        )
        coefficients = self.radial(V)
        powers = np.arange(coefficients.shape[1])
        for _ in range(3):  # Newton, from less than a hundredth away
            value = (coefficients * radius[:, None] ** powers).sum(axis=1) - level
            slope = (coefficients[:, 1:] * powers[1:] * radius[:, None] ** powers[:-1]).sum(axis=1)
            radius = radius - value / slope
        return np.asarray(radius)

    def points(self, radius: Array) -> Array:
        """Return the points at these radii, shape (count, 2); of half rays, their mirror images as well."""
        points = radius[:, None] * self.directions
        return np.concatenate([points, -points]) if self.half else points

    def lowest_level(self, V: Polynomial, rises: Polynomial) -> float:
        """Return the smallest value of V where `rises` is not negative on the rays.

        `rises` is dV/dt times a positive function; the origin, where both vanish, is left out. A change of
        sign between two samples is located by bisection: between radii this far apart neither polynomial is
        straight, and V at a root interpolated linearly is wrong by up to a per cent.
        """
        value, rise = self.along(V), self.along(rises)
        lowest = value[rise >= 0].min(initial=np.inf)
        ray, sample = np.nonzero((rise[:, 1:] >= 0) != (rise[:, :-1] >= 0))
        if len(ray) == 0:
            return float(lowest)
        low, high, falls_first = _RADII[sample], _RADII[sample + 1], rise[ray, sample] < 0
        coefficients = self.radial(rises)[ray]
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            before = (_values(coefficients, middle) < 0) == falls_first
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return float(min(lowest, _values(self.radial(V)[ray], (low + high) / 2).min()))


def _values(coefficients: Array, radius: Array) -> Array:
    """Return one polynomial of the radius each, at one radius each."""
    total = np.zeros_like(radius)
    for k in range(coefficients.shape[1] - 1, -1, -1):
        total = total * radius + coefficients[:, k]
    return np.asarray(total)
