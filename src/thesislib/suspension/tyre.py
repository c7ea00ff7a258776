"""How far the wheel centre stands above the road: the loaded radius of the tyre, equation (3.18)."""

from __future__ import annotations

from typing import Any

COEFFICIENTS = (0.326, 4.00e-6, 4.075e-11)
"""Radius in m of an unloaded tyre, and its change with the normal load in N and its square, (3.18)."""


def loaded_radius(F: Any, *, rigid: bool = False) -> Any:
    """Return R_fw in m under the vertical tyre force `F` in N (SAE: negative when the tyre carries).

    Parameters
    ----------
    F : float, numpy.ndarray or casadi expression
        Vertical tyre force, N.
    rigid : bool
        Whether to leave the squash out, as figures 3.6 and 3.7 do.
    """
    unloaded, slope, curvature = COEFFICIENTS
    if rigid:
        return unloaded + 0.0 * F
    return unloaded + slope * F + curvature * F**2


def vertical_stiffness(F: Any) -> Any:
    """Return the tyre's stiffness in N/m at the vertical tyre force `F` in N, 1 / (dR/dF)."""
    _, slope, curvature = COEFFICIENTS
    return 1.0 / (slope + 2.0 * curvature * F)


def force_at_radius(R: Any, *, xp: Any) -> Any:
    """Return the vertical tyre force in N at the loaded radius `R` in m; 0 where the tyre has left the road.

    Parameters
    ----------
    R : float, numpy.ndarray or casadi expression
        Distance of wheel centre and contact point, m.
    xp : module
        numpy or casadi: whose ``sqrt`` and ``fmin`` to use.
    """
    unloaded, slope, curvature = COEFFICIENTS
    squash = xp.fmin(R - unloaded, 0.0)
    # the root that is zero at no squash, written without cancellation
    return 2.0 * squash / (slope + xp.sqrt(slope**2 + 4.0 * curvature * squash))
