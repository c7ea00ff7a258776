"""Elementary functions for one model that serves numbers, arrays and casadi expressions.

Numpy's functions on casadi expressions follow rules that differ between casadi versions, and casadi's
functions on numpy arrays return casadi matrices. Asking once which of the two libraries the arguments
belong to keeps one copy of the physics and no surprise.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

import casadi
import numpy as np

_SYMBOLIC = (casadi.SX, casadi.MX, casadi.DM)


def elementary(*arguments: Any) -> ModuleType:
    """Return casadi if one of ``arguments`` is a casadi expression, else numpy.

    Both have ``sin``, ``cos``, ``tan``, ``arctan`` and ``sqrt`` under these names.
    """
    return casadi if any(isinstance(argument, _SYMBOLIC) for argument in arguments) else np
