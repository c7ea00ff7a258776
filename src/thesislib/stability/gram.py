"""Which monomials the Gram matrix of a sum of squares needs: half the Newton polytope, split by parity.

If p = sum of f_i^2, the exponents of the f_i lie in half the convex hull of the exponents of p. Taking all
monomials up to half the degree instead puts rows and columns into the matrix of (7.15) that must be
zero: a program without interior, on which interior-point methods stall.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from thesislib.stability.bivariate import Exponents, Polynomial

Basis = tuple[Exponents, ...]


def newton_basis(support: Iterable[Exponents]) -> Basis:
    """Return the exponents in half the convex hull of `support`.

    Raises
    ------
    ValueError
        If the support is empty.
    """
    points = np.array(sorted(set(support)), dtype=float)
    if len(points) == 0:
        raise ValueError("The zero polynomial has no Newton polytope.")
    upper = (points.max(axis=0) / 2).astype(int)
    candidates = np.array(list(itertools.product(range(upper[0] + 1), range(upper[1] + 1))))
    try:
        faces = ConvexHull(points).equations
    except QhullError:  # all on a line, or fewer than three points
        inside = [_on_segment(points, 2 * candidate) for candidate in candidates]
    else:
        inside = (2 * candidates @ faces[:, :2].T + faces[:, 2] <= 1e-9).all(axis=1)
    found = [(int(i), int(j)) for i, j in candidates[np.asarray(inside)]]
    return tuple(sorted(found, key=lambda e: (e[0] + e[1], e[1])))


def _on_segment(points: NDArray[np.float64], point: NDArray[np.int64]) -> bool:
    ends = points[[0, -1]]
    length = np.hypot(*(ends[1] - ends[0]))
    return bool(abs(np.hypot(*(ends[0] - point)) + np.hypot(*(ends[1] - point)) - length) < 1e-9)


def split_by_parity(basis: Sequence[Exponents], even: bool) -> tuple[Basis, ...]:
    """Return one block or, for an even polynomial, the odd and the even monomials apart."""
    if not even:
        return (tuple(basis),)
    blocks = (tuple(e for e in basis if sum(e) % 2 == parity) for parity in (1, 0))
    return tuple(block for block in blocks if block)


def products(blocks: Sequence[Basis]) -> dict[Exponents, list[tuple[int, int, int]]]:
    """Return for each monomial where it occurs: block, row and column, row <= column."""
    found: dict[Exponents, list[tuple[int, int, int]]] = {}
    for k, block in enumerate(blocks):
        for (a, first), (b, second) in itertools.combinations_with_replacement(enumerate(block), 2):
            found.setdefault((first[0] + second[0], first[1] + second[1]), []).append((k, a, b))
    return found


def square(blocks: Sequence[Basis], grams: Sequence[Any]) -> Polynomial:
    """Return z'Qz summed over the blocks; exact if the matrices' entries are."""
    terms: dict[Exponents, Any] = {}
    for exponents, places in products(blocks).items():
        total: Any = 0
        for k, a, b in places:
            total += grams[k][a][b] if a == b else 2 * grams[k][a][b]
        terms[exponents] = total
    return Polynomial.from_terms(terms)
