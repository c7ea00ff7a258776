"""Two maps of what a number does to a lap: where it acts, and where the time appears.

Power acts where the engine is at its limit; the time that it saves appears there too, and further down the
straight and into the braking, since the car stays faster. The first map is the density of the multipliers'
derivative, the second the change of the slowness that the changed solution has. Over a lap both sum to the
same, but for the regulariser's share, which the second does not have.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from thesislib.lap.adjoint import FRICTION_PEAKS
from thesislib.lap.limits import FRONT_HEIGHT, HALF_WIDTH
from thesislib.lap.minimum_time import Array, Lap
from thesislib.lap.prices import AMOUNTS, GRIP, Amount, price_density
from thesislib.ocp.derivatives import Derivative, Derivatives
from thesislib.vehicles import CONTROLS, STATES
from thesislib.vehicles.parameters import unknown_name

_STEP = 1e-20  # of the imaginary part that carries a derivative; it cancels nothing


@dataclass(frozen=True, eq=False)
class Effect:
    """What an amount of something does to a lap, to first order.

    Attributes
    ----------
    amount : Amount
        What changes.
    acts : ndarray, shape (N,)
        Density of its price, regulariser included, s/m.
    appears : ndarray, shape (N,)
        Change of the slowness, s/m.
    states : dict of str to ndarray, shape (N,)
        Change of the states at the same place, SI.
    price : float
        Integral of `acts`, s: change of the minimised objective.
    time : float
        Integral of `appears`, s: change of the lap time.
    regularisation : float
        Change of the regulariser, s.
    """

    amount: Amount
    acts: Array
    appears: Array
    states: dict[str, Array]
    price: float
    time: float
    regularisation: float

    @property
    def disagreement(self) -> float:
        """Difference between the two maps' sums once the regulariser is accounted for, relative to the price.

        It is what the barrier has left in the solution: see `Start.tighten`.
        """
        return abs((self.time + self.regularisation) / self.price - 1.0)


def effects(lap: Lap, names: Iterable[str]) -> tuple[Effect, ...]:
    """Return both maps of several numbers; the lap's first-order system is factorised once.

    Parameters
    ----------
    lap : Lap
        A lap with its multipliers, as tight as `Start.tighten` makes it.
    names : iterable of str
        Of `AMOUNTS`: a number of the car that is a constant of the problem, a limit, or the grip.

    Raises
    ------
    KeyError
        If `AMOUNTS` has no such name; the message suggests the nearest one.
    ocp.ProblemError
        If the lap has no multipliers, or the number is none of the problem.
    """
    amounts = {each.name: each for each in AMOUNTS}
    wanted = list(names)
    for name in wanted:
        if name not in amounts:
            raise KeyError(unknown_name(name, amounts, "the table of prices"))
    derivatives = Derivatives(lap.solution)
    return tuple(_effect(lap, derivatives, amounts[name]) for name in wanted)


def _effect(lap: Lap, derivatives: Derivatives, amount: Amount) -> Effect:
    parts = [(factor * amount.size, each) for factor, each in _answers(lap, derivatives, amount.name)]
    states = {state: np.sum([factor * each[state] for factor, each in parts], axis=0) for state in STATES}
    acts, appears = amount.size * price_density(lap, amount.name), _slowness_change(lap, states)
    weights = lap.solution.weights
    return Effect(
        amount,
        acts,
        appears,
        states,
        float(weights @ acts),
        float(weights @ appears),
        sum(factor * each.regularisation for factor, each in parts),
    )


def _answers(lap: Lap, derivatives: Derivatives, name: str) -> list[tuple[float, Derivative]]:
    """Return derivatives of the solution, and factors, that sum to that by the number."""
    if name == GRIP.name:
        return [(lap.car.values[peak], derivatives.by(peak)) for peak in FRICTION_PEAKS]
    if name == HALF_WIDTH:
        return [(1.0, derivatives.by_bounds("n", lower=-1.0, upper=1.0))]
    if name == FRONT_HEIGHT:
        return [(1.0, derivatives.by_bounds("ride_height", upper=1.0))]
    return [(1.0, derivatives.by(name))]


def _slowness_change(lap: Lap, states: dict[str, Array]) -> Array:
    """Return how the slowness (4.4) changes with the states, shape (N,)."""
    x = {name: lap.solution[name] + 1j * _STEP * states[name] for name in STATES}
    u = {name: lap.solution[name] for name in CONTROLS}
    slowness = lap.car.quantities(x, u, lap.track.curvature(lap.s))["slowness"]
    return np.asarray(np.imag(slowness) / _STEP)
