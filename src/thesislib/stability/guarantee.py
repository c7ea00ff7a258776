"""A guarantee for the Magic Formula itself: V falls on {V <= level}, by interval branch and bound.

A certificate speaks of the rational fit. The tyre behind it is a transcendental function, but each axle's
force depends on one slip coordinate only. Arb (python-flint) encloses force and slope on intervals of that
one coordinate (`thesislib.stability.enclosures`); the rest is a polynomial in two variables, enclosed on
boxes with outward rounding. Boxes on which neither V > level nor dV/dt < 0 is shown are cut in four, and the
search ends at the first whose middle shows the contrary. On a box around the trim, where both vanish, V
falls because the interval matrix of its quadratic form is negative definite.

The set shown to be invariant is the part of {V <= level} inside the outermost box: on that box's edges V is
larger. With a rational V that a certificate proves positive definite, every motion from it ends at the trim.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import arb
from numpy.typing import NDArray

from thesislib.stability.bicycle import Bicycle
from thesislib.stability.bivariate import Polynomial
from thesislib.stability.enclosures import EnclosedAxle, EnclosedCar, GuaranteeError, enclosed
from thesislib.stability.fields import SCALE
from thesislib.stability.intervals import Interval, enclose
from thesislib.stability.racing_trim import RacingTrim

__all__ = ["Guarantee", "GuaranteeError", "guarantee", "sampled_level"]

_BACK_OFFS = (0.001, 0.004, 0.02, 0.08)
_CELLS = 32  # along each half axis, before boxes are cut
_INNER = tuple(2.0**-k for k in range(5, 25))  # rad: half-widths tried for the box around the trim
_MOST_BOXES = 1_000_000
_ROUNDS, _HALVINGS = 3, 40  # of closing in on the level at which V stops falling, over angle and radius


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


def guarantee(car: Bicycle | RacingTrim, V: Polynomial, *, scale: Fraction = SCALE) -> Guarantee:
    """Return the highest level of V tried that is guaranteed for a car on the Magic Formula.

    Parameters
    ----------
    car : Bicycle or RacingTrim
        A single-track car with `MagicFormula` axles and either kind of slip angles, or a racing car in
        mid-corner.
    V : Polynomial
        Of a certificate, in z about this car's trim.
    scale : Fraction
        D of the certificate, rad: y = D z. A power of two, so that boxes are exact.

    Raises
    ------
    TypeError
        If a tyre is not a `MagicFormula`.
    ValueError
        If the scale is no power of two.
    GuaranteeError
        If no level can be guaranteed.
    """
    if not (scale > 0 and np.frexp(float(scale))[0] == 0.5):
        raise ValueError(f"scale = {scale} of V is not a power of two, which exact boxes need.")
    started = time.process_time()
    motion = enclosed(car)
    sampled = sampled_level(car, V, scale=scale)
    boxes, reason = 0, "V does not fall near the trim"
    if sampled > 0:
        for back_off in _BACK_OFFS:
            # V <= 1 is all that the certificate speaks of
            level = min(sampled * (1 - back_off), 1.0)
            search = _Search(motion, V, level, scale)
            reason = search.run()
            boxes += search.boxes
            if not reason:
                return Guarantee(level, sampled, boxes, time.process_time() - started)
    raise GuaranteeError(
        f"No level of V (degree {V.degree}) is guaranteed for the Magic Formula at u_0 = {car.u_0:g} m/s, "
        f"delta = {np.degrees(car.delta):.3g}°: {reason}."
    )


def sampled_level(
    car: Bicycle | RacingTrim, V: Polynomial, *, scale: Fraction = SCALE, rays: int = 720, radii: int = 400
) -> float:
    """Return the smallest V at which it does not fall, by samples on rays up to 4 units of z about the trim.

    Where V stops falling on a ray is found by bisection, and the rays close in on the lowest such place.
    """
    trim, gradient = car.trim(), (V.derivative(0), V.derivative(1))

    def rises(z: NDArray[np.float64]) -> NDArray[np.bool_]:
        rate = car.to_slip(car.rates(trim + car.from_slip(float(scale) * z)))
        z_1, z_2 = np.moveaxis(z, -1, 0)
        return np.asarray(gradient[0](z_1, z_2) * rate[..., 0] + gradient[1](z_1, z_2) * rate[..., 1] >= 0)

    angle = np.arange(rays) * 2 * np.pi / rays
    radius = np.linspace(0.0, 4.0, radii + 1)[1:]
    lowest = np.inf
    for _ in range(_ROUNDS):
        ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        up = rises(radius[:, None, None] * ray)
        if not up.any():
            return lowest
        before, which = np.nonzero(up[1:] & ~up[:-1])
        # a ray on which V does not fall from the start counts with its first sample
        low, high = (np.concatenate([radius[before + k], radius[:1].repeat(up[0].sum())]) for k in (0, 1))
        which = np.concatenate([which, np.nonzero(up[0])[0]])
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            above = rises(middle[:, None] * ray[which])
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        value = V(*(high[:, None] * ray[which]).T)
        best = int(np.argmin(value))
        lowest = min(lowest, float(value[best]))
        spacing = angle[1] - angle[0]
        angle = angle[which[best]] + np.linspace(-spacing, spacing, 65)
    return lowest


@dataclass(frozen=True)
class _Table:
    """Of one axle, for both coordinates: changes at cell middles and on cells, and slopes on cells."""

    middle: list[Interval]
    change: list[Interval]
    slope: list[Interval]


class _Search:
    def __init__(self, car: EnclosedCar, V: Polynomial, level: float, scale: Fraction = SCALE) -> None:
        self.axles, self.V, self.level, self.scale = car.axles, V, level, float(scale)
        self.boxes, self.most_boxes = 0, _MOST_BOXES
        self.refuted = False
        self.turn = _bounds([car.turn])
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
            if self.refuted:
                return f"V rises at a point below level {self.level:.4g}"
            i, j, size = i[open_], j[open_], size / 2
            i = np.concatenate([2 * i, 2 * i + 1, 2 * i, 2 * i + 1])
            j = np.concatenate([2 * j, 2 * j, 2 * j + 1, 2 * j + 1])
        return ""

    def _width(self) -> float | None:
        """Return a half-width in rad, a power of two times 1/8, on whose edges V exceeds the level."""
        for width in (0.125, 0.25, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0):
            ends = np.linspace(-width, width, 8193) / self.scale
            edge, half = (
                Interval(ends[:-1], ends[1:]),
                Interval(*(np.array([s * ends[-1] / 8192]) for s in (-1, 1))),
            )
            middle = Interval.exactly((ends[1:] + ends[:-1]) / 2)
            bounds = []
            for side in (-width / self.scale, width / self.scale):
                fixed = Interval.exactly(np.full(len(ends) - 1, side))
                along = enclose(self.first[0], edge, fixed), enclose(self.first[1], fixed, edge)
                bounds.append(enclose(self.V, middle, fixed) + along[0] * half)
                bounds.append(enclose(self.V, fixed, middle) + along[1] * half)
            if all((bound.low > self.level).all() for bound in bounds):
                return width
        return None

    def _falls_near_trim(self, radius: float) -> bool:
        """Whether -(H A + A'H)/2 is positive definite on the box |y| <= radius, as an interval matrix."""
        box = Interval(np.array([-radius / self.scale]), np.array([radius / self.scale]))
        H = {key: enclose(p, box, box) for key, p in self.second.items()}
        A = self._jacobian([[_bounds([s]) for s in axle.slopes(arb(0, radius))] for axle in self.axles])
        product = {(i, j): H[i, 0] * A[0][j] + H[i, 1] * A[1][j] for i in (0, 1) for j in (0, 1)}
        n_11, n_22 = -product[0, 0], -product[1, 1]
        n_12 = (product[0, 1] + product[1, 0]) * -0.5
        determinant = n_11 * n_22 - n_12 * n_12
        return bool(n_11.low[0] > 0 and determinant.low[0] > 0)

    def _jacobian(self, slopes: list[list[Interval]]) -> list[list[Interval]]:
        front, rear = slopes
        return [[front[i] - self.turn, rear[i] + self.turn] for i in (0, 1)]

    def _undecided(
        self, i: NDArray[np.int64], j: NDArray[np.int64], size: float, inner: float
    ) -> NDArray[np.int64]:
        """Return which cells [i, i+1] x [j, j+1] times size are not settled."""
        x, y = (
            Interval(np.asarray(k * size / self.scale), np.asarray((k + 1) * size / self.scale))
            for k in (i, j)
        )
        near = (
            np.maximum(np.abs([x.low, x.high]).max(0), np.abs([y.low, y.high]).max(0)) <= inner / self.scale
        )
        half = Interval(np.array([-size / 2]), np.array([size / 2]))
        centre = [Interval.exactly((k + 0.5) * size / self.scale) for k in (i, j)]
        V_1, V_2 = (enclose(p, x, y) for p in self.first)
        at_centre = enclose(self.V, *centre)
        V = at_centre + (V_1 + V_2) * half * (1 / self.scale)
        left = np.nonzero(~(near | (V.low > self.level)))[0]
        if len(left) == 0:
            return left
        i, j = i[left], j[left]
        x, y, V_1, V_2, at_centre, *centre = (each[left] for each in (x, y, V_1, V_2, at_centre, *centre))
        tables = [self._table(axle, k, size) for axle, k in zip(self.axles, (i, j), strict=True)]
        rates = self._rates([table.middle for table in tables], [c * self.scale for c in centre])
        value = enclose(self.first[0], *centre) * rates[0] + enclose(self.first[1], *centre) * rates[1]
        self.refuted = bool(((value.low > 0) & (at_centre.high < self.level)).any())
        # mean-value form about the middle of the cell, as for V above
        H = {key: enclose(p, x, y) * (1 / self.scale) for key, p in self.second.items()}
        g = self._rates([table.change for table in tables], [x * self.scale, y * self.scale])
        A = self._jacobian([table.slope for table in tables])
        for k in (0, 1):
            change = H[0, k] * g[0] + H[1, k] * g[1] + V_1 * A[0][k] + V_2 * A[1][k]
            value = value + change * half
        direct = V_1 * g[0] + V_2 * g[1]
        return left[~((value.high < 0) | (direct.high < 0))]

    def _rates(self, effects: list[list[Interval]], y: list[Interval]) -> list[Interval]:
        (front, rear), yaw = effects, self.turn * (y[0] - y[1])
        return [front[i] + rear[i] - yaw for i in (0, 1)]

    def _table(self, axle: EnclosedAxle, cells: NDArray[np.int64], size: float) -> _Table:
        distinct, back = np.unique(cells, return_inverse=True)
        middles = [arb((float(k) + 0.5) * size) for k in distinct]
        balls = [arb(m, size / 2) for m in middles]
        columns = (
            [axle.changes(m) for m in middles],
            [axle.changes(b) for b in balls],
            [axle.slopes(b) for b in balls],
        )
        return _Table(*([_bounds(each)[back] for each in zip(*pairs, strict=True)] for pairs in columns))


def _bounds(balls: Sequence[arb]) -> Interval:
    """Return floats that enclose balls."""
    low = np.array([float(ball.lower()) for ball in balls])
    high = np.array([float(ball.upper()) for ball in balls])
    return Interval(np.nextafter(low, -np.inf), np.nextafter(high, np.inf))
