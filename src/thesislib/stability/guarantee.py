"""A guarantee for the Magic Formula itself: V falls on {V <= level}, by interval branch and bound.

A certificate speaks of the rational fit. The tyre behind it is a transcendental function, but each axle's
force depends on one slip coordinate only. Arb (python-flint) encloses force and slope on intervals of that
one coordinate; the rest is a polynomial in two variables, enclosed on boxes with outward rounding. Boxes on
which neither V > level nor dV/dt < 0 is shown are cut in four. On a box around the trim, where both vanish,
V falls because the interval matrix of its quadratic form is negative definite.

The set shown to be invariant is the part of {V <= level} inside the outermost box: on that box's edges V is
larger. With a rational V that a certificate proves positive definite, every motion from it ends at the trim.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import arb, arb_mat, fmpq
from numpy.typing import NDArray

from thesislib.stability.bicycle import Bicycle
from thesislib.stability.bivariate import Polynomial
from thesislib.stability.fields import SCALE, decimal
from thesislib.stability.intervals import Interval, enclose
from thesislib.stability.tyres import MagicFormula

_BACK_OFFS = (0.01, 0.02, 0.04, 0.08)
_D = float(SCALE)
_CELLS = 32  # along each half axis, before boxes are cut
_INNER = tuple(2.0**-k for k in range(5, 15))  # rad: half-widths tried for the box around the trim
_MOST_BOXES = 1_000_000
_TRIM_RADIUS = 1e-11  # rad: half-width of the box in which the trim is proved to lie


class GuaranteeError(RuntimeError):
    """No level could be guaranteed; the message says where it failed."""


@dataclass(frozen=True)
class Guarantee:
    """A level of V that holds for the Magic Formula.

    Attributes
    ----------
    level : float
        {V <= level} is invariant.
    sampled : float
        The level at which V stops falling on the Magic Formula, by samples.
    boxes : int
        Boxes that were looked at.
    seconds : float
        Process time.
    """

    level: float
    sampled: float
    boxes: int
    seconds: float


def guarantee(car: Bicycle, V: Polynomial) -> Guarantee:
    """Return the highest level of V tried that is guaranteed for a car on the Magic Formula.

    Parameters
    ----------
    car : Bicycle
        With `MagicFormula` axles; either kind of slip angles.
    V : Polynomial
        Of a certificate, in z about this car's trim.

    Raises
    ------
    TypeError
        If a tyre is not a `MagicFormula`.
    GuaranteeError
        If no level can be guaranteed.
    """
    started = time.process_time()
    axles = _axles(car)
    sampled = sampled_level(car, V)
    boxes, reason = 0, "V does not fall near the trim"
    if sampled > 0:
        for back_off in _BACK_OFFS:
            # V <= 1 is all that the certificate speaks of
            level = min(sampled * (1 - back_off), 1.0)
            search = _Search(car, axles, V, level)
            reason = search.run()
            boxes += search.boxes
            if not reason:
                return Guarantee(level, sampled, boxes, time.process_time() - started)
    raise GuaranteeError(
        f"No level of V (degree {V.degree}) is guaranteed for the Magic Formula at u_0 = {car.u_0:g} m/s, "
        f"delta = {np.degrees(car.delta):.3g}°: {reason}."
    )


def sampled_level(car: Bicycle, V: Polynomial, rays: int = 720, radii: int = 400) -> float:
    """Return the smallest V at which it does not fall, by samples up to 1 rad about the trim."""
    angle = np.arange(rays) * 2 * np.pi / rays
    radius = np.linspace(0.0, 4.0, radii + 1)[1:]
    z = radius[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    rate = car.to_slip(car.rates(car.trim() + car.from_slip(_D * z)))
    rise = V.derivative(0)(*np.moveaxis(z, -1, 0)) * rate[..., 0]
    rise = rise + V.derivative(1)(*np.moveaxis(z, -1, 0)) * rate[..., 1]
    value = V(*np.moveaxis(z, -1, 0))
    return float(value[rise >= 0].min(initial=np.inf))


@dataclass(frozen=True)
class _Axle:
    """Force and slope of an axle over its slip coordinate, as functions of arb balls about the trim."""

    trim: arb
    force: Callable[[arb], arb]
    slope: Callable[[arb], arb]

    def change(self, y: arb) -> arb:
        """Return F(trim + y) - F(trim), the tighter of difference and mean-value form."""
        at = self.force(self.trim)
        difference = self.force(self.trim + y) - at
        mean = self.slope(self.trim + y.union(arb(0))) * y
        return difference if difference.rad() < mean.rad() else mean


def _ball(value: float | Fraction) -> arb:
    fraction = decimal(value) if isinstance(value, float) else value
    return arb(fmpq(fraction.numerator, fraction.denominator))


def _axles(car: Bicycle) -> tuple[_Axle, _Axle]:
    """Return both axles about the enclosed trim."""
    functions = [
        _functions(tyre, car.delta if axis == 0 else 0.0, car.slip)
        for axis, tyre in enumerate((car.front, car.rear))
    ]
    trim = _enclosed_trim(car, functions)
    first, second = (_Axle(x, *each) for x, each in zip(trim, functions, strict=True))
    return first, second


def _functions(tyre: object, delta: float, slip: str) -> tuple[Callable[[arb], arb], Callable[[arb], arb]]:
    if not isinstance(tyre, MagicFormula):
        raise TypeError(f"The guarantee is for MagicFormula axles, not {type(tyre).__name__}.")
    B, C, D, E, steer = (_ball(value) for value in (tyre.B, tyre.C, tyre.D, tyre.E, delta))

    def parts(xi: arb) -> tuple[arb, arb, arb]:
        alpha = (xi if slip == "linear" else xi.atan()) - steer
        return alpha, B * (1 - E) * alpha + E * (B * alpha).atan(), alpha * B

    def force(xi: arb) -> arb:
        _, bent, _ = parts(xi)
        return D * (C * bent.atan()).sin()

    def slope(xi: arb) -> arb:
        _, bent, stiff = parts(xi)
        inner = B * (1 - E) + E * B / (1 + stiff * stiff)
        outer = D * (C * bent.atan()).cos() * C / (1 + bent * bent)
        return outer * inner * (1 if slip == "linear" else 1 / (1 + xi * xi))

    return force, slope


def _enclosed_trim(
    car: Bicycle, functions: list[tuple[Callable[[arb], arb], Callable[[arb], arb]]]
) -> tuple[arb, arb]:
    """Return balls in which the equilibrium lies, proved by Krawczyk's operator."""
    if car.delta == 0.0:
        return arb(0), arb(0)
    near = car.to_slip(car.trim())
    (c_f, c_r), turn = _coefficients(car)

    def rates(xi: list[arb]) -> arb_mat:
        F = [force(x) for (force, _), x in zip(functions, xi, strict=True)]
        yaw = turn * (xi[0] - xi[1])
        return arb_mat([[row[0] * F[0] + row[1] * F[1] - yaw] for row in (c_f, c_r)])

    def jacobian(xi: list[arb]) -> arb_mat:
        C = [slope(x) for (_, slope), x in zip(functions, xi, strict=True)]
        return arb_mat([[row[0] * C[0] - turn, row[1] * C[1] + turn] for row in (c_f, c_r)])

    middle = [arb(float(x)) for x in near]
    box = [arb(float(x), _TRIM_RADIUS) for x in near]
    inverse = jacobian(middle).inv().mid()
    offset = arb_mat([[b - m] for b, m in zip(box, middle, strict=True)])
    identity = arb_mat([[1, 0], [0, 1]])
    moved = (identity - inverse * jacobian(box)) * offset - inverse * rates(middle)
    image = [m + moved[k, 0] for k, m in enumerate(middle)]
    if not all(b.contains_interior(i) for b, i in zip(box, image, strict=True)):
        raise GuaranteeError("The trim of the Magic Formula car cannot be enclosed.")
    return image[0], image[1]


