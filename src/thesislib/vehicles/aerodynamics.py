"""Downforce and drag of the racing car, responsive to its attitude (thesis section 4.2.6, Table 4.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Attitude:
    """How the body stands on the road and in the wind.

    Attributes
    ----------
    h_f, h_r : float, numpy.ndarray or casadi expression
        Front and rear ride height in m, positive down (SAE), relative to the car's reference plane.
    phi_f, phi_r
        Front and rear roll angle, rad.
    beta
        Side-slip angle of the mass centre, rad.
    delta
        Steer angle, rad.
    """

    h_f: Any
    h_r: Any
    phi_f: Any
    phi_r: Any
    beta: Any
    delta: Any


@dataclass(frozen=True)
class AeroCoefficients:
    """Downforce coefficients of the two axles and drag coefficient, pure numbers, all positive."""

    C_L_front: Any
    C_L_rear: Any
    C_D: Any


def aero_coefficients(attitude: Attitude, p: Mapping[str, Any], *, angles: bool = True) -> AeroCoefficients:
    """Return the coefficients of Table 4.1.

    Parameters
    ----------
    attitude : Attitude
        Ride heights in m and angles in rad.
    p : mapping
        The twenty-one numbers of the table, ``C_L_front_0`` … ``C_D_phi2``.
    angles : bool
        Whether the rows of side slip, steer and roll are in force.
    """

    def coefficient(name: str, phi: Any) -> Any:
        heights = (
            p[f"{name}_0"]
            + p[f"{name}_h_f"] * attitude.h_f
            + p[f"{name}_h_r"] * attitude.h_r
            + p[f"{name}_h_r2"] * attitude.h_r**2
        )
        if not angles:
            return heights
        return (
            heights
            + p[f"{name}_beta2"] * attitude.beta**2
            + p[f"{name}_delta2"] * attitude.delta**2
            + p[f"{name}_phi2"] * phi**2
        )

    # Table 4.1 speaks of one roll angle. (4.19) makes the two equal; each axle takes its own, which is
    # what the wing above it sees should they differ, and drag, which has no roll row, takes the rear one.
    return AeroCoefficients(
        coefficient("C_L_front", attitude.phi_f),
        coefficient("C_L_rear", attitude.phi_r),
        coefficient("C_D", attitude.phi_r),
    )


@dataclass(frozen=True)
class AeroForces:
    """Aerodynamic forces in N, SAE: downforces positive down, drag negative along x."""

    F_az_front: Any
    F_az_rear: Any
    F_ax: Any


def aero_forces(u: Any, coefficients: AeroCoefficients, p: Mapping[str, Any]) -> AeroForces:
    """Return downforces (4.22), (4.23) and drag (4.24) at the forward speed ``u`` in m/s."""
    pressure_area = 0.5 * p["air_density"] * p["frontal_area"] * u**2
    return AeroForces(
        coefficients.C_L_front * pressure_area,
        coefficients.C_L_rear * pressure_area,
        -coefficients.C_D * pressure_area,
    )
