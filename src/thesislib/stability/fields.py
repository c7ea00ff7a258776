"""The car's motion as polynomials: the rational field (7.25) in slip coordinates about its trim, exactly.

With alpha_i = alpha_i* + D z_i, slips counted from the trim and in units of D, the motion is z' = n(z)/d(z)
in units of time tau, and d is the product of both tyres' denominators, each divided by its value at the
trim. All coefficients are rational numbers, so that a certificate speaks of this model and not of one close
to it. A trim in a corner is no rational number; its slips are rounded to 40 binary digits, and steering
angle and rear tyre factor are adjusted by less than 1e-9 so that the rounded one is an equilibrium exactly.
A car that passes through a corner is in no equilibrium; a constant side force and yaw moment, those of its
own inertia at that moment, make it one, and its axles may add a yaw moment to their side force.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import comb
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from thesislib.stability.bicycle import Bicycle
from thesislib.stability.bivariate import Polynomial
from thesislib.stability.tyres import RationalTyre, Tyre

SCALE = Fraction(1, 4)
"""D, rad: a set of the size of a quarter radian has coefficients of similar size at every degree."""

TIME_UNIT = Fraction(1, 8)
"""tau, s."""

_NONE = (Fraction(0),)


@dataclass(frozen=True)
class ExactCar:
    """A single-track car with rational tyres, in rational numbers, at one of its equilibria.

    Attributes
    ----------
    mass, I_z, a, b, u_0, delta : Fraction
        As of `Bicycle`.
    front, rear : tuple of two tuples of Fraction
        Numerator and denominator of each axle's force, constant term first.
    front_factor, rear_factor : Fraction
        Multiply the forces.
    trim : tuple of two Fractions
        Slip angles (alpha_f*, alpha_r*) of the equilibrium, rad.
    acceleration : Fraction
        du/dt, m/s²; not zero for straight running only.
    front_moment, rear_moment : tuple of Fraction
        Numerators, over the denominators of the forces, of the yaw moment in N m that an axle's longitudinal
        forces add to a F_f or -b F_r; empty for none.
    forcing : tuple of two Fractions
        Constant side force in N and yaw moment in N m, subtracted from those of the axles.
    scale : Fraction
        D, rad.
    """

    mass: Fraction
    I_z: Fraction
    a: Fraction
    b: Fraction
    u_0: Fraction
    delta: Fraction
    front: tuple[tuple[Fraction, ...], tuple[Fraction, ...]]
    rear: tuple[tuple[Fraction, ...], tuple[Fraction, ...]]
    front_factor: Fraction = Fraction(1)
    rear_factor: Fraction = Fraction(1)
    trim: tuple[Fraction, Fraction] = (Fraction(0), Fraction(0))
    acceleration: Fraction = Fraction(0)
    front_moment: tuple[Fraction, ...] = ()
    rear_moment: tuple[Fraction, ...] = ()
    forcing: tuple[Fraction, Fraction] = (Fraction(0), Fraction(0))
    scale: Fraction = SCALE

    @classmethod
    def at_trim(
        cls, car: Bicycle, *, factors: tuple[float, float] = (1.0, 1.0), acceleration: float = 0.0
    ) -> ExactCar:
        """Return a car at its trim.

        Parameters
        ----------
        car : Bicycle
            With rational tyres and slip angles (7.10), (7.11).
        factors : tuple of float
            Multiply the front and the rear axle's force; with others than one, the car must run straight.
        acceleration : float
            du/dt in m/s²; if not zero, the car must run straight.

        Raises
        ------
        TypeError
            If a tyre is not rational.
        ValueError
            If the slip angles are not linear, the car has no stable trim, or a car in a corner is given
            factors or an acceleration.
        """
        if car.slip != "linear":
            raise ValueError("A rational field needs the linear slip angles (7.10) and (7.11).")
        exact = cls(
            **exact_body(car),
            front=exact_tyre(car.front),
            rear=exact_tyre(car.rear),
            front_factor=decimal(factors[0]),
            rear_factor=decimal(factors[1]),
            acceleration=decimal(acceleration),
        )
        if car.delta == 0.0:
            return exact
        if acceleration != 0.0 or factors != (1.0, 1.0):
            raise ValueError("Tyre factors and accelerations move the equilibrium of a car in a corner.")
        return exact._balanced(car.slip_angles(car.to_slip(car.trim())))

    def _balanced(self, angles: NDArray[np.float64]) -> ExactCar:
        """Return the car whose equilibrium has these slip angles, rounded, exactly."""
        alpha_f, alpha_r = (Fraction(round(float(alpha) * 2**40), 2**40) for alpha in angles)
        F_f, F_r = _ratio(self.front, alpha_f), _ratio(self.rear, alpha_r)
        factor = self.a * F_f / (self.b * F_r)
        w = (F_f + factor * F_r) / (self.mass * self.u_0)
        delta = alpha_r + w * (self.a + self.b) / self.u_0 - alpha_f
        values: dict[str, Any] = {
            **self.__dict__,
            "delta": delta,
            "rear_factor": factor,
            "trim": (alpha_f, alpha_r),
        }
        return ExactCar(**values)

    def held_at(self, alpha_f: float, alpha_r: float) -> ExactCar:
        """Return the car with these slip angles, rounded to 40 binary digits, held as its equilibrium.

        A constant side force and yaw moment do it; steering angle and factors stay as they are.
        """
        trim = (Fraction(round(alpha_f * 2**40), 2**40), Fraction(round(alpha_r * 2**40), 2**40))
        F_f, F_r = (
            self.front_factor * _ratio(self.front, trim[0]),
            self.rear_factor * _ratio(self.rear, trim[1]),
        )
        M_f, M_r = (
            _ratio((moment or _NONE, tyre[1]), alpha)
            for moment, tyre, alpha in zip(
                (self.front_moment, self.rear_moment), (self.front, self.rear), trim, strict=True
            )
        )
        w = self.u_0 * (trim[0] + self.delta - trim[1]) / (self.a + self.b)
        side = F_f + F_r - self.mass * self.u_0 * w
        return replace(self, trim=trim, forcing=(side, self.a * F_f - self.b * F_r + M_f + M_r))

    @cached_property
    def field(self) -> Field:
        """The field about the equilibrium."""
        (N_f, D_f), (N_r, D_r) = (
            _about(tyre, alpha, axis, self.scale)
            for axis, (tyre, alpha) in enumerate(zip((self.front, self.rear), self.trim, strict=True))
        )
        M_f, _ = _about((self.front_moment or _NONE, self.front[1]), self.trim[0], 0, self.scale)
        M_r, _ = _about((self.rear_moment or _NONE, self.rear[1]), self.trim[1], 1, self.scale)
        F_f, F_r = N_f * D_r * exact(self.front_factor), N_r * D_f * exact(self.rear_factor)
        d = D_f * D_r
        s_f, s_r = (
            Polynomial.from_terms({(0, 0): exact(offset), axis: exact(self.scale)})
            for offset, axis in ((self.trim[0] + self.delta, (1, 0)), (self.trim[1], (0, 1)))
        )
        yaw = (s_f - s_r) * exact(self.u_0 / (self.a + self.b))
        sum_ = F_f + F_r - d * exact(self.forcing[0])
        moment = (
            F_f * exact(self.a) - F_r * exact(self.b) + M_f * D_r + M_r * D_f - d * exact(self.forcing[1])
        )
        rates = []
        for lever, s in ((self.a, s_f), (-self.b, s_r)):
            force = sum_ * exact(1 / (self.mass * self.u_0)) + moment * exact(lever / (self.I_z * self.u_0))
            slowing = s * exact(self.acceleration / self.u_0)
            rates.append((force - d * (yaw + slowing)) * exact(TIME_UNIT / self.scale))
        return Field((rates[0], rates[1]), d)


@dataclass(frozen=True)
class Field:
    """The right-hand side n/d of (7.25), with exact coefficients.

    Attributes
    ----------
    n : tuple of two Polynomials
    d : Polynomial
    """

    n: tuple[Polynomial, Polynomial]
    d: Polynomial

    @cached_property
    def floats(self) -> tuple[Polynomial, Polynomial, Polynomial]:
        """n_1, n_2 and d with the nearest floats as coefficients."""
        first, second, d = (to_floats(p) for p in (*self.n, self.d))
        return first, second, d

    @cached_property
    def odd(self) -> bool:
        """Whether n is odd and d even, so that V may be taken even."""
        return all((i + j) % 2 == 1 for n in self.n for i, j in n.support) and all(
            (i + j) % 2 == 0 for i, j in self.d.support
        )

    @cached_property
    def jacobian(self) -> NDArray[np.float64]:
        """Linearisation at the equilibrium, shape (2, 2), per unit of time tau."""
        rows = [[_coefficient(n, (1, 0)), _coefficient(n, (0, 1))] for n in self.floats[:2]]
        return np.array(rows) / _coefficient(self.floats[2], (0, 0))


def _coefficient(p: Polynomial, exponents: tuple[int, int]) -> float:
    inside = all(e < size for e, size in zip(exponents, p.coefficients.shape, strict=True))
    return float(p.coefficients[exponents]) if inside else 0.0


def decimal(value: float) -> Fraction:
    """Return the number that a float is written as: 1.2 is 6/5."""
    return Fraction(repr(float(value)))


def exact(value: Fraction) -> fmpq:
    """Return a fraction as python-flint's rational number."""
    return fmpq(value.numerator, value.denominator)


