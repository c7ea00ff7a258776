"""Mid-corner trims: for each corner the place where the car is nearest to a steady turn.

There the lateral motion may be frozen: speed, steer, slips and loads are held, and what is left is a system
in lateral speed and yaw rate alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from thesislib.lap.channels import Array, Lap, along_lap
from thesislib.roads import Corner
from thesislib.vehicles.racing_car import CONTROLS

HARD = 0.9
"""Part of a corner's largest lateral acceleration that the car has to have at its trim."""

_STEP_M = 1.0
_UNITS = {"s": "m", "u": "m/s", "v": "m/s", "omega": "rad/s", "delta": "rad"}


def mid_corner_trims(
    lap: Lap, corners: Sequence[Corner], *, radius_of_gyration: float
) -> dict[str, tuple[Array, str]]:
    """Return the car's motion and control at the mid-corner trim of each corner.

    Of the places, in steps of a metre, where the lateral acceleration is at least `HARD` times the corner's
    largest, the trim is that with the smallest dv/dt² + k² (domega/dt)².

    Parameters
    ----------
    lap : Lap
        With the channels of `RacingCar.quantities`.
    corners : sequence of Corner
        Of its road.
    radius_of_gyration : float
        k = sqrt(I_z/M), m.

    Returns
    -------
    dict
        Columns with their units: ``corner``, ``s`` m, ``u`` and ``v`` m/s, ``omega`` rad/s, and the control
        (4.26) under the names of `CONTROLS`: rad, slips, and N (negative).
    """
    inverse = 1 / lap["slowness"]
    unsteady = np.hypot(lap["dv_ds"] * inverse, radius_of_gyration * lap["domega_ds"] * inverse)
    places = []
    for corner in corners:
        s = np.arange(corner.begin, corner.end + _STEP_M / 2, _STEP_M)
        pull = np.abs(along_lap(lap, lap["a_y"], s))
        hard = s[pull >= HARD * pull.max()]
        places.append(hard[np.argmin(along_lap(lap, unsteady, hard))] % lap.track.length)
    s = np.array(places)
    columns = {"corner": np.array([float(corner.number) for corner in corners]), "s": s}
    columns |= {name: along_lap(lap, lap[name], s) for name in ("u", "v", "omega", *CONTROLS)}
    return {
        name: (values, _UNITS.get(name, "N" if name.startswith("F_") else ""))
        for name, values in columns.items()
    }
