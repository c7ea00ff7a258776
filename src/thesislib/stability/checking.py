"""Check a certificate of a region of attraction in exact arithmetic. Nothing here knows how it was found.

This module imports python-flint's rational numbers, the standard library and nothing else. From the car's
numbers it builds the polynomial equations of motion again, and then verifies

* that the origin is an equilibrium and the tyres' denominators have no root;
* (7.28): V - phi_1 is z'Qz, coefficient by coefficient, with Q positive semidefinite by exact LDL';
* (7.30) in the same way for each car, with q_2 a sum of squares;
* (7.29), if the certificate claims that a set {s <= beta} is inside.

Then {V <= gamma} is bounded and invariant, and every motion from it ends at the equilibrium (lemma 7.1). If
several cars are named, this holds for each of them, and for every car whose field is, multiplied by its
speed, an average of theirs, also if that average changes with time: dV/dt is then the same average.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flint import fmpq

__all__ = ["FORMAT", "CertificateError", "Verdict", "check", "check_file"]

FORMAT = "thesislib region of attraction, 1"

Terms = dict[tuple[int, int], fmpq]


class CertificateError(ValueError):
    """A document that is no certificate, or one that does not prove what it claims; the message says why."""


@dataclass(frozen=True)
class Verdict:
    """What a valid certificate proves.

    Attributes
    ----------
    degree : int
        Degree of V.
    cars : int
        Number of cars for which the set is invariant.
    gamma : float
        Level of the set {V <= gamma}.
    beta : float or None
        Level of the shape function whose set is inside, if the certificate says so.
    """

    degree: int
    cars: int
    gamma: float
    beta: float | None

    def __str__(self) -> str:
        cars = "one car" if self.cars == 1 else f"{self.cars} cars and all their averages"
        inside = "" if self.beta is None else f"; it contains {{s <= {self.beta:.6g}}}"
        return (
            f"{{V <= {self.gamma:.6g}}}, deg V = {self.degree}, is a region of attraction for {cars}{inside}"
        )


def check_file(path: str | Path) -> Verdict:
    """Check a certificate in a JSON file.

    Raises
    ------
    CertificateError
        If the file cannot be read, is no certificate, or does not prove its claim.
    """
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise CertificateError(f"{path} cannot be read: {error}.") from error
    except json.JSONDecodeError as error:
        raise CertificateError(f"{path} is not JSON: {error}.") from error
    return check(document)


def check(document: Any) -> Verdict:
    """Check a certificate.

    Parameters
    ----------
    document : mapping
        As in the JSON file; numbers are texts "p/q".

    Raises
    ------
    CertificateError
        If it is malformed or does not prove its claim; one sentence says which condition fails.
    """
    if not isinstance(document, Mapping) or document.get("format") != FORMAT:
        raise CertificateError(f"This is no certificate: it does not say format = {FORMAT!r}.")
    try:
        return _check(document)
    except CertificateError:
        raise
    except (KeyError, TypeError, ValueError, IndexError, ZeroDivisionError, AttributeError) as error:
        raise CertificateError(f"The certificate is malformed: {type(error).__name__}: {error}.") from error


def _check(document: Mapping[str, Any]) -> Verdict:
    scale, time_unit, epsilon, gamma = (
        _number(document[k]) for k in ("scale", "time_unit", "epsilon", "gamma")
    )
    _require(min(scale, time_unit, epsilon, gamma) > 0, "scale, time unit, epsilon and gamma are positive")
    V = _terms(document["V"])
    _require(all(sum(e) >= 2 for e in V), "V has neither a constant nor linear terms")
    phi: Terms = {(2, 0): epsilon, (0, 2): epsilon}
    _require_sum_of_squares("(7.28), V - phi_1", _add(V, phi, fmpq(-1)), document["positive"])
    below = _add(V, {(0, 0): fmpq(1)}, -gamma)
    cars, proofs = document["cars"], document["falling"]
    _require(len(cars) == len(proofs) > 0, "there is one proof of (7.30) for each car")
    for number, (car, proof) in enumerate(zip(cars, proofs, strict=True), start=1):
        which = f"(7.30) of car {number}"
        n_1, n_2, d = _field(car, scale, time_unit)
        _require((0, 0) not in n_1 and (0, 0) not in n_2, f"the origin is an equilibrium of car {number}")
        q_2 = _sum_of_squares(f"q_2 of car {number}", proof["multiplier"])
        rise = _add(_multiply(_derivative(V, 0), n_1), _multiply(_derivative(V, 1), n_2))
        left = _add(_multiply(d, _add(_multiply(q_2, below), phi, fmpq(-1))), rise, fmpq(-1))
        _require_sum_of_squares(which, left, proof)
    beta = None
    if "contains" in document:
        inside = document["contains"]
        beta = _number(inside["beta"])
        q_1 = _sum_of_squares("q_1", inside["multiplier"])
        shape = _add(_terms(inside["shape"]), {(0, 0): fmpq(1)}, -beta)
        _require_sum_of_squares("(7.29)", _add(_multiply(q_1, shape), below, fmpq(-1)), inside)
    return Verdict(max(map(sum, V)), len(cars), _float(gamma), None if beta is None else _float(beta))


def _field(car: Mapping[str, Any], scale: fmpq, time_unit: fmpq) -> tuple[Terms, Terms, Terms]:
    """Return n_1, n_2 and d of the equations of motion (7.4), (7.5) in scaled slips about the trim.

    With alpha_i = alpha_i* + scale z_i, xi_f = alpha_f + delta and xi_r = alpha_r,
    alpha_f' = (F_f + F_r - Y)/(M u) + a (a F_f - b F_r + M_f + M_r - N)/(I u) - u (xi_f - xi_r)/l
               - u' xi_f/u,
    and alpha_r' with -b for the first a and xi_r for xi_f in the last term. The constant side force Y and yaw
    moment N and the axles' own moments M_f, M_r are zero where they are not named.
    """
    mass, I_z, a, b, u, delta, acceleration = (
        _number(car[k]) for k in ("mass", "I_z", "a", "b", "u_0", "delta", "acceleration")
    )
    _require(min(mass, I_z, a, b, u) > 0, "mass, inertia, lengths and speed are positive")
    axles = []
    for axis, name in enumerate(("front", "rear")):
        tyre = car[name]
        factor, trim = _number(tyre["factor"]), _number(tyre["trim"])
        _require(factor > 0, f"the {name} tyre's factor is positive")
        numerator, denominator = ([_number(c) for c in tyre[k]] for k in ("numerator", "denominator"))
        _require_no_root(denominator, name)
        at_trim = _value(denominator, trim)
        moment = [_number(c) for c in tyre.get("moment", ())]
        F, D, M = (
            {((k, 0) if axis == 0 else (0, k)): c / at_trim for k, c in enumerate(_shifted(p, trim, scale))}
            for p in (numerator, denominator, moment)
        )
        xi = {(0, 0): trim + (delta if axis == 0 else 0), ((1, 0) if axis == 0 else (0, 1)): scale}
        axles.append((_scaled(F, factor), D, M, xi))
    (N_f, D_f, L_f, xi_f), (N_r, D_r, L_r, xi_r) = axles
    F_f, F_r, d = _multiply(N_f, D_r), _multiply(N_r, D_f), _multiply(D_f, D_r)
    side, yaw = (_number(c) for c in car.get("forcing", ("0", "0")))
    M = _add(_add(_multiply(L_f, D_r), _multiply(L_r, D_f)), d, -yaw)
    turning = _scaled(_add(xi_f, xi_r, fmpq(-1)), u / (a + b))
    result = []
    for lever, xi in ((a, xi_f), (-b, xi_r)):
        force = _add(
            _scaled(F_f, 1 / (mass * u) + lever * a / (I_z * u)),
            _scaled(F_r, 1 / (mass * u) - lever * b / (I_z * u)),
        )
        force = _add(_add(force, M, lever / (I_z * u)), d, -side / (mass * u))
        rest = _multiply(d, _add(turning, xi, acceleration / u))
        result.append(_scaled(_add(force, rest, fmpq(-1)), time_unit / scale))
    return result[0], result[1], d


def _require_no_root(denominator: Sequence[fmpq], name: str) -> None:
    """Require a positive constant or c_0 + c_2 alpha² + c_4 alpha⁴ without a real root."""
    c = [*denominator, *[fmpq(0)] * (5 - len(denominator))]
    even = len(c) == 5 and c[1] == 0 and c[3] == 0 and c[0] > 0
    constant = even and c[2] == 0 and c[4] == 0
    quartic = even and c[4] > 0 and (c[2] >= 0 or c[2] * c[2] < 4 * c[0] * c[4])
    _require(constant or quartic, f"the {name} tyre's denominator has no root")


def _shifted(p: Sequence[fmpq], trim: fmpq, scale: fmpq) -> list[fmpq]:
    """Return the coefficients of p(trim + scale z), by Horner's rule."""
    result: list[fmpq] = []
    for c in reversed(p):
        moved = [fmpq(0), *result]
        result = [
            (moved[k] * scale if k else fmpq(0)) + (result[k] * trim if k < len(result) else 0)
            for k in range(len(moved))
        ]
        result[0] += c
    return result


