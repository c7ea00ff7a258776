"""Cornering force of an axle against its slip angle: the Magic Formula and the fits (7.12) and (7.13).

Forces are those of the whole axle, in N, with the sign of SAE axes: a positive slip angle gives a
negative force.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from thesislib.vehicles.parameters import ParameterSet

FIT_RANGE = 0.7
"""Slip angles over which the fits are made, +- rad."""

_DIGITS = (
    6  # of a fitted coefficient: the fit is then a model that can be quoted, and its errors are the same
)

_NEAR = 0.05  # rad: how far from its trim a fit in a corner has to be close


class Tyre(Protocol):
    """What a car asks of an axle."""

    def force(self, alpha: Any) -> Any:
        """Return the lateral force in N at a slip angle in rad."""

    def slope(self, alpha: Any) -> Any:
        """Return its derivative in N/rad; at zero this is the cornering stiffness (7.35), negative."""


@dataclass(frozen=True)
class MagicFormula:
    """F = D sin(C arctan(B (1 - E) alpha + E arctan(B alpha))).

    Attributes
    ----------
    B, C, D, E : float
        Stiffness, shape, peak (N, negative) and curvature factor.
    """

    B: float
    C: float
    D: float
    E: float

    @classmethod
    def from_file(cls, axle: str, name: str = "dry_road_axles") -> MagicFormula:
        """Read the "front" or the "rear" axle of ``data/tyres/<name>.toml``."""
        values = ParameterSet.from_file(name, "tyres").values
        return cls(*(values[f"{letter}_{axle}"] for letter in "BCDE"))

    def scaled(self, *, peak: float = 1.0, stiffness: float = 1.0) -> MagicFormula:
        """Return this tyre with D and B multiplied: more force at all slips, or a steeper rise."""
        return MagicFormula(self.B * stiffness, self.C, self.D * peak, self.E)

    def force(self, alpha: Any) -> Any:
        """Return the lateral force in N."""
        return self.D * np.sin(self.C * np.arctan(self._bent(alpha)))

    def slope(self, alpha: Any) -> Any:
        """Return dF/dalpha in N/rad."""
        bent = self._bent(alpha)
        inner = self.B * (1 - self.E) + self.E * self.B / (1 + (self.B * alpha) ** 2)
        return self.D * np.cos(self.C * np.arctan(bent)) * self.C / (1 + bent**2) * inner

    def _bent(self, alpha: Any) -> Any:
        return self.B * (1 - self.E) * alpha + self.E * np.arctan(self.B * alpha)


@dataclass(frozen=True)
class RationalTyre:
    """F = numerator(alpha) / denominator(alpha), each by its coefficients, constant term first.

    With the denominator (1,) this is the polynomial of (7.12).
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...] = (1.0,)

    def force(self, alpha: Any) -> Any:
        """Return the lateral force in N."""
        polyval = np.polynomial.polynomial.polyval
        return polyval(alpha, self.numerator) / polyval(alpha, self.denominator)

    def slope(self, alpha: Any) -> Any:
        """Return dF/dalpha in N/rad."""
        polynomial = np.polynomial.Polynomial
        n, d = polynomial(self.numerator), polynomial(self.denominator)
        return (n.deriv()(alpha) * d(alpha) - n(alpha) * d.deriv()(alpha)) / d(alpha) ** 2

    @property
    def odd(self) -> bool:
        """Whether F(-alpha) = -F(alpha)."""
        return not any(self.numerator[::2]) and not any(self.denominator[1::2])


def cubic_tyre() -> RationalTyre:
    """Return the axle of the literature comparison, ``data/tyres/cubic_axles.toml``."""
    values = ParameterSet.from_file("cubic_axles", "tyres").values
    stiffness = values["stiffness"]
    return RationalTyre((0.0, -stiffness, 0.0, stiffness * values["cubic"]))


def polynomial_fit(tyre: Tyre, order: int, reach: float = FIT_RANGE) -> RationalTyre:
    """Return the least-squares polynomial (7.12) of an odd tyre, of odd powers up to `order`.

    Raises
    ------
    ValueError
        If the order is not odd and positive.
    """
    if order < 1 or order % 2 == 0:
        raise ValueError(f"order = {order} of the polynomial fit (7.12) is not an odd number from 1 on.")
    alpha = _samples(reach)
    powers = np.arange(1, order + 1, 2)
    found, *_ = np.linalg.lstsq((alpha[:, None] / reach) ** powers, tyre.force(alpha), rcond=None)
    coefficients = np.zeros(order + 1)
    coefficients[powers] = found / reach**powers
    return RationalTyre(_quotable(coefficients))


