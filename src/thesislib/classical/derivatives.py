"""Three ways to a derivative (section 2.2.3): differences (2.33), the complex step (2.37), the chain rule.

The function is written once, with numpy's elementary functions. It is then called with numbers, with complex
numbers, or with :class:`Dual` numbers, which numpy hands to their own methods.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["Dual", "automatic", "central_difference", "complex_step", "forward_difference"]

Function = Callable[[Any], Any]


def forward_difference(f: Function, x: float, step: float) -> float:
    """Return (f(x + step) - f(x)) / step (2.33); its error is O(step), and O(eps / step) from rounding.

    Raises
    ------
    ValueError
        If the step is not positive.
    """
    return float((f(x + _positive(step)) - f(x)) / step)


def central_difference(f: Function, x: float, step: float) -> float:
    """Return (f(x + step) - f(x - step)) / (2 step); its error is O(step^2), and O(eps / step) from rounding.

    Raises
    ------
    ValueError
        If the step is not positive.
    """
    return float((f(x + _positive(step)) - f(x - step)) / (2.0 * step))


def complex_step(f: Function, x: float, step: float) -> float:
    """Return Im f(x + i step) / step (2.37); its error is O(step^2), and nothing is subtracted.

    Raises
    ------
    ValueError
        If the step is not positive.
    """
    return float(np.imag(f(complex(x, _positive(step)))) / step)


def automatic(f: Function, x: float) -> float:
    """Return the derivative by automatic differentiation, in the forward mode with overloaded operators."""
    return float(f(Dual(x, 1.0)).slope)


def _positive(step: float) -> float:
    if not step > 0.0:
        raise ValueError(f"step = {step:g} has to be positive")
    return step


@dataclass(frozen=True)
class Dual:
    """A number and its derivative; every operation carries the second along by the chain rule.

    Attributes
    ----------
    value, slope : float
        The number, and its derivative with respect to whatever was given the slope 1.
    """

    value: float
    slope: float = 0.0

    def __add__(self, other: Dual | float) -> Dual:
        other = _dual(other)
        return Dual(self.value + other.value, self.slope + other.slope)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Dual | float) -> Dual:
        return self + -_dual(other)

    def __rsub__(self, other: float) -> Dual:
        return _dual(other) - self

    def __mul__(self, other: Dual | float) -> Dual:
        other = _dual(other)
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __truediv__(self, other: Dual | float) -> Dual:
        other = _dual(other)
        quotient = self.value / other.value
        return Dual(quotient, (self.slope - quotient * other.slope) / other.value)

    def __rtruediv__(self, other: float) -> Dual:
        return _dual(other) / self

    def __pow__(self, exponent: float) -> Dual:
        return Dual(self.value**exponent, exponent * self.value ** (exponent - 1) * self.slope)

    __radd__ = __add__
    __rmul__ = __mul__

    def sin(self) -> Dual:
        """Return the sine; numpy's function of the same name calls this, and so with the others."""
        return Dual(math.sin(self.value), math.cos(self.value) * self.slope)

    def cos(self) -> Dual:
        """Return the cosine."""
        return Dual(math.cos(self.value), -math.sin(self.value) * self.slope)

    def exp(self) -> Dual:
        """Return the exponential."""
        return Dual(math.exp(self.value), math.exp(self.value) * self.slope)

    def log(self) -> Dual:
        """Return the natural logarithm."""
        return Dual(math.log(self.value), self.slope / self.value)

    def sqrt(self) -> Dual:
        """Return the square root."""
        root = math.sqrt(self.value)
        return Dual(root, self.slope / (2.0 * root))

    def arctan(self) -> Dual:
        """Return the inverse tangent."""
        return Dual(math.atan(self.value), self.slope / (1.0 + self.value**2))


def _dual(number: Dual | float) -> Dual:
    return number if isinstance(number, Dual) else Dual(number)
