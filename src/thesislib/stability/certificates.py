"""From what a solver found to what is proved: Gram matrices in rational numbers, and their file.

The coefficients of V and q_2 are floats, which are rational numbers, and are kept as they are. The Gram
matrices then have to reproduce polynomials that are known exactly: what is missing after rounding is spread
over the entries that contribute to each monomial. If the solver's error is larger than the smallest
eigenvalue this spoils the matrix; it is then solved for again with all else fixed, in monomials rescaled so
that its diagonal is one. A document becomes a `Certificate` by passing
`thesislib.stability.checking.check`, and by nothing else.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from thesislib import provenance
from thesislib.stability import checking
from thesislib.stability.bivariate import Polynomial, exponents_between
from thesislib.stability.checking import CertificateError, Verdict
from thesislib.stability.fields import TIME_UNIT, ExactCar, exact, to_floats
from thesislib.stability.gram import Basis, products, split_by_parity, square
from thesislib.stability.program import ProgramError, SosProgram
from thesislib.stability.programs import EPSILON, Multiplier, bases, slack

Grams = Sequence[NDArray[np.float64]]

_PLAIN = 1e-9  # of a matrix with a unit diagonal: far above the rounding of an eigenvalue, 1e-14


@dataclass(frozen=True)
class Containment:
    """What is needed to prove {s <= beta} inside {V <= 1}.

    Attributes
    ----------
    shape : Polynomial
        s in z.
    beta : float
    blocks : tuple of bases
        Blocks of q_1.
    grams : list of arrays
        Gram matrices of q_1.
    """

    shape: Polynomial
    beta: float
    blocks: tuple[Basis, ...]
    grams: Grams


@dataclass(frozen=True)
class Certificate:
    """A region of attraction {V <= 1} with its exact proof.

    Attributes
    ----------
    document : dict
        What the JSON file holds.
    verdict : Verdict
        What the check said.
    """

    document: dict[str, Any]
    verdict: Verdict

    @cached_property
    def V(self) -> Polynomial:
        """V in z, with floats that are exactly the certificate's numbers."""
        return lyapunov_function(self.document)

    def save(self, path: str | Path) -> Path:
        """Write the JSON file and return its path."""
        path = Path(path)
        provenance.write_atomically(
            path, json.dumps(self.document, indent=None, separators=(",", ":")) + "\n"
        )
        return path


def lyapunov_function(document: Mapping[str, Any]) -> Polynomial:
    """Return V of a certificate, with floats that are exactly its numbers."""
    return Polynomial.from_terms({(i, j): float(Fraction(value)) for i, j, value in document["V"]})


def certify(
    cars: Sequence[ExactCar],
    V: Polynomial,
    multipliers: Sequence[Multiplier],
    containment: Containment | None = None,
    *,
    multiplier_degree: int = 2,
) -> Certificate:
    """Return the certificate that {V <= 1} is a region of attraction of the cars.

    Parameters
    ----------
    cars : sequence of ExactCar
    V : Polynomial
        With float coefficients, in z.
    multipliers : sequence of Multiplier
        For each car.
    containment : Containment, optional
    multiplier_degree : int
        Degree of q_2.

    Raises
    ------
    CertificateError
        If the numbers do not hold up in exact arithmetic.
    """
    basis = bases(cars[0].field, V.degree, multiplier_degree)
    exact_V = _exactly(V)
    phi = Polynomial.from_terms(dict.fromkeys([(2, 0), (0, 2)], exact(Fraction(EPSILON))))
    below = exact_V - fmpq(1)
    document: dict[str, Any] = {
        "format": checking.FORMAT,
        "scale": str(cars[0].scale),
        "time_unit": str(TIME_UNIT),
        "epsilon": str(Fraction(EPSILON)),
        "gamma": "1",
        "cars": [_car(car) for car in cars],
        "V": [[i, j, _text(value)] for (i, j), value in exact_V.terms()],
        "positive": _proof("(7.28)", exact_V - phi, basis.positive, None),
        "falling": [],
    }
    for car, multiplier in zip(cars, multipliers, strict=True):
        field = car.field
        q_grams = [_rounded(_definite(gram)) for gram in multiplier.grams]
        q_2 = square(basis.multiplier, q_grams)
        rise = field.n[0] * exact_V.derivative(0) + field.n[1] * exact_V.derivative(1)
        left = field.d * (q_2 * below - phi) - rise
        proof = _proof("(7.30)", left, basis.falling, multiplier.falling)
        document["falling"].append({"multiplier": _part(basis.multiplier, q_grams), **proof})
    if containment is not None:
        q_grams = [_rounded(_definite(gram)) for gram in containment.grams]
        q_1 = square(containment.blocks, q_grams)
        shape, beta = _exactly(containment.shape), fmpq(*float(containment.beta).as_integer_ratio())
        left = q_1 * (shape - beta) - below
        inner = inner_basis(max(V.degree, shape.degree), cars[0].field.odd)
        document["contains"] = {
            "shape": [[i, j, _text(value)] for (i, j), value in shape.terms()],
            "beta": _text(beta),
            "multiplier": _part(containment.blocks, q_grams),
            **_proof("(7.29)", left, inner, None),
        }
    return Certificate(document, checking.check(document))