def rational_fit(tyre: Tyre, reach: float = FIT_RANGE) -> RationalTyre:
    """Return the least-squares fit (7.13) of an odd tyre; p_2 is zero by symmetry.

    Raises
    ------
    ValueError
        If the fit degenerates: its quartic term does not matter within the reach (q_1 grows without end),
        or its denominator has a root.
    """
    alpha = _samples(reach)
    force = tyre.force(alpha)
    largest = np.abs(force).max()
    start = np.array([force[-1] / largest * reach, 0.05 * float(tyre.slope(0.0)) / largest, 1.5, 0.05])

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        p_1, p_3, q_1, q_2 = x
        residual: NDArray[np.float64] = (p_1 * alpha**3 + p_3 * alpha) / (
            alpha**4 + q_1 * alpha**2 + q_2
        ) - force / largest
        return residual

    found = least_squares(residuals, start, x_scale=np.abs(start), xtol=1e-13, ftol=1e-13, max_nfev=400)
    p_1, p_3, q_1, q_2 = found.x
    if q_1 > 20.0:
        raise ValueError(
            f"The rational fit (7.13) over +-{reach:g} rad degenerates: q_1 = {q_1:.3g} is above 20, the "
            "quartic term does not matter; fit over a wider range, 0.7 to 1 rad."
        )
    if q_2 <= 0 or (q_1 < 0 and q_1**2 >= 4 * q_2):
        raise ValueError(
            f"The rational fit (7.13) over +-{reach:g} rad degenerates: its denominator has a root "
            f"(q_1 = {q_1:.3g}, q_2 = {q_2:.3g})."
        )
    numerator = _quotable(np.array([0.0, p_3 * largest, 0.0, p_1 * largest]))
    return RationalTyre(numerator, _quotable(np.array([q_2, 0.0, q_1, 0.0, 1.0])))


@dataclass(frozen=True)
class CorneringFit:
    """Side force and yaw moment of an axle over its slip, as rational functions with one denominator.

    Attributes
    ----------
    force, moment : RationalTyre
        N and N m.
    """

    force: RationalTyre
    moment: RationalTyre


def cornering_fit(
    alpha: NDArray[np.float64], force: NDArray[np.float64], moment: NDArray[np.float64], trim: float
) -> CorneringFit:
    """Return the fit of an axle whose tyres are loaded and driven unequally, close about its trim.

    The form is that of (7.13) with a constant and a quadratic term, as no symmetry is left; errors count
    less the further they are from the trim, half as much at 0.05 rad.

    Parameters
    ----------
    alpha : array, shape (n,)
        Slips, rad, on both sides of zero.
    force, moment : array, shape (n,)
        N and N m there.
    trim : float
        Slip of the trim, rad.

    Raises
    ------
    ValueError
        If the fit degenerates.
    """
    reach = float(np.abs(alpha).max())
    weight = 1 / (1 + ((alpha - trim) / _NEAR) ** 2)
    powers = (alpha[:, None] / reach) ** np.arange(5)
    values = np.stack([force, moment], axis=-1)

    def fitted(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        basis = powers[:, :4] / (powers[:, ::2] @ np.array([*np.exp(x), 1.0]))[:, None]
        numerators, *_ = np.linalg.lstsq(basis * weight[:, None], values * weight[:, None], rcond=None)
        return numerators, basis @ numerators

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        misses = (fitted(x)[1] - values) * weight[:, None] / np.abs(force).max()
        return np.asarray(misses.ravel())

    found = least_squares(residuals, np.log([0.2, 1.8]), bounds=(np.log(1e-3), np.log(100.0)))
    if found.active_mask.any():
        raise ValueError(
            f"The rational fit of an axle about {np.degrees(trim):.3g}° of slip degenerates: a coefficient "
            "of its denominator runs to the end of 0.001 .. 100."
        )
    q_2, q_1 = np.exp(found.x) * reach ** np.array([4, 2])
    denominator = _quotable([q_2, 0.0, q_1, 0.0, 1.0])
    numerators = fitted(found.x)[0] * reach ** (4.0 - np.arange(4))[:, None]
    return CorneringFit(*(RationalTyre(_quotable(each), denominator) for each in numerators.T))


def _samples(reach: float) -> NDArray[np.float64]:
    if not 0.0 < reach <= 1.5:
        raise ValueError(f"reach = {reach:g} rad of a tyre fit is outside 0 .. 1.5.")
    return np.linspace(-reach, reach, 1401)


def _quotable(coefficients: ArrayLike) -> tuple[float, ...]:
    return tuple(float(f"{c:.{_DIGITS}g}") for c in np.asarray(coefficients))
