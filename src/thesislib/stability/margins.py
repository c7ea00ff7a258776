"""Disturbance margins of the racing car in mid-corner: certified, and beside them those of simulation.

How large may a sudden change of lateral speed and yaw rate be for the car to return to its trim, the driver
doing nothing? Each axle is fitted by rational functions about its trim, the joint ascent enlarges a level set
of V of the fitted car, interval branch and bound finds the level at which V still falls on the tyres
themselves, and a certificate is made of that level: {V <= 1} is a region of attraction for the fitted car, by
exact arithmetic, and for the tyres of appendix B, by the guarantee. It says which ellipse is inside.

Disturbances are measured by their kinetic energy: (M/2)(dv² + k² domega²), with the radius of gyration k.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import fmpq_poly
from numpy.typing import NDArray

from thesislib.stability.alternation import containment
from thesislib.stability.ascent import Goal, Region, ascend, scaling
from thesislib.stability.bivariate import Polynomial
from thesislib.stability.certificates import Certificate, certify
from thesislib.stability.checking import CertificateError
from thesislib.stability.fields import ExactCar, decimal, exact, exact_body, exact_tyre
from thesislib.stability.guarantee import Guarantee, GuaranteeError, guarantee
from thesislib.stability.phase_plane import LateralMotion, returns
from thesislib.stability.program import ProgramError
from thesislib.stability.programs import multiplier, quadratic
from thesislib.stability.racing_trim import RacingTrim, read_trims
from thesislib.stability.rays import Rays
from thesislib.stability.tyres import cornering_fit

Array = NDArray[np.float64]

_SIZE = 0.3  # of the simulated ellipse in z: sets of about one have coefficients that a solver can handle
REACH = 0.6
"""Slips over which the axles are fitted, +- rad: a car that spins passes through them."""

_ARRIVAL = 2e-3  # rad: from so near a stable trim a motion returns, certified or not
_DIRECTIONS, _TRIES, _HALVINGS = 24, 24, 6  # of simulated disturbances; the largest is 8 m/s
_BACK_OFFS = (0.0, 2e-3, 1.5e-2, 6e-2)  # below the guaranteed level; the first that is certified counts
_SHRINK = 1e-4  # of the ellipse, below its sampled size
_TURN = Rays(720)


def slip_scale(trim: RacingTrim, energy_speed: float) -> Fraction:
    """Return D in rad, a power of two: near a limit of stability regions are hundreds of times smaller.

    Parameters
    ----------
    trim : RacingTrim
    energy_speed : float
        m/s, of the simulated ellipse.
    """
    power = round(float(np.log2(energy_speed / trim.u_0 / _SIZE)))
    return Fraction(2) ** int(np.clip(power, -12, -2))


def exact_trim(trim: RacingTrim, scale: Fraction) -> ExactCar:
    """Return the car at a trim with rational fits of its axles, in rational numbers and units D = `scale`.

    Its slip angles are xi - delta at the front and xi at the rear; what arctan and the wheels' own speeds
    make of them is in the fits.

    Raises
    ------
    ValueError
        If a fit degenerates.
    """
    alpha = np.linspace(-REACH, REACH, 1201)
    places = trim.to_slip(trim.trim()) - np.array([trim.delta, 0.0])
    front, rear = (
        cornering_fit(alpha, *axle.force_and_moment(alpha + axle.steer), place)
        for axle, place in zip(trim.axles, places, strict=True)
    )
    car = ExactCar(
        **exact_body(trim),
        front=exact_tyre(front.force),
        rear=exact_tyre(rear.force),
        front_moment=exact_tyre(front.moment)[0],
        rear_moment=exact_tyre(rear.moment)[0],
        scale=scale,
    )
    return car.held_at(*places)


def energy(trim: RacingTrim, scale: Fraction) -> Polynomial:
    """Return s = dv² + k² domega² in z, (m/s)²: twice a disturbance's kinetic energy over the mass."""
    to_state = scaling(trim.matrix, scale)
    return quadratic(to_state.T @ np.diag([1.0, trim.gyration**2]) @ to_state)


