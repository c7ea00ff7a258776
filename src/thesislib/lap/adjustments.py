"""What a set-up may change in one solve: the offsets of section 4.4, and what each does to the car.

An adjustment is a static parameter of the optimal control problem. It changes numbers of the car and
nothing else, so that the model stays the one function `RacingCar.quantities`. A nominal downforce coefficient
pays for changed sensitivities by the water-bed constraint (4.30): the area under the aerodynamic map stays.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from thesislib import ocp
from thesislib.vehicles.parameters import unknown_name

AXLES = ("front", "rear")
ANGLES = ("beta2", "delta2", "phi2")

BALANCE = "a_off"
"""Fixed aerodynamic balance: moved from the front to the rear nominal downforce coefficient."""

CONTINUOUS_BALANCE = "u_CoP"
"""The same as a control of row (Q), free at every point of the lap."""


@dataclass(frozen=True)
class Adjustment:
    """A static parameter of the set-up.

    Attributes
    ----------
    name : str
        Its name in problem and solution.
    unit : str
        SI.
    scale : float
        Size that the solver takes for one.
    bound : float
        Largest size that Table 4.2 allows.
    changes : str
        The number of the car that it is added to; empty for `BALANCE`.
    shown_in : str
        Unit in which Table 4.2 prints it.
    factor : float
        From SI to that unit.
    """

    name: str
    unit: str
    scale: float
    bound: float
    changes: str
    shown_in: str = ""
    factor: float = 1.0


ADJUSTMENTS = {
    one.name: one
    for one in (
        Adjustment("dh_f", "m", 0.01, 0.010, "h_f_unloaded", "mm", 1e3),
        Adjustment("dh_r", "m", 0.01, 0.030, "h_r_unloaded", "mm", 1e3),
        Adjustment("dC_L_front_beta2", "1/rad²", 5.0, 5.0, "C_L_front_beta2"),
        Adjustment("dC_L_rear_beta2", "1/rad²", 5.0, 10.0, "C_L_rear_beta2"),
        Adjustment("dC_L_front_delta2", "1/rad²", 0.5, 0.15, "C_L_front_delta2"),
        Adjustment("dC_L_rear_delta2", "1/rad²", 0.5, 0.15, "C_L_rear_delta2"),
        Adjustment("dC_L_front_phi2", "1/rad²", 20.0, 5.0, "C_L_front_phi2"),
        Adjustment("dC_L_rear_phi2", "1/rad²", 20.0, 20.0, "C_L_rear_phi2"),
        Adjustment(BALANCE, "-", 0.1, 1.0, ""),
        Adjustment("dK_h_front", "N/m", 5e5, 500e3, "K_h_front", "kN/m", 1e-3),
        Adjustment("dK_h_rear", "N/m", 5e5, 300e3, "K_h_rear", "kN/m", 1e-3),
    )
}
"""Everything that Table 4.2 adjusts, with its bounds."""


@dataclass(frozen=True)
class MapRanges:
    """Ranges of the angles over which (4.30) keeps the area under the aerodynamic map, rad.

    Attributes
    ----------
    beta : float
        Side slip. 8°, not the printed 4π/45 = 16°: only with 8° do rows (G) and (J) come out as in
        Table 4.2.
    delta, phi : float
        Steer, 15°, and roll, 2°, as printed.
    """

    beta: float = 2.0 * math.pi / 45.0
    delta: float = math.pi / 12.0
    phi: float = math.pi / 90.0

    def __post_init__(self) -> None:
        for name in ("beta", "delta", "phi"):
            value = getattr(self, name)
            if not 0.0 < value <= math.pi / 2:
                raise ValueError(f"{name}_max = {value:g} rad of the aerodynamic map is outside 0 .. π/2.")

    def price(self, angle: str) -> float:
        """Return what (4.30) takes from a nominal coefficient per unit of a sensitivity, rad²."""
        return float(getattr(self, angle.removesuffix("2")) ** 2 / 3.0)


MAP_RANGES = MapRanges()


def bounds_of(names: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Return the bounds of Table 4.2 for adjustments by name.

    Raises
    ------
    KeyError
        If there is no such adjustment; the message lists them.
    """
    return {name: (-find(name).bound, find(name).bound) for name in names}


def find(name: str) -> Adjustment:
    """Return an adjustment by name; raises KeyError as `bounds_of` does."""
    if name not in ADJUSTMENTS:
        raise KeyError(unknown_name(name, ADJUSTMENTS, "Table 4.2"))
    return ADJUSTMENTS[name]


def parameters(free: Mapping[str, tuple[float, float]], values: Mapping[str, float]) -> list[ocp.Parameter]:
    """Return the static parameters of a problem: what is free, within its bounds, and the rest held at zero.

    What is held costs the solver nothing and keeps the equations of all rows of Table 4.2 the same, so that
    they share compiled derivatives and start from each other.

    Parameters
    ----------
    free : mapping of str to (float, float)
        Bounds by the adjustment's name, SI.
    values : mapping
        Numbers of the car; an adjustment of a number that it does not have is left out.

    Raises
    ------
    KeyError
        If a free adjustment is unknown.
    ValueError
        If a free adjustment changes what the car does not have, or its bounds do not contain zero.
    """
    for name, (low, high) in free.items():
        one = find(name)
        if one.changes and one.changes not in values:
            raise ValueError(
                f"{name} changes {one.changes}, which this car's suspension does not have: "
                "heave stiffness needs the metamodel of Table 3.2."
            )
        if not low <= 0.0 <= high:
            raise ValueError(f"bounds {low:g} .. {high:g} {one.unit} of {name} do not contain zero.")
    return [
        ocp.Parameter(one.name, one.unit, free.get(one.name, (0.0, 0.0)), one.scale)
        for one in ADJUSTMENTS.values()
        if not one.changes or one.changes in values
    ]


def adjusted(
    values: Mapping[str, Any], offsets: Mapping[str, Any], ranges: MapRanges = MAP_RANGES
) -> dict[str, Any]:
    """Return the numbers of a car after its adjustments.

    Parameters
    ----------
    values : mapping
        Numbers of the car by name: floats, arrays or casadi expressions.
    offsets : mapping
        Adjustments by name, and `CONTINUOUS_BALANCE`; those that are missing are zero.
    ranges : MapRanges
        Of the water-bed constraint (4.30).

    Returns
    -------
    dict
    """
    moved = dict(values)
    for one in ADJUSTMENTS.values():
        if one.changes and one.name in offsets:
            moved[one.changes] = moved[one.changes] + offsets[one.name]
    rearwards = offsets.get(BALANCE, 0.0) + offsets.get(CONTINUOUS_BALANCE, 0.0)
    for axle, sign in zip(AXLES, (-1.0, 1.0), strict=True):
        spent = sum(ranges.price(angle) * offsets.get(f"dC_L_{axle}_{angle}", 0.0) for angle in ANGLES)
        moved[f"C_L_{axle}_0"] = moved[f"C_L_{axle}_0"] + sign * rearwards - spent
    return moved