def _coefficients(car: Bicycle) -> tuple[tuple[list[arb], list[arb]], arb]:
    """Return c and u²/l of u dxi_i/dt = c_i . (F_f, F_r) - (u²/l)(xi_f - xi_r)."""
    M, I_z, a, b, u = (_ball(getattr(car, name)) for name in ("mass", "I_z", "a", "b", "u_0"))
    cross = 1 / M - a * b / I_z
    return ([1 / M + a * a / I_z, cross], [cross, 1 / M + b * b / I_z]), u * u / (a + b)


@dataclass(frozen=True)
class _Table:
    """Change of force at cell middles and on cells, and slope on cells, of one axle."""

    middle: Interval
    force: Interval
    slope: Interval


class _Search:
    def __init__(self, car: Bicycle, axles: tuple[_Axle, _Axle], V: Polynomial, level: float) -> None:
        self.axles, self.V, self.level = axles, V, level
        self.boxes, self.most_boxes = 0, _MOST_BOXES
        (c_f, c_r), turn = _coefficients(car)
        self.c = [[_bounds([c]) for c in row] for row in (c_f, c_r)]
        self.turn = _bounds([turn])
        self.first = (V.derivative(0), V.derivative(1))
        self.second = {(i, j): self.first[i].derivative(j) for i in (0, 1) for j in (0, 1)}

    def run(self) -> str:
        """Return an empty text if V falls on {V <= level}, or why that is not shown."""
        width = self._width()
        if width is None:
            return "the level set is not inside a box of 2 rad"
        inner = next((r for r in _INNER if self._falls_near_trim(r)), None)
        if inner is None:
            return "V does not fall near the trim"
        cells = np.arange(-_CELLS, _CELLS)
        i, j = (grid.ravel() for grid in np.meshgrid(cells, cells, indexing="ij"))
        size = width / _CELLS
        while len(i):
            self.boxes += len(i)
            if self.boxes > self.most_boxes:
                return f"more than {self.most_boxes} boxes would be needed at level {self.level:.4g}"
            open_ = self._undecided(i, j, size, inner)
            i, j, size = i[open_], j[open_], size / 2
            i = np.concatenate([2 * i, 2 * i + 1, 2 * i, 2 * i + 1])
            j = np.concatenate([2 * j, 2 * j, 2 * j + 1, 2 * j + 1])
        return ""

    def _width(self) -> float | None:
        """Return a half-width in rad, a power of two times 1/8, on whose edges V exceeds the level."""
        for width in (0.125, 0.25, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0):
            ends = np.linspace(-width, width, 8193) / _D
            edge, half = (
                Interval(ends[:-1], ends[1:]),
                Interval(*(np.array([s * ends[-1] / 8192]) for s in (-1, 1))),
            )
            middle = Interval.exactly((ends[1:] + ends[:-1]) / 2)
            bounds = []
            for side in (-width / _D, width / _D):
                fixed = Interval.exactly(np.full(len(ends) - 1, side))
                along = enclose(self.first[0], edge, fixed), enclose(self.first[1], fixed, edge)
                bounds.append(enclose(self.V, middle, fixed) + along[0] * half)
                bounds.append(enclose(self.V, fixed, middle) + along[1] * half)
            if all((bound.low > self.level).all() for bound in bounds):
                return width
        return None

    def _falls_near_trim(self, radius: float) -> bool:
        """Whether -(H A + A'H)/2 is positive definite on the box |y| <= radius, as an interval matrix."""
        box = Interval(np.array([-radius / _D]), np.array([radius / _D]))
        H = {key: enclose(p, box, box) for key, p in self.second.items()}
        slopes = [_bounds([axle.slope(axle.trim + arb(0, radius))]) for axle in self.axles]
        A = self._jacobian(slopes)
        product = {(i, j): H[i, 0] * A[0][j] + H[i, 1] * A[1][j] for i in (0, 1) for j in (0, 1)}
        n_11, n_22 = -product[0, 0], -product[1, 1]
        n_12 = (product[0, 1] + product[1, 0]) * -0.5
        determinant = n_11 * n_22 - n_12 * n_12
        return bool(n_11.low[0] > 0 and determinant.low[0] > 0)

    def _jacobian(self, slopes: list[Interval]) -> list[list[Interval]]:
        return [[self.c[i][0] * slopes[0] - self.turn, self.c[i][1] * slopes[1] + self.turn] for i in (0, 1)]

    def _undecided(
        self, i: NDArray[np.int64], j: NDArray[np.int64], size: float, inner: float
    ) -> NDArray[np.int64]:
        """Return which cells [i, i+1] x [j, j+1] times size are not settled."""
        x, y = (Interval(np.asarray(k * size / _D), np.asarray((k + 1) * size / _D)) for k in (i, j))
        near = np.maximum(np.abs([x.low, x.high]).max(0), np.abs([y.low, y.high]).max(0)) <= inner / _D
        half = Interval(np.array([-size / 2]), np.array([size / 2]))
        centre = [Interval.exactly((k + 0.5) * size / _D) for k in (i, j)]
        V_1, V_2 = (enclose(p, x, y) for p in self.first)
        V = enclose(self.V, *centre) + (V_1 + V_2) * half * (1 / _D)
        left = np.nonzero(~(near | (V.low > self.level)))[0]
        if len(left) == 0:
            return left
        i, j = i[left], j[left]
        x, y, V_1, V_2, *centre = (each[left] for each in (x, y, V_1, V_2, *centre))
        tables = [self._table(axle, k, size) for axle, k in zip(self.axles, (i, j), strict=True)]
        at = [table.middle for table in tables]
        rates = self._rates(at, [c * _D for c in centre])
        value = enclose(self.first[0], *centre) * rates[0] + enclose(self.first[1], *centre) * rates[1]
        # mean-value form about the middle of the cell, as for V above
        H = {key: enclose(p, x, y) * (1 / _D) for key, p in self.second.items()}
        g = self._rates([table.force for table in tables], [x * _D, y * _D])
        A = self._jacobian([table.slope for table in tables])
        for k in (0, 1):
            change = H[0, k] * g[0] + H[1, k] * g[1] + V_1 * A[0][k] + V_2 * A[1][k]
            value = value + change * half
        direct = V_1 * g[0] + V_2 * g[1]
        return left[~((value.high < 0) | (direct.high < 0))]

    def _rates(self, force: list[Interval], y: list[Interval]) -> list[Interval]:
        yaw = self.turn * (y[0] - y[1])
        return [self.c[i][0] * force[0] + self.c[i][1] * force[1] - yaw for i in (0, 1)]

    def _table(self, axle: _Axle, cells: NDArray[np.int64], size: float) -> _Table:
        distinct, back = np.unique(cells, return_inverse=True)
        middles = [arb((float(k) + 0.5) * size) for k in distinct]
        balls = [arb(m, size / 2) for m in middles]
        columns = (
            [axle.change(m) for m in middles],
            [axle.change(b) for b in balls],
            [axle.slope(axle.trim + b) for b in balls],
        )
        return _Table(*(_bounds(column)[back] for column in columns))


def _bounds(balls: list[arb]) -> Interval:
    """Return floats that enclose balls."""
    low = np.array([float(ball.lower()) for ball in balls])
    high = np.array([float(ball.upper()) for ball in balls])
    return Interval(np.nextafter(low, -np.inf), np.nextafter(high, np.inf))
