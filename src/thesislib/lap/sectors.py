"""The lap cut into the stretches that belong to its corners, and densities summed over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thesislib.lap.channels import speed
from thesislib.lap.minimum_time import Array, Lap


@dataclass(frozen=True)
class Sector:
    """The stretch of one corner: from where the car is fastest before it to where it is fastest after it.

    It holds the braking, the corner, and the straight that the corner's exit speed is carried along.

    Attributes
    ----------
    number : int
        Number of the corner.
    begin, end : float
        Distances along the centre line, m; the sector that holds the start line has ``end < begin``.
    """

    number: int
    begin: float
    end: float

    def holds(self, s: Array) -> np.ndarray:
        """Return which of the distances `s`, m, lie in the sector; its end is the next one's."""
        if self.begin < self.end:
            return (s >= self.begin) & (s < self.end)
        return (s >= self.begin) | (s < self.end)


def sectors(lap: Lap, corners: Sequence[tuple[int, float, str]]) -> tuple[Sector, ...]:
    """Return the sector of every corner, in the order of the lap.

    Parameters
    ----------
    lap : Lap
        The lap, whose speed says where one corner's straight ends and the next one's braking begins.
    corners : sequence of (number, distance in m, direction)
        Two at least.

    Raises
    ------
    ValueError
        If there are fewer than two corners, or no collocation point between two of them.
    """
    ordered = sorted(corners, key=lambda corner: corner[1])
    if len(ordered) < 2:
        raise ValueError(f"a lap is cut between corners, of which it needs two; there are {len(ordered)}")
    pace = speed(lap)
    cuts = []
    for (before, first, _), (after, last, _) in zip(ordered, [*ordered[1:], ordered[0]], strict=True):
        between = Sector(before, first, last).holds(lap.s)
        if not between.any():
            raise ValueError(f"no collocation point lies between corners {before} and {after}")
        inside = np.flatnonzero(between)
        cuts.append(float(lap.s[inside[np.argmax(pace[inside])]]))
    begins = [cuts[-1], *cuts[:-1]]
    return tuple(
        Sector(corner[0], begin, end) for corner, begin, end in zip(ordered, begins, cuts, strict=True)
    )


def by_sector(lap: Lap, density: Array, parts: Sequence[Sector]) -> Array:
    """Return the integrals of a density over sectors, by the lap's own quadrature, shape (sectors,).

    Every collocation point belongs to one sector with all its weight, so that the integrals of the sectors of
    a lap sum to that over the lap.
    """
    shares = lap.solution.weights * density
    return np.array([shares[part.holds(lap.s)].sum() for part in parts])
