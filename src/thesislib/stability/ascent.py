"""The joint linearised ascent: V and q_2 move together, and no shape function is needed.

(7.30) is bilinear in V and q_2. About a certified pair (V_k, q_k), on {V <= 1},

    q_2 (V - 1)  is replaced by  q_2 (V_k - 1) + q_k (V - V_k),

which is affine in both. What is maximised is the linearised area inside a window, or beta of a shape
function; a trust region holds |V - 1| on the old boundary. Each new V is divided by the level at which it
stops falling, a little less, and accepted only if the larger set passes the exact check.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from thesislib.stability.alternation import containment
from thesislib.stability.bivariate import Polynomial, exponents_between
from thesislib.stability.certificates import Certificate, Containment, certify, inner_basis
from thesislib.stability.checking import CertificateError
from thesislib.stability.fields import SCALE, ExactCar, Field
from thesislib.stability.gram import square
from thesislib.stability.phase_plane import Window
from thesislib.stability.program import ProgramError, SosProgram
from thesislib.stability.programs import (
    PHI,
    Multiplier,
    bases,
    common_lyapunov,
    falling,
    falling_near_origin,
    level_of,
    linear_lyapunov,
    multiplier,
    rise,
    slack,
)
from thesislib.stability.rays import Rays

Array = NDArray[np.float64]

_LOG = logging.getLogger(__name__)

_BACK_OFFS = (3e-4, 2e-3, 1.5e-2)  # below the sampled level; the first that is certified counts
_TRUST, _LARGEST_TRUST, _SMALLEST_TRUST = 0.3, 0.6, 0.05
_AREA_GAIN, _BETA_GAIN = 1e-3, 3e-4  # relative, of a step that still counts
_ROOM, _LARGEST_ROOM = 1e-5, 1e-2  # slack that a joint step has to leave; ten times more after a refusal


@dataclass(frozen=True)
class Goal:
    """What an ascent enlarges.

    Attributes
    ----------
    window : Window, optional
        Area counts inside it only; in z.
    shape : Polynomial, optional
        s in z: its largest set inside {V <= 1} is enlarged instead of the area.
    """

    window: Window | None = None
    shape: Polynomial | None = None


@dataclass(frozen=True)
class Region:
    """A certified region of attraction and how it was found.

    Attributes
    ----------
    cars : tuple of ExactCar
    V : Polynomial
        In z; the region is {V <= 1}.
    certificate : Certificate
    multipliers : tuple of Multiplier
    size : float
        Area in the window in units of z, or beta.
    programs : int
        Semidefinite programs solved.
    seconds : float
        Process time.
    containment : Containment or None
    history : tuple of float
        Size after each accepted step.
    """

    cars: tuple[ExactCar, ...]
    V: Polynomial
    certificate: Certificate
    multipliers: tuple[Multiplier, ...]
    size: float
    programs: int = 0
    seconds: float = 0.0
    containment: Containment | None = None
    history: tuple[float, ...] = ()

    def boundary(self, to_state: Array, trim: Array, rays: int = 720, level: float = 1.0) -> Array:
        """Return the boundary as states (v, omega), shape (rays, 2).

        Parameters
        ----------
        to_state : array, shape (2, 2)
            (v, omega) - trim = to_state @ z.
        trim : array, shape (2,)
        rays : int
        level : float
            Of V, if not that of the region.
        """
        turn = Rays(rays)
        return np.asarray(turn.points(turn.boundary(self.V, level)) @ to_state.T + trim)


@dataclass
class Ascent:
    """One search for a large region.

    Attributes
    ----------
    cars : tuple of ExactCar
        One V for all of them.
    goal : Goal
    stiff : array, optional
        A linearisation (2, 2), in z and per unit of time, along which V has to fall near the origin as
        well, by `_MARGIN`: that of the tyre behind the fit, whose slope at zero the fit misses.
    multiplier_degree : int
        Degree of q_2.
    steps : int
        Joint steps at most, for one degree of V.
    """

    cars: tuple[ExactCar, ...]
    goal: Goal
    stiff: Array | None = None
    multiplier_degree: int = 2
    steps: int = 40
    programs: int = 0
    room: float = _ROOM
    refused: bool = False
    started: float = field(default_factory=time.process_time)

    @property
    def fields(self) -> list[Field]:
        """The fields of the cars."""
        return [car.field for car in self.cars]

    @property
    def odd(self) -> bool:
        """Whether V is taken even."""
        return all(each.odd for each in self.fields)

    def accept(self, V: Polynomial, least: float) -> Region | None:
        """Return the certified region of a V divided by its level; None if it is not larger than `least`."""
        self.refused = False
        level = min(level_of(each, V) for each in self.fields)
        if not np.isfinite(level):
            return None
        size = np.nan
        for back_off in _BACK_OFFS:
            scaled = V * (1 / (level * (1 - back_off)))
            try:
                size = self.size(scaled)
                if size <= least:
                    return None
                found = []
                for each in self.fields:
                    self.programs += 1
                    found.append(multiplier(each, scaled, multiplier_degree=self.multiplier_degree))
                    if found[-1].margin <= 0:
                        raise CertificateError("no multiplier")
                inside = None
                if self.goal.shape is not None:
                    self.programs += 1
                    inside = containment(scaled, self.goal.shape, size, self.odd)
                certificate = certify(
                    self.cars, scaled, found, inside, multiplier_degree=self.multiplier_degree
                )
            except (ProgramError, CertificateError, ValueError) as error:
                _LOG.debug("refused %.4f: %s", size, error)
                self.refused = True
                continue
            seconds = time.process_time() - self.started
            return Region(self.cars, scaled, certificate, tuple(found), size, self.programs, seconds, inside)
        return None

    def size(self, V: Polynomial) -> float:
        """Return the area inside the window, or the beta, of {V <= 1}."""
        rays = self._rays(720)
        points = rays.points(rays.boundary(V))
        if self.goal.shape is not None:
            return float(self.goal.shape(*points.T).min()) * (1 - 1e-4)
        assert self.goal.window is not None
        return self.goal.window.area(points)

    def step(self, region: Region, degree: int, trust: float) -> Polynomial:
        """Return the V of one joint step from a certified region."""
        program = SosProgram(f"joint step, deg V = {degree}")
        V = program.polynomial(exponents_between(2, degree, even=self.odd))
        for number, (each, old) in enumerate(zip(self.fields, region.multipliers, strict=True)):
            basis = bases(each, degree, self.multiplier_degree)
            if number == 0:
                program.require_sum_of_squares("positive", V - PHI, basis.positive)
            q_2 = program.sum_of_squares(f"q_2 of {number}", basis.multiplier)
            q_old = square(bases(each, region.V.degree, self.multiplier_degree).multiplier, old.grams)
            left = falling(each, region.V, q_2) + each.floats[2] * q_old * (V - region.V)
            left = left - rise(each, V - region.V)
            program.require_sum_of_squares(
                f"falling of {number}", left - slack(basis.falling) * self.room, basis.falling
            )
        rays = self._rays(240)
        radius = rays.boundary(region.V)
        points = radius[:, None] * rays.directions
        values = V(*points.T)
        self._hold(program, values, trust)
        if self.stiff is not None:
            margin = Polynomial(np.array([[_MARGIN]]))
            program.require_positive_semidefinite(falling_near_origin(V, self.stiff, margin))
        if self.goal.shape is not None:
            self._aim_at_beta(program, V, region, degree)
        else:
            program.maximise(-(self._weights(region.V, rays, radius, points) @ values))
        self.programs += 1
        return V.value_at(program.solve().unknowns)

    def _hold(self, program: SosProgram, values: Array, trust: float) -> None:
        constant = np.zeros(values.shape[1])
        constant[0] = 1.0
        program.require_nonnegative((1 + trust) * constant - values)
        program.require_nonnegative(values - (1 - trust) * constant)

    def _weights(self, V: Polynomial, rays: Rays, radius: Array, points: Array) -> Array:
        """Return how much area each unit of V on the boundary costs, at points inside the window."""
        slope = (
            V.derivative(0)(*points.T) * points[:, 0] + V.derivative(1)(*points.T) * points[:, 1]
        ) / radius
        inside = np.ones(len(points), bool)
        if self.goal.window is not None:
            inside = self.goal.window.contains(points)
        turn = (np.pi if rays.half else 2 * np.pi) / len(radius)
        return np.asarray(np.where(inside, radius / np.maximum(slope, 1e-6) * turn, 0.0))

    def _aim_at_beta(self, program: SosProgram, V: Polynomial, region: Region, degree: int) -> None:
        """Require (7.29), linearised in q_1 and beta, and maximise beta."""
        shape, old = self.goal.shape, region.containment
        assert shape is not None and old is not None
        q_1 = program.sum_of_squares("q_1", inner_basis(max(degree - shape.degree, 0), self.odd))
        beta = program.unknown()
        left = (shape - old.beta) * q_1 - square(old.blocks, old.grams) * (beta - old.beta) - (V - 1.0)
        program.require_sum_of_squares("inside", left, inner_basis(max(degree, shape.degree), self.odd))
        program.maximise(beta(0.0, 0.0))

    def _rays(self, count: int) -> Rays:
        return Rays(count // 2 if self.odd else count, half=self.odd)

    def run(self, start: Region, degree: int) -> Region:
        """Return the region that steps from `start` lead to, in V of a degree."""
        best = self._climb(start, degree)
        seconds = time.process_time() - self.started
        return replace(best, programs=self.programs, seconds=seconds, history=best.history or (best.size,))

    def _climb(self, start: Region, degree: int) -> Region:
        best, trust, idle = start, _TRUST, 0
        history, gain = [start.size], _AREA_GAIN if self.goal.shape is None else _BETA_GAIN
        attempts = 0
        while trust >= _SMALLEST_TRUST and idle < 2 and attempts < self.steps:
            attempts += 1
            try:
                found = self.accept(self.step(best, degree, trust), best.size * (1 + 1e-6))
            except (ProgramError, ValueError) as error:
                _LOG.debug("no step: %s", error)
                found = None
            if found is None:
                _LOG.debug("degree %d: trust %.3f does not help", degree, trust)
                if self.refused and self.room < _LARGEST_ROOM:
                    self.room *= 10.0
                else:
                    trust *= 0.25
                continue
            idle = idle + 1 if found.size < best.size * (1 + gain) else 0
            trust = min(1.5 * trust, _LARGEST_TRUST)
            best = found
            history.append(best.size)
            _LOG.debug("degree %d: %.4f, trust %.3f", degree, best.size, trust)
        return best if best is start else replace(best, history=tuple(history))


_MARGIN = 0.3  # 1/s, times the unit of V: how fast V falls near the origin along `Ascent.stiff`


def ascend(
    cars: Sequence[ExactCar],
    degrees: Sequence[int],
    goal: Goal,
    to_state: Array,
    *,
    stiff: Array | None = None,
    steps: int = 40,
    multiplier_degree: int = 2,
) -> dict[int, Region]:
    """Return the largest regions found, for each degree of V in turn.

    The first begins with V_lin of (7.37) or, for several cars, with the quadratic V that suits all near the
    origin; each next one with the one before.

    Parameters
    ----------
    cars : sequence of ExactCar
        One V for all.
    degrees : sequence of int
        Even and rising.
    goal : Goal
    to_state : array, shape (2, 2)
        (v, omega) = trim + to_state @ z.
    stiff : array, optional
        See `Ascent`.
    steps : int
        Joint steps at most for each degree.
    multiplier_degree : int
        Degree of q_2. A polynomial field needs 4: with less, no V of a higher degree has room beside one of
        degree 2.

    Raises
    ------
    ProgramError
        If no level set of the first V can be certified.
    """
    search = Ascent(tuple(cars), goal, stiff, multiplier_degree, steps=steps)
    first = search.fields
    V = linear_lyapunov(first[0], to_state) if len(first) == 1 else common_lyapunov(first)
    region = search.accept(V, 0.0)
    if region is None:
        raise ProgramError("No level set of the first quadratic V can be certified: no region to begin with.")
    found = {}
    for degree in degrees:
        search = Ascent(tuple(cars), goal, stiff, multiplier_degree, steps=steps)
        region = search.run(region, degree)
        found[degree] = region
    return found


def scaled_window(window: Window, to_state: Array, trim: Array) -> Window:
    """Return a window of states as one of z."""
    return Window(window.name, window.normals @ to_state, window.limits - window.normals @ trim)


def scaling(car_matrix: Array, scale: Fraction = SCALE) -> Array:
    """Return to_state: (v, omega) - trim = to_state @ z."""
    return np.asarray(np.linalg.inv(car_matrix) * float(scale))


def ascend_beta(
    car: ExactCar, degrees: Sequence[int], shape: Polynomial, to_state: Array
) -> dict[int, Region]:
    """Return the regions with the largest {s <= beta} inside, for rising degrees of V.

    From degree 4 on a q_2 of degree 4 follows one of degree 2: it costs more and gains a half per cent.

    Raises
    ------
    ProgramError
        If no level set of V_lin can be certified.
    """
    goal, found = Goal(shape=shape), {}
    region = Ascent((car,), goal).accept(linear_lyapunov(car.field, to_state), 0.0)
    if region is None:
        raise ProgramError("No level set of V_lin (7.37) can be certified: no region to begin with.")
    multiplier_degree = 2
    for degree in degrees:
        region = Ascent((car,), goal, multiplier_degree=multiplier_degree).run(region, degree)
        if degree >= 4 and multiplier_degree == 2:
            search = Ascent((car,), goal, multiplier_degree=4)
            lifted = search.accept(region.V, 0.0)
            if lifted is not None:
                region, multiplier_degree = search.run(lifted, degree), 4
        found[degree] = region
    return found
