"""Algorithm 7.1 of the thesis: gamma, beta and V in turns, each by a convex program.

The gamma and the beta step are bisections. The V step asks for any V that satisfies (7.28) to (7.30); the
algorithm does not say which. Here it is the one with the largest common slack, which leaves the next gamma
step the most room.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thesislib.stability.bivariate import Polynomial, exponents_between
from thesislib.stability.certificates import Certificate, Containment, certify, inner_basis
from thesislib.stability.checking import CertificateError
from thesislib.stability.fields import ExactCar, Field
from thesislib.stability.gram import square
from thesislib.stability.program import ProgramError, SosProgram
from thesislib.stability.programs import (
    PHI,
    Multiplier,
    bases,
    level_of,
    linear_lyapunov,
    multiplier,
    slack,
)
from thesislib.stability.rays import Rays

_BISECTION = 1e-4  # relative width at which a bisection ends
_BACK_OFFS = (1e-3, 5e-3, 2e-2)


@dataclass(frozen=True)
class Alternation:
    """What Algorithm 7.1 ends with.

    Attributes
    ----------
    V : Polynomial
        In z, divided by gamma.
    beta : float
        Largest certified level of s inside {V <= 1}.
    certificate : Certificate
    rounds : int
        Times that all three steps were gone through.
    programs : int
    seconds : float
        Process time.
    history : tuple of float
        beta after each round.
    """

    V: Polynomial
    beta: float
    certificate: Certificate
    rounds: int
    programs: int
    seconds: float
    history: tuple[float, ...]


def alternate(
    car: ExactCar,
    shape: Polynomial,
    degree: int,
    to_state: NDArray[np.float64],
    *,
    rounds: int = 25,
    improvement: float = 1e-3,
) -> Alternation:
    """Return what Algorithm 7.1 makes of V_lin.

    Parameters
    ----------
    car : ExactCar
    shape : Polynomial
        s in z, even in z if the field is odd.
    degree : int
        Degree of V from the first V step on.
    to_state : array, shape (2, 2)
        (v, omega) = trim + to_state @ z.
    rounds : int
        Largest number of rounds.
    improvement : float
        Relative growth of beta below which the algorithm ends, two rounds in a row.

    Raises
    ------
    ProgramError
        If no level set of V_lin can be certified, or no set in the end.
    """
    started = time.process_time()
    search = _Search(car, shape)
    V, history, idle = linear_lyapunov(car.field, to_state), [0.0], 0
    best: tuple[Polynomial, float] | None = None
    while len(history) <= rounds and idle < 2:
        try:
            V, q_2 = search.gamma_step(V)
            beta, q_1 = search.beta_step(V)
        except ProgramError:
            if best is None:
                raise
            break
        idle = idle + 1 if beta < history[-1] * (1 + improvement) else 0
        if beta > history[-1]:
            best = V, beta
        history.append(max(beta, history[-1]))
        try:
            V = search.V_step(q_1, q_2, beta, degree)
        except ProgramError:
            break
    assert best is not None, "the first round either raises or finds a beta"
    V, beta, certificate = search.certified(best[0])
    seconds = time.process_time() - started
    return Alternation(V, beta, certificate, len(history) - 1, search.programs, seconds, tuple(history[1:]))


class _Search:
    def __init__(self, car: ExactCar, shape: Polynomial) -> None:
        self.car, self.shape, self.programs = car, shape, 0
        self.field: Field = car.field
        self.even = self.field.odd and all(sum(e) % 2 == 0 for e in shape.support)

    def gamma_step(self, V: Polynomial) -> tuple[Polynomial, Multiplier]:
        """Return V divided by the largest gamma, and the q_2 that goes with it."""
        highest = level_of(self.field, V)
        found: dict[float, Multiplier] = {}

        def holds(gamma: float) -> bool:
            self.programs += 1
            try:
                found[gamma] = multiplier(self.field, V * (1 / gamma))
            except ProgramError:
                return False
            return found[gamma].margin > 0

        gamma = _largest(holds, 0.5 * highest, highest, "gamma step: no level of V can be certified")
        return V * (1 / gamma), found[gamma]

    def beta_step(self, V: Polynomial) -> tuple[float, Polynomial]:
        """Return the largest beta, and the q_1 that goes with it."""
        rays = Rays(720)
        highest = float(self.shape(*rays.points(rays.boundary(V)).T).min())
        found: dict[float, Containment] = {}

        def holds(beta: float) -> bool:
            self.programs += 1
            try:
                found[beta] = containment(V, self.shape, beta, self.even)
            except ProgramError:
                return False
            return True

        beta = _largest(holds, 0.5 * highest, highest, "beta step: no level of s is inside")
        return beta, square(found[beta].blocks, found[beta].grams)

    def V_step(self, q_1: Polynomial, q_2: Multiplier, beta: float, degree: int) -> Polynomial:
        """Return the V with the largest slack for fixed gamma, beta, q_1 and q_2."""
        basis = bases(self.field, degree)
        inner = inner_basis(max(degree, self.shape.degree), self.even)
        program = SosProgram(f"V step, deg V = {degree}")
        V = program.polynomial(exponents_between(2, degree, even=self.even))
        t = program.unknown()
        q = q_2.polynomial(basis.multiplier)
        program.require_sum_of_squares("positive", V - PHI, basis.positive)
        program.require_sum_of_squares("inside", (self.shape - beta) * q_1 - (V - 1.0), inner)
        program.require_sum_of_squares(
            "falling", falling_with(self.field, V, q) - slack(basis.falling) * t, basis.falling
        )
        program.require_nonnegative(t(0.0, 0.0)[0])
        program.maximise(t(0.0, 0.0))
        self.programs += 1
        return V.value_at(program.solve().unknowns)

    def certified(self, V: Polynomial) -> tuple[Polynomial, float, Certificate]:
        """Return V, beta and the certificate at the highest level that is certified."""
        rays = Rays(720)
        for back_off in _BACK_OFFS:
            scaled = V * (1 / (1 - back_off))
            beta = float(self.shape(*rays.points(rays.boundary(scaled)).T).min()) * (1 - 1e-4)
            try:
                found = multiplier(self.field, scaled)
                inside = containment(scaled, self.shape, beta, self.even)
                return scaled, beta, certify([self.car], scaled, [found], inside)
            except (ProgramError, CertificateError):
                continue
        raise ProgramError(f"Algorithm 7.1, deg V = {V.degree}: no level of its V passes the exact check.")


def falling_with(field: Field, V: Polynomial, q_2: Polynomial) -> Polynomial:
    """Return the left-hand side of (7.30) for a known q_2 and an unknown V."""
    n_1, n_2, d = field.floats
    rise = n_1 * V.derivative(0) + n_2 * V.derivative(1)
    return d * q_2 * (V - 1.0) - rise - d * PHI


def containment(V: Polynomial, shape: Polynomial, beta: float, even: bool) -> Containment:
    """Return the q_1 with the largest slack in (7.29).

    Raises
    ------
    ProgramError
        If {s <= beta} cannot be shown to be inside {V <= 1}.
    """
    blocks = inner_basis(max(V.degree - shape.degree, 0), even)
    inner = inner_basis(max(V.degree, shape.degree), even)
    program = SosProgram(f"beta step, deg V = {V.degree}")
    q_1 = program.sum_of_squares("q_1", blocks)
    t = program.unknown()
    program.require_sum_of_squares("inside", (shape - beta) * q_1 - (V - 1.0) - slack(inner) * t, inner)
    program.maximise(t(0.0, 0.0))
    found = program.solve()
    if found.objective < 0:
        raise ProgramError(f"{program.name}: {{s <= {beta:.6g}}} is not inside.")
    return Containment(shape, beta, blocks, found.grams["q_1"])


def _largest(holds: Callable[[float], bool], low: float, high: float, failure: str) -> float:
    """Return the largest number for which something holds, by bisection from below a known upper bound."""
    nearly = high * (1 - _BISECTION)
    if holds(nearly):
        return nearly
    while not holds(low):
        low, high = 0.5 * low, low
        if low < 1e-6:
            raise ProgramError(failure + ".")
    while high - low > _BISECTION * high:
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low