def inner_basis(degree: int, even: bool) -> tuple[Basis, ...]:
    """Return the blocks of monomials up to half a degree, constants included: those of (7.29) and of q_1."""
    return split_by_parity(exponents_between(0, degree // 2), even)


def _proof(name: str, polynomial: Polynomial, blocks: Sequence[Basis], grams: Grams | None) -> dict[str, Any]:
    """Return bases and exact Gram matrices of a polynomial with exact coefficients."""
    if grams is not None:
        found = _completed(polynomial, blocks, grams)
        if all(_plainly_definite(gram) or checking._semidefinite(_lower(gram)) for gram in found):
            return _part(blocks, found)
    found = _completed(polynomial, blocks, _solved(name, to_floats(polynomial), blocks, grams))
    return _part(blocks, found)


def _solved(name: str, polynomial: Polynomial, blocks: Sequence[Basis], grams: Grams | None) -> Grams:
    """Return Gram matrices of a known polynomial, as far inside the cone as they go.

    In the basis z_i sqrt(Q_ii), where Q is the first answer, all monomials matter alike.
    """
    if grams is None:
        grams = _largest_slack(name, polynomial, blocks, [np.ones(len(block)) for block in blocks])
    weights = [np.sqrt(np.maximum(np.diag(gram), 1e-12)) for gram in grams]
    return _largest_slack(name, polynomial, blocks, weights)


def _largest_slack(
    name: str, polynomial: Polynomial, blocks: Sequence[Basis], weights: Sequence[NDArray[np.float64]]
) -> Grams:
    program = SosProgram(f"exact Gram matrix of {name}")
    t = program.unknown()
    program.require_sum_of_squares(name, polynomial - slack(blocks) * t, blocks, weights)
    program.maximise(t(0.0, 0.0))
    try:
        found = program.solve()
    except ProgramError as error:
        raise CertificateError(f"The certificate fails: {error}") from error
    return [
        gram + found.objective * np.diag([0.25 ** sum(e) for e in block])
        for gram, block in zip(found.grams[name], blocks, strict=True)
    ]


def _completed(polynomial: Polynomial, blocks: Sequence[Basis], grams: Grams) -> list[NDArray[Any]]:
    """Return exact Gram matrices near `grams` that reproduce the polynomial."""
    matrices = [_rounded(gram) for gram in grams]
    missing = polynomial - square(blocks, matrices)
    places = products(blocks)
    for exponents, value in missing.terms():
        if exponents not in places:
            raise CertificateError(
                f"The certificate fails: the monomial {exponents} is not a product of two of the basis."
            )
        found = places[exponents]
        count = sum(1 if a == b else 2 for _, a, b in found)
        for k, a, b in found:
            matrices[k][a, b] += value / count
            if a != b:
                matrices[k][b, a] = matrices[k][a, b]
    return matrices


def _plainly_definite(gram: NDArray[Any]) -> bool:
    """Say whether rounding cannot hide that a matrix is positive definite.

    This only saves the exact factorisation, the slowest part of a certificate, when it is clear how it will
    end; `checking.check` goes through it in any case.
    """
    floats = np.array([[float(value) for value in row] for row in gram])
    diagonal = np.diag(floats)
    if (diagonal <= 0).any():
        return False
    return bool(np.linalg.eigvalsh(floats / np.sqrt(np.outer(diagonal, diagonal)))[0] > _PLAIN)


def _definite(gram: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a matrix moved inside the cone by a part in 1e9 of its largest eigenvalue."""
    values, vectors = np.linalg.eigh(gram)
    return np.asarray(vectors * np.maximum(values, 1e-9 * max(values[-1], 1e-9)) @ vectors.T)


def _rounded(gram: NDArray[np.float64]) -> NDArray[Any]:
    symmetric = (gram + gram.T) / 2
    return np.vectorize(lambda value: fmpq(*float(value).as_integer_ratio()), otypes=[object])(symmetric)


def _exactly(p: Polynomial) -> Polynomial:
    return Polynomial.from_terms({e: fmpq(*float(value).as_integer_ratio()) for e, value in p.terms()})


def _lower(gram: NDArray[Any]) -> list[list[fmpq]]:
    return [[gram[r, c] for c in range(r + 1)] for r in range(len(gram))]


def _part(blocks: Sequence[Basis], grams: Sequence[NDArray[Any]]) -> dict[str, Any]:
    return {
        "bases": [[list(e) for e in block] for block in blocks],
        "grams": [[[_text(value) for value in row] for row in _lower(gram)] for gram in grams],
    }


def _text(value: fmpq) -> str:
    return str(value)


def _car(car: ExactCar) -> dict[str, Any]:
    numbers: Mapping[str, Any] = {
        name: str(getattr(car, name)) for name in ("mass", "I_z", "a", "b", "u_0", "delta", "acceleration")
    }
    axles = {
        name: {
            "numerator": [str(c) for c in tyre[0]],
            "denominator": [str(c) for c in tyre[1]],
            "factor": str(factor),
            "trim": str(trim),
            **({"moment": [str(c) for c in moment]} if moment else {}),
        }
        for name, tyre, factor, trim, moment in (
            ("front", car.front, car.front_factor, car.trim[0], car.front_moment),
            ("rear", car.rear, car.rear_factor, car.trim[1], car.rear_moment),
        )
    }
    forcing = {"forcing": [str(c) for c in car.forcing]} if any(car.forcing) else {}
    return {**numbers, **forcing, **axles}