def _value(p: Sequence[fmpq], x: fmpq) -> fmpq:
    total = fmpq(0)
    for c in reversed(p):
        total = total * x + c
    return total


def _sum_of_squares(name: str, part: Mapping[str, Any]) -> Terms:
    """Return z'Qz of the blocks of a part, having verified that each Q is positive semidefinite."""
    total: Terms = {}
    for basis, rows in zip(part["bases"], part["grams"], strict=True):
        monomials = [(int(i), int(j)) for i, j in basis]
        _require(all(min(m) >= 0 for m in monomials), f"the monomials of {name} have no negative exponents")
        lower = [[_number(c) for c in row] for row in rows]
        _require(
            len(lower) == len(monomials) and all(len(row) == k + 1 for k, row in enumerate(lower)),
            f"the Gram matrices of {name} fit their bases",
        )
        for r, row in enumerate(lower):
            for c, value in enumerate(row):
                key = (monomials[r][0] + monomials[c][0], monomials[r][1] + monomials[c][1])
                total[key] = total.get(key, fmpq(0)) + (value if r == c else 2 * value)
        _require(_semidefinite(lower), f"the Gram matrix of {name} is positive semidefinite")
    return {key: value for key, value in total.items() if value != 0}


def _require_sum_of_squares(name: str, polynomial: Terms, part: Mapping[str, Any]) -> None:
    squares = _sum_of_squares(name, {"bases": part["bases"], "grams": part["grams"]})
    _require(squares == polynomial, f"{name} equals its sum of squares, coefficient by coefficient")


