"""How far a result may lie from its stored value, and why."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["Tolerance", "ToleranceError"]


class ToleranceError(ValueError):
    """A stored tolerance that cannot count."""


@dataclass(frozen=True)
class Tolerance:
    """Limit of a difference: ``absolute + relative * |expected|``.

    Attributes
    ----------
    absolute : float
        In the quantity's own unit.
    relative : float
        Pure number.
    reason : str
        One sentence: why so much, and why not more.
    spread : float or None
        Largest difference seen between runs that should agree (other start meshes, compiled or not,
        alone or side by side with other work), in the quantity's unit.
    """

    absolute: float
    relative: float
    reason: str
    spread: float | None = None

    def limit(self, expected: np.ndarray) -> np.ndarray:
        """Return the largest allowed difference at each expected value."""
        limits: np.ndarray = self.absolute + self.relative * np.abs(expected)
        return limits

    def entry(self) -> dict[str, Any]:
        """Return the tolerance as the stored file holds it."""
        entry = {"absolute": self.absolute, "relative": self.relative, "reason": self.reason}
        return entry if self.spread is None else entry | {"spread": self.spread}

    @classmethod
    def read(cls, entry: Mapping[str, Any] | None, expected: np.ndarray) -> Tolerance:
        """Return the tolerance a stored file holds for expected values.

        Raises
        ------
        ToleranceError
            If there is none, it has no reason, a number in it is missing or not a finite number from
            zero up, or it is smaller than the spread that was measured.
        """
        if not isinstance(entry, Mapping):
            raise ToleranceError("it has no tolerance")
        unknown = sorted(set(entry) - {"absolute", "relative", "reason", "spread"})
        if unknown:
            raise ToleranceError(f"its tolerance has unknown entries: {', '.join(unknown)}")
        for name in ("absolute", "relative", "spread"):
            number = entry.get(name, 0.0 if name == "spread" else None)
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise ToleranceError(f"its tolerance has {name} = {number!r}, which is not a number")
            if not (math.isfinite(number) and number >= 0):
                raise ToleranceError(f"its tolerance has {name} = {number}, not a finite number from 0 up")
        reason = entry.get("reason")
        if not isinstance(reason, str) or not reason.strip():
            raise ToleranceError("its tolerance has no reason")
        tolerance = cls(entry["absolute"], entry["relative"], reason, entry.get("spread"))
        largest = float(np.max(tolerance.limit(expected), initial=tolerance.absolute))
        if tolerance.spread is not None and tolerance.spread > largest:
            raise ToleranceError(
                f"its tolerance allows {largest:.3g}, less than the measured spread {tolerance.spread:.3g}"
            )
        return tolerance
