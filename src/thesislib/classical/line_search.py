"""How far to go along a direction of descent: the step length alpha of (2.13)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

__all__ = ["armijo", "wolfe"]


def armijo(value: Callable[[float], float], at_zero: float, slope: float, *, share: float = 1e-4) -> float:
    """Return the first of 1, 1/2, 1/4 … that lowers the value by a fair share of what the slope promises.

    The condition (2.16) says that the value falls at first. Armijo's says by how much it has fallen,
    phi(alpha) <= phi(0) + share * alpha * phi'(0), which (2.16) alone would not: a sequence of ever
    smaller gains can end where the gradient is not zero.

    Parameters
    ----------
    value : callable
        phi, the function along the direction.
    at_zero, slope : float
        phi(0) and phi'(0); the slope is negative.
    share : float
        The share, between 0 and 1/2.

    Raises
    ------
    ArithmeticError
        If the direction does not descend, or no step down to 2^-60 lowers the value.
    """
    _refuse_ascent(slope)
    noise = _noise(at_zero)
    for halvings in range(61):
        alpha = 0.5**halvings
        if value(alpha) <= at_zero + share * alpha * slope + noise:
            return alpha
    raise ArithmeticError("no step down to 2^-60 lowers the value enough")


def wolfe(
    value: Callable[[float], float],
    slope_at: Callable[[float], float],
    at_zero: float,
    slope: float,
    *,
    share: float = 1e-4,
    flatness: float = 0.9,
) -> float:
    """Return a step that satisfies both of Wolfe's conditions, by bisection.

    Armijo's condition keeps the step from being too long. The second, phi'(alpha) >= flatness * phi'(0),
    keeps it from being too short, and implies p^T y > 0, without which (2.19) would not stay positive
    definite.

    Parameters
    ----------
    value, slope_at : callable
        phi and its derivative along the direction.
    at_zero, slope : float
        phi(0) and phi'(0); the slope is negative.
    share, flatness : float
        The two constants, 0 < share < flatness < 1.

    Raises
    ------
    ArithmeticError
        If the direction does not descend, or 100 bisections find no such step.
    """
    _refuse_ascent(slope)
    noise = _noise(at_zero)
    low, high, alpha = 0.0, np.inf, 1.0
    for _ in range(100):
        if not value(alpha) <= at_zero + share * alpha * slope + noise:
            high = alpha
        elif slope_at(alpha) < flatness * slope:
            low = alpha
        else:
            return alpha
        alpha = 2.0 * alpha if np.isinf(high) else 0.5 * (low + high)
    raise ArithmeticError("100 bisections find no step that satisfies Wolfe's conditions")


def _refuse_ascent(slope: float) -> None:
    if not slope < 0.0:
        raise ArithmeticError(f"the direction has the slope {slope:.3g} and does not descend (2.16)")


def _noise(at_zero: float) -> float:
    """Return how far rounding alone can lift the value: near a minimum all gains are smaller than that."""
    return 4.0 * np.finfo(float).eps * abs(at_zero)
