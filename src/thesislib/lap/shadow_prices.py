"""Shadow prices along the lap, in units of the track: what a little more of each limit would save, and where.

A multiplier is the price of its constraint at one place. Prices are counted positive where more room saves
time; integrated over the lap they are, with the other sign, the prices of the same things in `prices`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from thesislib.lap.limits import BRAKE, FRONT_HEIGHT, HALF_WIDTH, ROLL, constraint_densities, limits
from thesislib.lap.minimum_time import Array, Lap

_MS_PER_KM: Final = 1e6  # from s/m

# Of all that is paid for an edge, shares below this are the barrier's; touches are this far apart at least.
_LEAST_SHARE: Final = 1e-5
_APART_M: Final = 25.0


@dataclass(frozen=True, eq=False)
class ShadowPrice:
    """Time that more room in one constraint would save, along the lap.

    Attributes
    ----------
    label : str
        The constraint.
    amount : str
        The room that is priced: ``"kW"``, ``"10 cm"``.
    density : ndarray, shape (N,)
        ms per amount and km.
    total : float
        ms per amount, over the whole lap.
    priced_as : str
        Name of the same thing in `prices`; the two edges of the road share one.
    size : float
        The amount, SI.
    """

    label: str
    amount: str
    density: Array
    total: float
    priced_as: str
    size: float

    @property
    def unit(self) -> str:
        """Unit of the density."""
        return f"ms/({self.amount} km)"


def shadow_prices(lap: Lap) -> dict[str, ShadowPrice]:
    """Return the shadow prices of a lap by constraint, as far as it has the constraints.

    Parameters
    ----------
    lap : Lap
        A lap with its multipliers.

    Returns
    -------
    dict
        ``power``: of the engine. ``ride_height``: of the plank limit, that the front may sink lower.
        ``left_edge``, ``right_edge``: of the road. ``roll``: of (4.19), that the front axle rolls more than
        the rear one, and thus carries more of the lateral load transfer. ``brake``: of (4.20), that the outer
        front wheel brakes more than the inner one, where both brake.

    Raises
    ------
    ocp.ProblemError
        If the lap has no multipliers.
    """
    solution = lap.solution
    edge, constraints = solution.bound_multiplier("n"), constraint_densities(lap)
    rows = {
        "power": ("engine power", "kW", solution.path_multiplier("power"), "P_max", 1e3),
        "left_edge": ("left edge", "10 cm", np.maximum(-edge, 0.0), HALF_WIDTH, 0.1),
        "right_edge": ("right edge", "10 cm", np.maximum(edge, 0.0), HALF_WIDTH, 0.1),
    }
    if FRONT_HEIGHT in limits(lap):
        plank = solution.path_multiplier("ride_height")
        rows["ride_height"] = ("plank limit", "mm", plank, FRONT_HEIGHT, 1e-3)
    if ROLL in constraints:
        rows["roll"] = ("more roll in front", "0.1°", -constraints[ROLL], ROLL, np.pi / 1800.0)
    if BRAKE in constraints:
        rows["brake"] = ("outer front brake", "100 N", -constraints[BRAKE], BRAKE, 100.0)
    return {
        name: ShadowPrice(
            label,
            amount,
            _MS_PER_KM * size * saved,
            float(1e3 * size * (solution.weights @ saved)),
            priced_as,
            size,
        )
        for name, (label, amount, saved, priced_as, size) in rows.items()
    }


def touches(lap: Lap, price: ShadowPrice) -> tuple[Array, Array]:
    """Return where a lap touches a limit, and what that touch is worth.

    The price of an edge is paid at the few places that the line touches, each a few points long. Its density
    there says more about the mesh than about the lap; its integral is what a driver can use.

    Returns
    -------
    s : ndarray, shape (touches,)
        Middles of the touches, weighted by the price, m.
    saved : ndarray, shape (touches,)
        ms per amount.
    """
    shares = 1e-3 * lap.solution.weights * price.density
    paid = np.flatnonzero(shares > _LEAST_SHARE * shares.sum())
    if not paid.size:
        return np.zeros(0), np.zeros(0)
    groups = np.split(paid, np.flatnonzero(np.diff(lap.s[paid]) > _APART_M) + 1)
    saved = np.array([shares[group].sum() for group in groups])
    middles = np.array([shares[group] @ lap.s[group] for group in groups]) / saved
    return middles, saved
