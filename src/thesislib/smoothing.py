"""Smooth stand-ins for max, min and the absolute value (thesis section 2.8.1).

A Newton-type solver needs first and second derivatives everywhere; these functions have them at the
corner too. They take floats, numpy arrays and casadi expressions alike.
"""

from __future__ import annotations

from typing import Any


def smooth_absolute(x: Any, epsilon: float) -> Any:
    """Return sqrt(x^2 + epsilon), which is |x| but for a rounded corner.

    Parameters
    ----------
    x : float, numpy.ndarray or casadi expression
        Argument, any shape and unit.
    epsilon : float
        Positive, in the square of the unit of ``x``; the corner is about ``sqrt(epsilon)`` wide and the
        largest error, at ``x = 0``, is ``sqrt(epsilon)``.

    Returns
    -------
    same kind and shape as ``x``

    Raises
    ------
    ValueError
        If ``epsilon`` is not positive.
    """
    _refuse_non_positive(epsilon)
    return (x * x + epsilon) ** 0.5


def smooth_maximum(x: Any, epsilon: float, floor: Any = 0.0) -> Any:
    """Return max(x, floor) with a rounded corner, equation (2.165).

    Parameters
    ----------
    x : float, numpy.ndarray or casadi expression
        Argument, any shape and unit.
    epsilon : float
        Positive, in the square of the unit of ``x``. The result exceeds the true maximum by at most
        ``sqrt(epsilon)/2``, at the corner, and by ``epsilon/(4 |x - floor|)`` far from it.
    floor : float, numpy.ndarray or casadi expression
        The other argument of the maximum; max(a, b) = a + max(0, b - a).

    Returns
    -------
    same kind and shape as ``x``

    Raises
    ------
    ValueError
        If ``epsilon`` is not positive.
    """
    distance = x - floor
    return floor + (distance + smooth_absolute(distance, epsilon)) / 2


def smooth_minimum(x: Any, epsilon: float, ceiling: Any = 0.0) -> Any:
    """Return min(x, ceiling) with a rounded corner, equation (2.165).

    Parameters
    ----------
    x : float, numpy.ndarray or casadi expression
        Argument, any shape and unit.
    epsilon : float
        Positive, in the square of the unit of ``x``. The result is below the true minimum by at most
        ``sqrt(epsilon)/2``.
    ceiling : float, numpy.ndarray or casadi expression
        The other argument of the minimum.

    Returns
    -------
    same kind and shape as ``x``

    Raises
    ------
    ValueError
        If ``epsilon`` is not positive.
    """
    return -smooth_maximum(-x, epsilon, floor=-ceiling)


def _refuse_non_positive(epsilon: float) -> None:
    if not epsilon > 0:
        raise ValueError(
            f"The smoothing constant epsilon = {epsilon} is not positive; the corner would be sharp."
        )
