"""The problem of Bryson and Denham: a double integrator under a ceiling, with its solution in closed form.

Bring a point from speed 1 to speed -1 in unit time and back to where it was, at least effort, without
rising above a ceiling ``l``. For ``l <= 1/6`` it rises for ``3 l``, glides along the ceiling, and falls
for ``3 l``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .control_problem import Array, ControlProblem


def bryson_denham() -> ControlProblem:
    """Return the problem without its ceiling; states are height and speed."""
    return ControlProblem(
        "Bryson–Denham",
        dynamics=lambda x, u: [x[1], u[0]],
        running_cost=lambda x, u: 0.5 * u[0] ** 2,
        initial=[0.0, 1.0],
        final_time=1.0,
        terminal={0: 0.0, 1: -1.0},
    )


def effort(ceiling: float) -> float:
    """Return the least cost under the ceiling, ``4 / (9 l)``."""
    return 4 / (9 * _binding(ceiling))


def height(t: ArrayLike, ceiling: float) -> Array:
    """Return the optimal height at times `t` in 0 .. 1, any shape."""
    left = np.minimum(np.asarray(t, float), 1 - np.asarray(t, float))
    rise = np.minimum(left / (3 * _binding(ceiling)), 1.0)
    return ceiling * (1 - (1 - rise) ** 3)


def _binding(ceiling: float) -> float:
    if not 0 < ceiling <= 1 / 6:
        raise ValueError(f"ceiling = {ceiling} is outside 0 .. 1/6, where it is touched along an arc")
    return ceiling