@dataclass(frozen=True)
class Margin:
    """What a trim is certified to return from.

    Attributes
    ----------
    trim : RacingTrim
    simulated : float
        sqrt(s) in m/s of the largest ellipse that simulation finds.
    region : Region
        Of the fitted car, as the ascent left it.
    guarantee : Guarantee
        The level of its V that holds for the tyres themselves.
    level : float
        That level, or a little less.
    certificate : Certificate
        Of this level, with the ellipse inside.
    """

    trim: RacingTrim
    simulated: float
    region: Region
    guarantee: Guarantee
    level: float
    certificate: Certificate

    @property
    def scale(self) -> Fraction:
        """D, rad."""
        return self.region.cars[0].scale

    def boundary(self, rays: int = 720) -> Array:
        """Return the boundary of the certified set as (dv, domega), shape (rays, 2)."""
        to_state = scaling(self.trim.matrix, self.scale)
        return self.region.boundary(to_state, np.zeros(2), rays, self.level)

    @property
    def energy_speed(self) -> float:
        """sqrt(beta), m/s: the ellipse's half-width in lateral speed; over k in rad/s, that in yaw rate."""
        beta = self.certificate.verdict.beta
        assert beta is not None
        return float(np.sqrt(beta))

    def along(self, v: float, omega: float) -> float:
        """Return how far {V <= 1} reaches in a direction (v, omega) from the trim, a lower bound.

        The roots of V = 1 on the line are isolated by python-flint.
        """
        u, a, b = (decimal(getattr(self.trim, name)) for name in ("u_0", "a", "b"))
        dv, dw = Fraction(v), Fraction(omega)
        x, y = ((dv + lever * dw) / (u * self.scale) for lever in (a, -b))
        V = self.certificate.document["V"]
        coefficients = [Fraction(-1)] + [Fraction(0)] * self.certificate.verdict.degree
        for i, j, value in V:
            coefficients[i + j] += Fraction(value) * x**i * y**j
        roots: Any = fmpq_poly([exact(c) for c in coefficients]).complex_roots()
        return min(float(root.real.lower()) for root, _ in roots if root.imag.contains(0) and root.real > 0)


def certified_margin(trim: RacingTrim, *, degree: int = 4, steps: int = 12) -> Margin:
    """Return the certified margin of a stable trim.

    Parameters
    ----------
    trim : RacingTrim
    degree : int
        Of V, at most: a lower one counts where the higher cannot be certified at the tyres' level.
    steps : int
        Joint steps at most for each degree.

    Raises
    ------
    ValueError
        If the degree is not even and positive, the trim is unstable, so that there is no margin, or a fit
        degenerates.
    ProgramError, GuaranteeError, CertificateError
        If nothing can be certified.
    """
    if degree < 2 or degree % 2:
        raise ValueError(f"deg V = {degree} is not an even number from 2 on.")
    if trim.growth >= 0:
        raise ValueError(_unstable(trim))
    simulated = simulated_energy(trim)
    scale = slip_scale(trim, simulated)
    car, to_state, shape = exact_trim(trim, scale), scaling(trim.matrix, scale), energy(trim, scale)
    stiff: Array = np.asarray(np.linalg.solve(to_state, trim.jacobian(trim.trim()) @ to_state), float)
    degrees = range(2, degree + 1, 2)
    found = ascend([car], degrees, Goal(shape=shape), to_state, stiff=stiff, steps=steps)
    for region in reversed(found.values()):
        try:
            promise = guarantee(trim, region.V, scale=scale)
            return Margin(trim, simulated, region, promise, *_certified(region, promise.level, shape))
        except (GuaranteeError, CertificateError) as error:
            refused = error
    raise refused


def _unstable(trim: RacingTrim) -> str:
    return (
        f"{trim}: the frozen lateral motion is unstable (growth {trim.growth:+.2f} 1/s), no disturbance is "
        "small enough to return from."
    )


def _certified(region: Region, level: float, shape: Polynomial) -> tuple[float, Certificate]:
    """Return a level of the region's V, at most `level`, and its certificate with an ellipse inside."""
    if level >= 1.0:
        return 1.0, region.certificate
    car, refused = region.cars[0], ""
    for back_off in _BACK_OFFS:
        lower = level * (1 - back_off)
        V = region.V * (1 / lower)
        size = (1 - _SHRINK) * float(shape(*_TURN.points(_TURN.boundary(V)).T).min())
        try:
            proof = multiplier(car.field, V)
            return lower, certify([car], V, [proof], containment(V, shape, size, False))
        except (ProgramError, CertificateError) as error:
            refused = str(error)
    raise CertificateError(f"The level that holds for the tyres cannot be certified: {refused}")


