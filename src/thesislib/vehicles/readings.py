"""The choices about the racing car that the thesis leaves open, by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

DragMoment = Literal["ground", "mass_centre"]
PowerLaw = Literal["wheel", "hub"]
ShapeFactor = Literal["printed", "peak_at_one"]
Brake = Literal["equal_front_forces", "free"]
Suspension = Literal["metamodel", "rigid"]
LoadRange = Literal["extrapolated", "held"]


@dataclass(frozen=True)
class Readings:
    """How the open places of the thesis's racing car are read; the defaults reproduce the printed forms.

    Attributes
    ----------
    drag_moment : {"ground", "mass_centre"}
        (4.18) as printed has h F_x with the drag inside F_x, which is drag acting at ground level;
        "mass_centre" takes it out of the moment, as the text of section 4.2.6 says.
    power_law : {"wheel", "hub"}
        The engine's power is the sum over the rear wheels of R Omega F_x, slip losses included ("wheel"), or
        of u F_x ("hub").
    shape_factor : {"printed", "peak_at_one"}
        S = pi / (2 arctan Q) of (B.12), with the friction peak below rho = 1, or S = tan(pi / (2 Q)) with the
        peak at rho = 1.
    brake : {"equal_front_forces", "free"}
        (4.20) with no wheel locked, F_flx = F_frx, or no such constraint.
    fixed_brake_ratio : float or None
        Share of the front axle in the force of the brakes, 0 < share < 1. What the rear axle has besides its
        share is the engine's drive, which is not negative: it may push against the brakes. None leaves the
        forces of the axles free of each other.
    suspension : {"metamodel", "rigid"}
        Ride heights and roll angles from the car's ride-height model, or frozen at the nominal ride
        heights without roll; then (4.19) is no constraint.
    aero_angles : bool
        Whether the last three rows of Table 4.1 (side slip, steer, roll) are in force.
    tyre_load_range : {"extrapolated", "held"}
        Peaks and slips of the tyre at loads outside those of Table B.1, 2 to 6 kN: on the straight lines
        (B.3)-(B.6), or held at what they are at the end of the range.

    Raises
    ------
    ValueError
        If a choice is unknown or the brake ratio is outside its range.
    """

    drag_moment: DragMoment = "ground"
    power_law: PowerLaw = "wheel"
    shape_factor: ShapeFactor = "printed"
    brake: Brake = "equal_front_forces"
    fixed_brake_ratio: float | None = None
    suspension: Suspension = "metamodel"
    aero_angles: bool = True
    tyre_load_range: LoadRange = "extrapolated"

    def __post_init__(self) -> None:
        for name, choices in (
            ("drag_moment", DragMoment),
            ("power_law", PowerLaw),
            ("shape_factor", ShapeFactor),
            ("brake", Brake),
            ("suspension", Suspension),
            ("tyre_load_range", LoadRange),
        ):
            allowed = get_args(choices)
            if getattr(self, name) not in allowed:
                raise ValueError(
                    f"Reading {name} = {getattr(self, name)!r} is not one of {', '.join(allowed)}."
                )
        share = self.fixed_brake_ratio
        if share is not None and not 0.0 < share < 1.0:
            raise ValueError(
                f"Reading fixed_brake_ratio = {share} is outside 0 .. 1 (front share of braking)."
            )
