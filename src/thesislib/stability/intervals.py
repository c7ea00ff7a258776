"""Interval arithmetic on arrays, with every bound rounded outwards.

IEEE 754 rounds sums and products to the nearest float; the next float beyond it is a bound. Only these
operations are here: transcendental functions are enclosed by arb (`thesislib.stability.guarantee`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thesislib.stability.bivariate import Polynomial

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Interval:
    """Closed intervals [low, high], elementwise.

    Attributes
    ----------
    low, high : array
    """

    low: Array
    high: Array

    @classmethod
    def exactly(cls, value: Any) -> Interval:
        """Return the intervals that hold one float each."""
        array = np.asarray(value, dtype=float)
        return cls(array, array)

    def __add__(self, other: Interval | float) -> Interval:
        other = other if isinstance(other, Interval) else Interval.exactly(other)
        return Interval(_down(self.low + other.low), _up(self.high + other.high))

    __radd__ = __add__

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Interval | float) -> Interval:
        return self + (-other)

    def __rsub__(self, other: float) -> Interval:
        return -self + other

    def __mul__(self, other: Interval | float) -> Interval:
        if not isinstance(other, Interval):
            first, second = self.low * other, self.high * other
            return Interval(_down(np.minimum(first, second)), _up(np.maximum(first, second)))
        a, b = self.low * other.low, self.low * other.high
        c, d = self.high * other.low, self.high * other.high
        low = np.minimum(np.minimum(a, b), np.minimum(c, d))
        high = np.maximum(np.maximum(a, b), np.maximum(c, d))
        return Interval(_down(low), _up(high))

    __rmul__ = __mul__

    def __getitem__(self, chosen: Any) -> Interval:
        return Interval(self.low[chosen], self.high[chosen])


def _down(x: Array) -> Array:
    return np.asarray(np.nextafter(x, -np.inf))


def _up(x: Array) -> Array:
    return np.asarray(np.nextafter(x, np.inf))


def enclose(p: Polynomial, x: Interval, y: Interval) -> Interval:
    """Return bounds of a polynomial with float coefficients on boxes, by Horner's rule in both variables."""
    total = Interval.exactly(np.zeros(np.broadcast_shapes(x.low.shape, y.low.shape)))
    for row in p.coefficients[::-1]:
        inner = Interval.exactly(np.zeros(y.low.shape))
        for value in row[::-1]:
            inner = inner * y + float(value)
        total = total * x + inner
    return total
