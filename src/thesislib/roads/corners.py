"""Corners of a road, found from its curvature."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from thesislib.roads.centreline import CentreLine

_STEP_M = 1.0


@dataclass(frozen=True)
class Corner:
    """One corner.

    Attributes
    ----------
    number : int
        Number from the start of the lap, from 1.
    s : float
        Distance of its sharpest point, m.
    direction : {"R", "L"}
        Right-hand or left-hand.
    begin, end : float
        Distances between which the curvature exceeds the threshold, m; ``end`` may exceed the lap's length.
    turned : float
        Change of heading in it, rad, positive.
    """

    number: int
    s: float
    direction: Literal["R", "L"]
    begin: float
    end: float
    turned: float


def corners(
    road: CentreLine, *, threshold: float = 0.004, least_turn: float = math.radians(10.0)
) -> tuple[Corner, ...]:
    """Return the corners of ``road`` in the order of the lap.

    A corner is a stretch with more curvature than ``threshold`` to one side that turns the road by more than
    ``least_turn``; the defaults find the sixteen corners of the Circuit de Barcelona-Catalunya.

    Parameters
    ----------
    road : CentreLine
        Road to look at, in steps of a metre.
    threshold : float
        Curvature in 1/m, positive.
    least_turn : float
        Heading in rad.
    """
    s = np.arange(0.0, road.length, _STEP_M)
    C = road.curvature(s)
    side = np.sign(C) * (np.abs(C) > threshold)
    changes = np.flatnonzero(side != np.roll(side, 1))
    found: list[Corner] = []
    for begin, after in zip(changes, np.roll(changes, -1), strict=True):
        count = (after - begin) % s.size
        inside = (begin + np.arange(count)) % s.size
        first, last = float(s[begin]), float(s[begin]) + (count - 1) * _STEP_M
        turned = abs(float(road.heading(last) - road.heading(first)))
        if side[begin] == 0 or turned <= least_turn:
            continue
        sharpest = float(s[inside[np.argmax(np.abs(C[inside]))]])
        found.append(Corner(len(found) + 1, sharpest, "R" if side[begin] > 0 else "L", first, last, turned))
    return tuple(found)
