"""The mesh: intervals of the unit range, each with its own number of collocation points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thesislib.ocp.quadrature import FLIPPED_RADAU, RADAU, Array, Rule, interpolation_matrix


@dataclass(frozen=True, eq=False)
class Mesh:
    """Mesh intervals on [0, 1] and the collocation points in them.

    Parameters
    ----------
    boundaries : ndarray, shape (K + 1,)
        Mesh points, increasing from 0 to 1, as fractions of the independent variable's range.
    orders : ndarray of int, shape (K,)
        Collocation points per interval, each at least 1.
    rule : Rule
        `RADAU`, whose points include an interval's start, or `FLIPPED_RADAU`, whose points include its
        end: the choice where the dynamics are singular or stiff at the start. States have a value at
        the points and at the one end that these leave out.

    Raises
    ------
    ValueError
        If the mesh points do not increase from 0 to 1, an interval has no point, or the points of the
        rule include neither or both ends.
    """

    boundaries: Array
    orders: np.ndarray
    rule: Rule = RADAU

    def __post_init__(self) -> None:
        boundaries = np.asarray(self.boundaries, dtype=float)
        orders = np.asarray(self.orders, dtype=int)
        if orders.ndim != 1 or boundaries.shape != (len(orders) + 1,):
            raise ValueError(f"{len(boundaries)} mesh points do not bound {len(orders)} mesh intervals")
        if boundaries[0] != 0 or boundaries[-1] != 1 or np.any(np.diff(boundaries) <= 0):
            raise ValueError("mesh points must increase from 0 to 1")
        if orders.min() < 1:
            raise ValueError(f"mesh interval {int(orders.argmin())} has no collocation point")
        if self.rule not in (RADAU, FLIPPED_RADAU):
            raise ValueError(f"collocation takes Radau points or flipped ones, not {self.rule.name} points")
        object.__setattr__(self, "boundaries", boundaries)
        object.__setattr__(self, "orders", orders)

    @classmethod
    def uniform(cls, intervals: int, order: int, rule: Rule = RADAU) -> Mesh:
        """Return `intervals` equal intervals with `order` collocation points each."""
        return cls(np.linspace(0, 1, intervals + 1), np.full(intervals, order), rule)

    @property
    def intervals(self) -> int:
        """Number of mesh intervals K."""
        return len(self.orders)

    @cached_property
    def points(self) -> int:
        """Number of collocation points N."""
        return int(self.orders.sum())

    @cached_property
    def first(self) -> np.ndarray:
        """Index of the first collocation point of each interval, shape (K,)."""
        return np.concatenate(([0], np.cumsum(self.orders)[:-1]))

    @cached_property
    def interval(self) -> np.ndarray:
        """Interval of each collocation point, shape (N,)."""
        return np.repeat(np.arange(self.intervals), self.orders)

    @cached_property
    def widths(self) -> Array:
        """Widths of the intervals, shape (K,)."""
        return np.diff(self.boundaries)

    @cached_property
    def half_widths(self) -> Array:
        """Half the width of the interval of each collocation point, shape (N,)."""
        return 0.5 * self.widths[self.interval]

    @cached_property
    def collocation(self) -> Array:
        """Collocation points in [0, 1], shape (N,)."""
        return self.map_points(self.rule.points)

    @cached_property
    def nodes(self) -> Array:
        """Collocation points and the end they leave out, where the states live, shape (N + 1,)."""
        if self.rule.start:
            return np.append(self.collocation, 1.0)
        return np.concatenate(([0.0], self.collocation))

    @property
    def collocated(self) -> slice:
        """The nodes that are collocation points."""
        return slice(0, self.points) if self.rule.start else slice(1, self.points + 1)

    @cached_property
    def rule_weights(self) -> Array:
        """Quadrature weights of the collocation points on [-1, 1], shape (N,)."""
        return np.concatenate([self.rule.weights(int(n)) for n in self.orders])

    @cached_property
    def weights(self) -> Array:
        """Quadrature weights of the collocation points on [0, 1], shape (N,); they sum to one."""
        return self.half_widths * self.rule_weights

    def map_points(self, rule: Callable[[int], Array]) -> Array:
        """Return the points `rule(n)` of [-1, 1] carried into every interval, shape (sum n,)."""
        parts = [
            start + 0.5 * width * (1 + rule(int(n)))
            for start, width, n in zip(self.boundaries[:-1], self.widths, self.orders, strict=True)
        ]
        return np.concatenate(parts)

    def by_order(self) -> Iterator[tuple[int, np.ndarray]]:
        """Yield each order in use with the intervals that have it, for vectorised work."""
        for order in np.unique(self.orders):
            yield int(order), np.flatnonzero(self.orders == order)

    def halved(self) -> Mesh:
        """Return the mesh with every interval halved, orders kept."""
        middles = 0.5 * (self.boundaries[:-1] + self.boundaries[1:])
        boundaries = np.sort(np.concatenate((self.boundaries, middles)))
        return Mesh(boundaries, np.repeat(self.orders, 2), self.rule)

    def divided(self, longest: float) -> Mesh:
        """Return the mesh with every interval wider than `longest` in equal parts.

        The parts of a divided interval get two collocation points less than it had, but at
        least three: halving the width is worth about as much as two points.
        """
        # the remainder of a rounded quotient must not make a part more
        parts = np.maximum(1, np.ceil(self.widths / longest - 1e-9).astype(int))
        steps = np.repeat(self.widths / parts, parts)
        within = np.concatenate([np.arange(1, count + 1) for count in parts])
        ends = np.repeat(self.boundaries[:-1], parts) + within * steps
        ends[np.cumsum(parts) - 1] = self.boundaries[1:]
        orders = np.where(parts > 1, np.maximum(self.orders - 2, np.minimum(self.orders, 3)), self.orders)
        return Mesh(np.concatenate(([0.0], ends)), np.repeat(orders, parts), self.rule)

    def interpolate_states(self, values: Array, fractions: Array) -> Array:
        """Evaluate state polynomials (2.143), supported by an interval's points and the end they leave out.

        Parameters
        ----------
        values : ndarray, shape (m, N + 1)
            States at the nodes.
        fractions : ndarray, shape (k,)
            Places in [0, 1].

        Returns
        -------
        ndarray, shape (m, k)
        """
        return self._interpolate(values, fractions, self.rule.support)

    def interpolate_controls(self, values: Array, fractions: Array) -> Array:
        """Evaluate control polynomials (2.156), supported by an interval's collocation points.

        Parameters
        ----------
        values : ndarray, shape (m, N)
            Controls at the collocation points.
        fractions : ndarray, shape (k,)
            Places in [0, 1].

        Returns
        -------
        ndarray, shape (m, k)
        """
        return self._interpolate(values, fractions, self.rule.points)

    def _interpolate(self, values: Array, fractions: Array, rule: Callable[[int], Array]) -> Array:
        fractions = np.atleast_1d(np.asarray(fractions, dtype=float))
        inside = np.clip(np.searchsorted(self.boundaries, fractions, side="right") - 1, 0, self.intervals - 1)
        result = np.empty((values.shape[0], len(fractions)))
        for k in np.unique(inside):
            here = inside == k
            first, support = int(self.first[k]), rule(int(self.orders[k]))
            tau = 2 * (fractions[here] - self.boundaries[k]) / self.widths[k] - 1
            matrix = interpolation_matrix(support, tau)
            result[:, here] = values[:, first : first + len(support)] @ matrix.T
        return result
