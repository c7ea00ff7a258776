"""Tyre forces under combined slip with load-dependent friction peaks (thesis appendix B).

Sign convention. The thesis prints (B.14) and (B.15) with F_z, which is negative in SAE axes, and two
definitions of the slip angle of opposite sign, (4.15) and (B.2); no single reading of them is consistent.
Here the normal load is N = -F_z >= 0, the slip angle is that of (4.15), tan(alpha) = +v_w/u_w, and
kappa > 0 drives the wheel. A tyre force then opposes the sliding of its contact patch: F_x has the sign of
kappa, F_y the opposite sign of alpha.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from thesislib.smoothing import smooth_maximum, smooth_minimum
from thesislib.vehicles.elementary import elementary, square
from thesislib.vehicles.readings import LoadRange, ShapeFactor

# Under the root of (B.9). The direction (kappa_n, alpha_n)/rho has no limit at rho = 0; this rounds the
# corner over rho of about 1e-3, a hundredth of the slip at which a tyre works.
SLIP_FLOOR = 1e-6

LOAD_CORNER = 50.0**2
"""In N²: a load held at the end of its range turns the corner within some 50 N."""


@dataclass(frozen=True)
class TyreForces:
    """Forces of one tyre in its own axes, and the slip they come from.

    Attributes
    ----------
    F_x, F_y : float, numpy.ndarray or casadi expression
        Longitudinal and lateral force, N (SAE: x forward, y right).
    mu_x, mu_y
        Friction coefficients at this combined slip, (B.10), (B.11).
    rho
        Combined slip, (B.9).
    """

    F_x: Any
    F_y: Any
    mu_x: Any
    mu_y: Any
    rho: Any


def tyre_forces(
    N: Any,
    kappa: Any,
    alpha: Any,
    p: Mapping[str, Any],
    shape_factor: ShapeFactor = "printed",
    load_range: LoadRange = "extrapolated",
) -> TyreForces:
    """Return the forces of one tyre, equations (B.3) to (B.15).

    Parameters
    ----------
    N : float, numpy.ndarray or casadi expression
        Normal load, N, positive; -F_z of the thesis.
    kappa : same
        Longitudinal slip (B.1), positive when the wheel is driven.
    alpha : same
        Slip angle, rad, with the sign of (4.15).
    p : mapping
        Parameters of Table B.1 by name, SI.
    shape_factor : {"printed", "peak_at_one"}
        Reading of S in (B.12), (B.13).
    load_range : {"extrapolated", "held"}
        Whether peaks and their slips follow the load beyond ``F_z1`` and ``F_z2`` or are held there.
    """
    xp = elementary(N, kappa, alpha, *p.values())
    # (B.3)-(B.6): all four peak quantities are linear in the load
    load = N
    if load_range == "held":
        load = smooth_minimum(smooth_maximum(N, LOAD_CORNER, p["F_z1"]), LOAD_CORNER, p["F_z2"])
    share = (load - p["F_z1"]) / (p["F_z2"] - p["F_z1"])
    mu_x_max = p["mu_x1"] + share * (p["mu_x2"] - p["mu_x1"])
    mu_y_max = p["mu_y1"] + share * (p["mu_y2"] - p["mu_y1"])
    kappa_max = p["kappa_1"] + share * (p["kappa_2"] - p["kappa_1"])
    alpha_max = p["alpha_1"] + share * (p["alpha_2"] - p["alpha_1"])
    kappa_n = kappa / kappa_max
    alpha_n = alpha / alpha_max
    rho = xp.sqrt(square(alpha_n) + kappa_n * kappa_n + SLIP_FLOOR)
    # rho first: a numpy scalar before an enclosure would take it for an array
    mu_x = mu_x_max * xp.sin(p["Q_x"] * xp.arctan(rho * stiffness_factor(p["Q_x"], shape_factor)))
    mu_y = mu_y_max * xp.sin(p["Q_y"] * xp.arctan(rho * stiffness_factor(p["Q_y"], shape_factor)))
    return TyreForces(
        F_x=mu_x * N * kappa_n / rho, F_y=-mu_y * N * alpha_n / rho, mu_x=mu_x, mu_y=mu_y, rho=rho
    )


def stiffness_factor(Q: Any, shape_factor: ShapeFactor = "printed") -> Any:
    """Return S of (B.12), (B.13) for the shape factor ``Q``, or S = tan(pi/(2Q)), which peaks at rho = 1."""
    xp = elementary(Q)
    if shape_factor == "printed":
        return math.pi / (2 * xp.arctan(Q))
    return xp.tan(math.pi / (2 * Q))


def peak_combined_slip(Q: float, shape_factor: ShapeFactor = "printed") -> float:
    """Return the rho at which sin(Q arctan(S rho)) is 1, for a shape factor ``Q`` above 1.

    Raises
    ------
    ValueError
        If ``Q`` is not above 1: the friction curve then rises for ever.
    """
    if not Q > 1.0:
        raise ValueError(f"A tyre with shape factor Q = {Q} has no friction peak; Q must exceed 1.")
    return math.tan(math.pi / (2 * Q)) / float(stiffness_factor(Q, shape_factor))
