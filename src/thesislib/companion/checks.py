"""The check of a record against the stored values: one line per miss.

Quantities are named alike everywhere: ``values/lap_time``, ``figures/4.7/speed``,
``figures/4.7/picture``, ``tables/4.1/C_L_front``. A quantity that is recorded but not stored is a
miss, and so is one that is stored but not recorded. Series are resampled on the stored abscissa, so
that another mesh is not a difference. Iteration counts and times are never checked.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from thesislib.companion import currency, documents, pictures
from thesislib.companion.chapters import Chapter
from thesislib.companion.orders import RECORD
from thesislib.companion.tolerances import Tolerance, ToleranceError

__all__ = ["Miss", "check", "misses", "numbers", "quantities", "resampled", "stored_file"]

# of the track's length or the flight's duration, which a solver may move by its own tolerance
_PERIOD_RELATIVE = 1e-6


@dataclass(frozen=True)
class Miss:
    """A quantity that is not as stored.

    Attributes
    ----------
    quantity : str
        Its name, ``"figures/4.7/speed"``.
    said : str
        What is wrong; of a number: the place, expected, got, difference and limit.
    """

    quantity: str
    said: str

    def __str__(self) -> str:
        return f"{self.quantity} {self.said}" if self.quantity else self.said


def stored_file(chapter: Chapter) -> Path:
    """Return the file of a chapter's stored values."""
    return chapter.root / "data" / "expected" / f"{chapter.id}.json"