def _semidefinite(lower: list[list[fmpq]]) -> bool:
    """Say whether a symmetric matrix, given by the rows of its lower triangle, has no negative eigenvalue.

    Exact LDL' without pivoting: a zero pivot is allowed if its column is zero, and no pivot is negative.
    """
    a = [list(row) for row in lower]
    n = len(a)
    for k in range(n):
        pivot = a[k][k]
        if pivot < 0:
            return False
        if pivot == 0:
            if any(a[i][k] != 0 for i in range(k + 1, n)):
                return False
            continue
        for i in range(k + 1, n):
            if a[i][k] == 0:
                continue
            factor = a[i][k] / pivot
            for j in range(k + 1, i + 1):
                a[i][j] -= factor * a[j][k]
    return True


def _terms(entries: Sequence[Sequence[Any]]) -> Terms:
    found: Terms = {}
    for i, j, value in entries:
        key = (int(i), int(j))
        _require(min(key) >= 0 and key not in found, "each monomial of a polynomial is named once")
        found[key] = _number(value)
    return {key: value for key, value in found.items() if value != 0}


_ONE = fmpq(1)


def _add(p: Terms, q: Terms, factor: fmpq = _ONE) -> Terms:
    total = dict(p)
    for key, value in q.items():
        total[key] = total.get(key, fmpq(0)) + factor * value
    return {key: value for key, value in total.items() if value != 0}


def _scaled(p: Terms, factor: fmpq) -> Terms:
    return {key: factor * value for key, value in p.items() if value != 0}


def _multiply(p: Terms, q: Terms) -> Terms:
    total: Terms = {}
    for (i, j), left in p.items():
        for (k, m), right in q.items():
            key = (i + k, j + m)
            total[key] = total.get(key, fmpq(0)) + left * right
    return {key: value for key, value in total.items() if value != 0}


def _derivative(p: Terms, axis: int) -> Terms:
    return {
        ((e[0] - 1, e[1]) if axis == 0 else (e[0], e[1] - 1)): e[axis] * value
        for e, value in p.items()
        if e[axis]
    }


def _number(text: Any) -> fmpq:
    if not isinstance(text, str):
        raise TypeError(f"{text!r} is not a rational number written as a text")
    numerator, _, denominator = text.partition("/")
    return fmpq(int(numerator), int(denominator or "1"))


def _float(value: fmpq) -> float:
    return int(value.p) / int(value.q)


def _require(holds: bool, condition: str) -> None:
    if not holds:
        raise CertificateError(f"The certificate fails: it is not so that {condition}.")