def simulated_energy(trim: RacingTrim, *, directions: int = _DIRECTIONS) -> float:
    """Return the largest sqrt(dv² + k² domega²) in m/s from which the car returns in all directions tried.

    Parameters
    ----------
    trim : RacingTrim
    directions : int
        Evenly over the ellipse.
    """
    angle = np.arange(directions) * 2 * np.pi / directions
    heading = np.column_stack([np.cos(angle), np.sin(angle) / trim.gyration])
    return float(simulated_reach(trim, heading).min())


def simulated_reach(trim: RacingTrim, heading: Array) -> Array:
    """Return how far along each direction every disturbance tried is returned from; inf for up to 8 units.

    The first that is not is looked for among twenty-four, and then between two of them by bisection.

    Parameters
    ----------
    trim : RacingTrim
    heading : array, shape (n, 2)
        Directions of (dv, domega).
    """
    radius = np.concatenate([[0.0], np.geomspace(0.02, 8.0, _TRIES)])
    starts = trim.trim() + radius[1:, None, None] * heading
    back = _returns(trim, starts.reshape(-1, 2)).reshape(_TRIES, len(heading))
    lost, first = ~back.all(axis=0), np.argmin(back, axis=0)
    low, high = radius[first], radius[first + 1]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        back = _returns(trim, trim.trim() + middle[:, None] * heading)
        low, high = np.where(back, middle, low), np.where(back, high, middle)
    return np.where(lost, low, np.inf)


@dataclass(frozen=True)
class _Motion:
    """A trim with another model of its motion."""

    of: RacingTrim
    rates: Callable[[Any], Any]

    def trim(self) -> Array:
        return self.of.trim()

    def to_slip(self, x: Any) -> Any:
        return self.of.to_slip(x)


def _returns(car: LateralMotion, starts: Array) -> NDArray[np.bool_]:
    return returns(car, starts, time=6.0, step=0.02, arrival=_ARRIVAL)


def margin_case(lap: str, corner: int, degree: int = 4, steps: int = 12) -> dict[str, Any]:
    """Compute the margins at a mid-corner trim: a case of `studies.run`.

    Parameters
    ----------
    lap : str
        Name of the lap in the file of trims.
    corner : int
    degree, steps
        As of `certified_margin`.

    Returns
    -------
    dict
        ``growth`` 1/s; ``gyration`` k in m; certified ``energy`` m/s and the ``simulated_energy``; ``v_in
        v_out`` m/s and ``omega_in omega_out`` rad/s, certified, towards the inside and the outside of the
        turn; the same with ``simulated_`` before, inf where no disturbance up to 8 m/s or rad/s is lost;
        ``lost``, how many of 72 starts on the boundary do not return by the model of chapter 4, in which each
        wheel's speed follows the yaw rate; ``boundary`` (m/s, rad/s) about the trim; ``level`` and ``degree``
        of V, and ``certificate``. An unstable trim and one at which nothing can be certified have ``growth``
        and a ``reason`` only.
    """
    trim = next(one for one in read_trims() if (one.lap, one.corner) == (lap, corner))
    result: dict[str, Any] = {"growth": trim.growth, "reason": ""}
    if trim.growth >= 0:
        return result | {"reason": _unstable(trim)}
    try:
        margin = certified_margin(trim, degree=degree, steps=steps)
    except (ProgramError, GuaranteeError, CertificateError) as error:
        return result | {"reason": str(error)}
    inside = float(np.sign(trim.motion["omega"]))
    ways = {"v_in": (inside, 0.0), "v_out": (-inside, 0.0)}
    ways |= {"omega_in": (0.0, inside), "omega_out": (0.0, -inside)}
    reach = simulated_reach(trim, np.array(list(ways.values())))
    result |= {name: margin.along(*way) for name, way in ways.items()}
    result |= {f"simulated_{name}": float(far) for name, far in zip(ways, reach, strict=True)}
    whole = _Motion(trim, trim.whole_car_rates)
    boundary = margin.boundary()
    return result | {
        "gyration": trim.gyration,
        "energy": margin.energy_speed,
        "simulated_energy": margin.simulated,
        "lost": int(np.count_nonzero(~_returns(whole, trim.trim() + boundary[::10]))),
        "level": margin.level,
        "degree": margin.region.V.degree,
        "boundary": boundary,
        "certificate": json.dumps(margin.certificate.document),
        "seconds": margin.region.seconds + margin.guarantee.seconds,
    }
