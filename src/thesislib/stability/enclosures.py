"""The lateral motion of a car on its own tyres, enclosed in arb balls.

In y = xi - xi*, the slip coordinates about the trim, both kinds of car obey

    u dy_i/dt = G_if(xi_f) - G_if(xi_f*) + G_ir(xi_r) - G_ir(xi_r*) - (u²/l)(y_f - y_r),    i = f, r,

where G_ij is what axle j's force does to coordinate i: a function of one variable each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from flint import arb, arb_mat, fmpq

from thesislib.stability.bicycle import Bicycle
from thesislib.stability.fields import decimal
from thesislib.stability.racing_trim import FrozenAxle, RacingTrim
from thesislib.stability.tyres import MagicFormula

Pair = tuple[arb, arb]

_TRIM_RADIUS = 1e-11  # rad: half-width of the box in which the trim is proved to lie


class GuaranteeError(RuntimeError):
    """No level could be guaranteed; the message says where it failed."""


@dataclass(frozen=True)
class EnclosedAxle:
    """What an axle does to both slip coordinates, over its own.

    Attributes
    ----------
    trim : arb
        Slip coordinate of the trim, rad.
    effects : callable
        (G_f, G_r) in m/s² and their slopes, for a ball of slip coordinates.
    """

    trim: arb
    effects: Callable[[arb], tuple[Pair, Pair]]

    def slopes(self, y: arb) -> Pair:
        """Return the slopes at all of trim + y."""
        return self.effects(self.trim + y)[1]

    def changes(self, y: arb) -> Pair:
        """Return G(trim + y) - G(trim), the tighter of difference and mean-value form each."""
        at, there = self.effects(self.trim)[0], self.effects(self.trim + y)[0]
        slopes = self.slopes(y.union(arb(0)))
        first, second = (_tighter(t - a, s * y) for t, a, s in zip(there, at, slopes, strict=True))
        return first, second


@dataclass(frozen=True)
class EnclosedCar:
    """Both axles, and what couples the coordinates without them.

    Attributes
    ----------
    axles : tuple of two EnclosedAxle
    turn : arb
        u²/l, m/s².
    """

    axles: tuple[EnclosedAxle, EnclosedAxle]
    turn: arb


def enclosed(car: Bicycle | RacingTrim) -> EnclosedCar:
    """Return a car's motion in balls.

    Raises
    ------
    TypeError
        If a tyre of a single-track car is not a `MagicFormula`.
    GuaranteeError
        If the trim cannot be enclosed.
    """
    mass, I_z, a, b, u = (_ball(getattr(car, name)) for name in ("mass", "I_z", "a", "b", "u_0"))
    levers, turn = (a, -b), u * u / (a + b)
    if isinstance(car, RacingTrim):
        # made an equilibrium by a constant force, the trim is any point: here the nearest floats
        places = [arb(float(xi)) for xi in car.to_slip(car.trim())]
        racing = (_axle_effects(axle, mass, I_z, levers, k) for k, axle in enumerate(car.axles))
        first, second = (EnclosedAxle(x, each) for x, each in zip(places, racing, strict=True))
        return EnclosedCar((first, second), turn)
    steers = (car.delta, 0.0)
    tyres = (car.front, car.rear)
    effects = [
        _tyre_effects(_curve(tyre, steer, car.slip), mass, I_z, levers, k)
        for k, (tyre, steer) in enumerate(zip(tyres, steers, strict=True))
    ]
    trim = _enclosed_trim(car, effects, turn)
    first, second = (EnclosedAxle(x, each) for x, each in zip(trim, effects, strict=True))
    return EnclosedCar((first, second), turn)


def _tighter(first: arb, second: arb) -> arb:
    return first if first.rad() < second.rad() else second


def _ball(value: float | Fraction) -> arb:
    fraction = decimal(value) if isinstance(value, float) else value
    return arb(fmpq(fraction.numerator, fraction.denominator))


def _tyre_effects(
    curve: Callable[[arb], tuple[arb, arb]], mass: arb, I_z: arb, levers: Pair, axle: int
) -> Callable[[arb], tuple[Pair, Pair]]:
    c_f, c_r = (1 / mass + lever * levers[axle] / I_z for lever in levers)

    def effects(xi: arb) -> tuple[Pair, Pair]:
        force, slope = curve(xi)
        return (c_f * force, c_r * force), (c_f * slope, c_r * slope)

    return effects


def _axle_effects(
    axle: FrozenAxle, mass: arb, I_z: arb, levers: Pair, number: int
) -> Callable[[arb], tuple[Pair, Pair]]:
    c_f, c_r = (1 / mass + lever * levers[number] / I_z for lever in levers)
    e_f, e_r = (lever / I_z for lever in levers)

    def effects(xi: arb) -> tuple[Pair, Pair]:
        first, second = ((c_f * Y + e_f * M, c_r * Y + e_r * M) for Y, M in axle.enclosed(xi))
        return first, second

    return effects


def _curve(tyre: object, delta: float, slip: str) -> Callable[[arb], tuple[arb, arb]]:
    """Return force and slope of a tyre over its slip coordinate."""
    if not isinstance(tyre, MagicFormula):
        raise TypeError(f"The guarantee is for MagicFormula axles, not {type(tyre).__name__}.")
    B, C, D, E, steer = (_ball(value) for value in (tyre.B, tyre.C, tyre.D, tyre.E, delta))
    initial = B * (1 - E)

    def curve(xi: arb) -> tuple[arb, arb]:
        alpha = (xi if slip == "linear" else xi.atan()) - steer
        stiff = B * alpha
        bent = initial * alpha + E * stiff.atan()
        sine, cosine = (C * bent.atan()).sin_cos()
        slope = D * cosine * C / (1 + bent * bent) * (initial + E * B / (1 + stiff * stiff))
        return D * sine, slope if slip == "linear" else slope / (1 + xi * xi)

    return curve


def _enclosed_trim(
    car: Bicycle, effects: list[Callable[[arb], tuple[Pair, Pair]]], turn: arb
) -> tuple[arb, arb]:
    """Return balls in which the equilibrium lies, proved by Krawczyk's operator."""
    if car.delta == 0.0:
        return arb(0), arb(0)
    near = car.to_slip(car.trim())

    def rates(xi: list[arb]) -> arb_mat:
        front, rear = (effect(x)[0] for effect, x in zip(effects, xi, strict=True))
        yaw = turn * (xi[0] - xi[1])
        return arb_mat([[front[k] + rear[k] - yaw] for k in (0, 1)])

    def jacobian(xi: list[arb]) -> arb_mat:
        front, rear = (effect(x)[1] for effect, x in zip(effects, xi, strict=True))
        return arb_mat([[front[k] - turn, rear[k] + turn] for k in (0, 1)])

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
