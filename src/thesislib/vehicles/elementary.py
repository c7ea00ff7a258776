"""Elementary functions for one model that serves numbers, arrays, casadi expressions and enclosures.

Numpy's functions on casadi expressions follow rules that differ between casadi versions, and casadi's
functions on numpy arrays return casadi matrices. Asking once which of the two libraries the arguments
belong to keeps one copy of the physics and no surprise. Power series of arb balls (python-flint), from which
value and slope of a function over an interval are enclosed with proof, have the same functions as methods.
"""

from __future__ import annotations

from typing import Any

import casadi
import numpy as np
from flint import arb_series

_SYMBOLIC = (casadi.SX, casadi.MX, casadi.DM)


class _Enclosures:
    """The elementary functions of power series of arb balls."""

    sin, cos, tan = (staticmethod(getattr(arb_series, name)) for name in ("sin", "cos", "tan"))
    arctan, sqrt = staticmethod(arb_series.atan), staticmethod(arb_series.sqrt)


def elementary(*arguments: Any) -> Any:
    """Return casadi if one of ``arguments`` is a casadi expression, enclosures if one is, else numpy.

    All have ``sin``, ``cos``, ``tan``, ``arctan`` and ``sqrt`` under these names.
    """
    if any(isinstance(argument, _SYMBOLIC) for argument in arguments):
        return casadi
    return _Enclosures if any(isinstance(argument, arb_series) for argument in arguments) else np


def square(x: Any) -> Any:
    """Return x², of an enclosure without the values below zero that x x has where x changes its sign."""
    if not isinstance(x, arb_series):
        return x * x
    low, high = x[0].abs_lower(), x[0].abs_upper()
    return arb_series([(low * low).union(high * high), 2 * x[0] * x[1]], prec=2)