def quantities(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return every quantity of a record or a stored file by its name."""
    found: dict[str, Any] = {}
    for number, figure in document.get("figures", {}).items():
        if "picture" in figure:
            found[f"figures/{number}/picture"] = figure["picture"]
        for name, series in figure.get("series", {}).items():
            found[f"figures/{number}/{name}"] = series
    for number, table in document.get("tables", {}).items():
        for name, column in table["columns"].items():
            found[f"tables/{number}/{name}"] = column
    for name, value in document.get("values", {}).items():
        found[f"values/{name}"] = value
    return found


def numbers(entry: Mapping[str, Any]) -> np.ndarray:
    """Return the numbers of a quantity: a series' ordinate, a column's values, or the one value."""
    key = next(key for key in ("ordinate", "values", "value") if key in entry)
    return np.atleast_1d(np.array(entry[key]))


def check(chapter: Chapter) -> list[Miss]:
    """Check the published run of a chapter against its stored values.

    A run that is missing, failed, or is not current, and stored values that are missing, are misses.
    """
    try:
        record = documents.read(chapter.run_folder / RECORD)
        stale = currency.staleness(chapter, record)
        if stale is not None:
            return [Miss("", stale)]
        return misses(record, documents.read(stored_file(chapter)), chapter.run_folder)
    except documents.DocumentError as error:
        return [Miss("", str(error))]
    except FileNotFoundError as error:
        if error.filename == str(stored_file(chapter)):
            said = f"has no stored values: {error.filename} is missing"
        else:
            failed = currency.failure(chapter)
            said = "has not been run" if failed is None else f"failed in its last run: {failed}"
        return [Miss("", f"chapter {chapter.id} {said}")]


def misses(record: Mapping[str, Any], stored: Mapping[str, Any], folder: Path) -> list[Miss]:
    """Compare a record with stored values.

    Parameters
    ----------
    record, stored : mapping
        Documents as in ``docs/record-schema.json``.
    folder : Path
        Folder of the record, where its pictures are.
    """
    got, expected = quantities(record), quantities(stored)
    found = []
    for name, entry in expected.items():
        if name not in got:
            found.append(Miss(name, "is stored and was not recorded"))
        else:
            found += [Miss(name, said) for said in _differences(name, entry, got[name], expected, folder)]
    found += [Miss(name, "was recorded and is not stored") for name in got if name not in expected]
    return found


def resampled(series: Mapping[str, Any], abscissa: np.ndarray) -> np.ndarray:
    """Return a series' ordinate on another abscissa, linearly interpolated.

    Parameters
    ----------
    series : mapping
        A series of a record; with a period, it is continued periodically.
    abscissa : ndarray, shape (N,)
        Where to.

    Raises
    ------
    ValueError
        If the series has no period and does not reach as far as the abscissa. By one interval at
        either end it is continued: collocation points do not include both ends.
    """
    x, y = np.array(series["abscissa"]), np.array(series["ordinate"])
    if "period" in series:
        return np.interp(abscissa, x, y, period=series["period"])
    below = max(x[1] - x[0], abscissa[1] - abscissa[0])
    above = max(x[-1] - x[-2], abscissa[-1] - abscissa[-2])
    if x[0] - abscissa[0] > below or abscissa[-1] - x[-1] > above:
        unit = series["abscissa_unit"]
        raise ValueError(
            f"reaches from {x[0]:g} to {x[-1]:g} {unit}, "
            f"and stored is {abscissa[0]:g} to {abscissa[-1]:g} {unit}"
        )
    # straight on over the ends: a point more or less there is the mesh's doing
    ends = np.array([min(x[0], abscissa[0]), max(x[-1], abscissa[-1])])
    slopes = np.diff(y)[[0, -1]] / np.diff(x)[[0, -1]]
    beyond = y[[0, -1]] + slopes * (ends - x[[0, -1]])
    x, y = np.concatenate([ends[:1], x, ends[1:]]), np.concatenate([beyond[:1], y, beyond[1:]])
    return np.interp(abscissa, x, y)


def _differences(
    name: str, expected: Any, got: Any, everything: Mapping[str, Any], folder: Path
) -> Iterator[str]:
    if isinstance(expected, str):
        yield from _picture(folder / got)
        return
    for key in ("unit", "abscissa_unit"):
        if expected.get(key) != got.get(key):
            yield f"has the {key.replace('_', ' ')} {got.get(key)!r}, and stored is {expected.get(key)!r}"
            return
    try:
        if "ordinate" in expected:
            yield from _series(expected, got)
        elif "values" in expected:
            yield from _column(expected, got, _row_names(name, everything))
        else:
            yield from _numbers(expected, np.array([expected["value"]]), np.array([got["value"]]), [""])
    except ToleranceError as error:
        yield f"is stored without a tolerance that counts: {error}"
    except ValueError as error:
        yield str(error)


def _picture(path: Path) -> Iterator[str]:
    if not path.is_file():
        yield f"is missing: there is no {path.name}"
    elif pictures.is_blank(path):
        yield f"is blank: {path.name} has one colour only"


def _series(expected: Mapping[str, Any], got: Mapping[str, Any]) -> Iterator[str]:
    ours, theirs = got.get("period"), expected.get("period")
    if (ours is None) != (theirs is None):
        yield f"has the period {ours}, and stored is {theirs}"
        return
    if ours is not None and theirs is not None and abs(ours - theirs) > _PERIOD_RELATIVE * theirs:
        yield f"has the period {ours!r}, and stored is {theirs!r} (limit {_PERIOD_RELATIVE:g} of it)"
        return
    abscissa = np.array(expected["abscissa"])
    places = [f"at {x:.6g} {expected['abscissa_unit']}".rstrip() for x in abscissa]
    yield from _numbers(expected, np.array(expected["ordinate"]), resampled(got, abscissa), places)


def _column(expected: Mapping[str, Any], got: Mapping[str, Any], rows: Sequence[str]) -> Iterator[str]:
    wanted, given = expected["values"], got["values"]
    if len(wanted) != len(given):
        yield f"has {len(given)} rows, and stored are {len(wanted)}"
    elif any(isinstance(each, str) for each in [*wanted, *given]):
        for row, want, have in zip(rows, wanted, given, strict=True):
            if want != have:
                yield f"{row}: expected {want!r}, got {have!r}"
                return
    else:
        yield from _numbers(expected, np.array(wanted), np.array(given), rows)


def _row_names(name: str, everything: Mapping[str, Any]) -> list[str]:
    """Name the rows of a table by number and, if its first column is text, by that."""
    table = name.rpartition("/")[0]
    first = next(column for other, column in everything.items() if other.startswith(f"{table}/"))
    texts = [f" ({text})" if isinstance(text, str) else "" for text in first["values"]]
    length = len(everything[name]["values"])
    return [f"in row {i + 1}{texts[i] if i < len(texts) else ''}" for i in range(length)]


def _numbers(
    entry: Mapping[str, Any], expected: np.ndarray, got: np.ndarray, places: Sequence[str]
) -> Iterator[str]:
    """Compare numbers; the place that is worst in terms of its limit stands for all."""
    limit = Tolerance.read(entry.get("tolerance"), expected).limit(expected)
    difference = got - expected
    # the comparison is turned round so that a stored value that is not a number is a miss as well
    out = ~(np.abs(difference) <= limit)
    if not out.any():
        return
    excess = np.where(out, np.abs(difference) - limit, -np.inf)
    worst = int(np.argmax(np.nan_to_num(excess, nan=np.inf, neginf=-np.inf)))
    unit = f" {entry['unit']}" if entry["unit"] else ""
    place = f"{places[worst]}: " if places[worst] else ""
    share = f"; {out.sum()} of {out.size} are out" if out.size > 1 else ""
    yield (
        f"{place}expected {expected[worst]:.9g}{unit}, got {got[worst]:.9g}{unit}, "
        f"difference {difference[worst]:+.3g}, limit {limit[worst]:.3g}{share}"
    )
