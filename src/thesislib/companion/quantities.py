"""The kinds of quantity a record holds, and what cannot be recorded."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

__all__ = [
    "RecordError",
    "Series",
    "Solved",
    "checked_unit",
    "column_entry",
    "real_number",
    "real_numbers",
    "solve_entry",
]

_TEXT = ("text", (str,))
_TRUTH = ("truth value", (bool,))
_COUNT = ("whole number", (int,))
_NUMBER = ("number", (int, float))

_SOLVE_KEYS: dict[str, tuple[str, tuple[type, ...]]] = {
    "status": _TEXT,
    "error_estimate": _NUMBER,
    "tolerance": _NUMBER,
    "points": _COUNT,
    "intervals": _COUNT,
    "meshes": _COUNT,
    "iterations": _COUNT,
    "seconds": _NUMBER,
    "stored": _TRUTH,
}
_OPTIONAL_SOLVE_KEYS: dict[str, tuple[str, tuple[type, ...]]] = {
    "compiled": _TRUTH,
    "converged": _TRUTH,
    "objective": _NUMBER,
    "regularisation": _NUMBER,
}


class RecordError(ValueError):
    """A quantity that cannot be recorded as it is given."""


class Solved(Protocol):
    """Anything that can say how it was solved."""

    def summary(self) -> Mapping[str, Any]:
        """Return the entries of the record's ``solves`` but for the name."""
        ...


@dataclass(frozen=True)
class Series:
    """One curve of a figure.

    Parameters
    ----------
    abscissa, ordinate : array_like, shape (N,)
        Points of the curve; the abscissa increases strictly. Of a curve that turns back (a racing
        line, a g-g plot), record both coordinates against its parameter.
    abscissa_unit, unit : str
        Units of the two, ``""`` for pure numbers.
    period : float, optional
        Period of the abscissa in its own unit, if the curve is periodic.
    """

    abscissa: ArrayLike
    ordinate: ArrayLike
    abscissa_unit: str
    unit: str
    period: float | None = None

    def entry(self, place: str) -> dict[str, Any]:
        """Return the series as the record holds it.

        Parameters
        ----------
        place : str
            What an error calls the series: ``"figure 4.7, series speed"``.

        Raises
        ------
        RecordError
            If the arrays are not one-dimensional, finite and of equal length, the abscissa does not
            increase strictly, or it spans more than the period.
        """
        x = real_numbers(self.abscissa, f"{place}, abscissa")
        y = real_numbers(self.ordinate, place)
        if x.size != y.size:
            raise RecordError(f"{place} has {x.size} abscissae and {y.size} ordinates; they must pair up.")
        if x.size < 2:
            raise RecordError(f"{place} has {x.size} points; a curve needs at least two.")
        steps = np.flatnonzero(np.diff(x) <= 0.0)
        if steps.size:
            i = int(steps[0])
            raise RecordError(
                f"{place} has the abscissa {x[i + 1]} after {x[i]} (point {i + 2}): it must increase."
            )
        entry: dict[str, Any] = {
            "abscissa": x.tolist(),
            "ordinate": y.tolist(),
            "abscissa_unit": checked_unit(self.abscissa_unit, f"{place}, abscissa"),
            "unit": checked_unit(self.unit, place),
        }
        if self.period is not None:
            period = real_number(self.period, f"The period of {place}")
            # a hair more than one period is rounding of the last point
            if not x[-1] - x[0] <= period * (1 + 1e-9):
                raise RecordError(f"{place} spans {x[-1] - x[0]}, which is more than its period {period}.")
            entry["period"] = period
        return entry


def checked_unit(unit: object, place: str) -> str:
    """Return a unit, or refuse what is no text."""
    if not isinstance(unit, str) or unit != unit.strip():
        raise RecordError(f"{place} has the unit {unit!r}; a unit is a text such as 'm/s', or ''.")
    return unit


def real_number(value: object, place: str) -> float | int:
    """Return one finite real number as a Python number."""
    array = np.asarray(value)
    if array.shape != () or array.dtype.kind not in "fiu":
        raise RecordError(f"{place} is {value!r}, not one real number.")
    number: float | int = array.item()
    if not math.isfinite(number):
        raise RecordError(f"{place} is {number!r}; only finite numbers are recorded.")
    return number


def real_numbers(values: ArrayLike, place: str) -> np.ndarray:
    """Return a list of finite real numbers as an array of shape (N,)."""
    array = np.asarray(values)
    if array.ndim != 1 or array.dtype.kind not in "fiu":
        raise RecordError(
            f"{place} has shape {array.shape} and type {array.dtype}; it must be a list of real numbers."
        )
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise RecordError(
            f"{place} is {array[bad[0]]} at point {bad[0] + 1}; only finite numbers are recorded."
        )
    return array


def column_entry(values: ArrayLike, unit: object, place: str) -> dict[str, Any]:
    """Return a table's column, all texts or all numbers, as the record holds it."""
    # of a mixture numpy would make texts without a word; as objects it stays a mixture
    mixed = np.asarray(values, dtype=object)
    if mixed.size == 0:
        raise RecordError(f"{place} has no rows.")
    if mixed.ndim == 1 and mixed.size and all(isinstance(each, str) for each in mixed):
        array = mixed.astype(str)
        return {"values": array.tolist(), "unit": checked_unit(unit, place)}
    return {"values": real_numbers(values, place).tolist(), "unit": checked_unit(unit, place)}


def solve_entry(summary: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return a solve's summary as the record holds it.

    Raises
    ------
    RecordError
        If an entry is missing, unknown, of another type or not finite.
    """
    for said, keys in (
        ("lacks", set(_SOLVE_KEYS) - set(summary)),
        ("has the unknown entries", set(summary) - set(_SOLVE_KEYS) - set(_OPTIONAL_SOLVE_KEYS)),
    ):
        if keys:
            raise RecordError(f"The summary of solve {name!r} {said} {', '.join(sorted(keys))}.")
    entry = {}
    for key, (noun, kinds) in (_SOLVE_KEYS | _OPTIONAL_SOLVE_KEYS).items():
        if key not in summary:
            continue
        value = summary[key].item() if isinstance(summary[key], np.generic) else summary[key]
        if type(value) not in kinds:
            raise RecordError(f"Solve {name!r} has {key} = {value!r}, which is not a {noun}.")
        if noun != "text" and not math.isfinite(value):
            raise RecordError(f"Solve {name!r} has {key} = {value}; only finite numbers are recorded.")
        entry[key] = value
    return entry