def to_floats(p: Polynomial) -> Polynomial:
    """Return a polynomial with the nearest floats as coefficients."""
    as_float = np.vectorize(
        lambda c: int(c.p) / int(c.q) if isinstance(c, fmpq) else float(c), otypes=[float]
    )
    return Polynomial(as_float(p.coefficients))


def exact_body(car: Any) -> dict[str, Any]:
    """Return the numbers of an `ExactCar` that are not its tyres', from a car that has them as floats."""
    return {name: decimal(getattr(car, name)) for name in ("mass", "I_z", "a", "b", "u_0", "delta")}


def exact_tyre(tyre: Tyre) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
    """Return numerator and denominator of a rational tyre.

    Raises
    ------
    TypeError
        If it is another.
    """
    if not isinstance(tyre, RationalTyre):
        raise TypeError(f"A rational field needs RationalTyre axles, not {type(tyre).__name__}.")
    return tuple(map(decimal, tyre.numerator)), tuple(map(decimal, tyre.denominator))


def _ratio(tyre: tuple[tuple[Fraction, ...], tuple[Fraction, ...]], alpha: Fraction) -> Fraction:
    numerator, denominator = (sum(c * alpha**k for k, c in enumerate(part)) for part in tyre)
    return Fraction(numerator) / Fraction(denominator)


def _about(
    tyre: tuple[tuple[Fraction, ...], tuple[Fraction, ...]], alpha: Fraction, axis: int, scale: Fraction
) -> tuple[Polynomial, Polynomial]:
    """Return numerator and denominator in z along an axis, divided by the denominator at alpha."""
    at_trim = sum(c * alpha**k for k, c in enumerate(tyre[1]))
    shifted = []
    for part in tyre:
        terms = {}
        for power in range(len(part)):
            c = sum(part[k] * comb(k, power) * alpha ** (k - power) for k in range(power, len(part)))
            terms[(power, 0) if axis == 0 else (0, power)] = exact(Fraction(c) * scale**power / at_trim)
        shifted.append(Polynomial.from_terms(terms))
    return shifted[0], shifted[1]
