"""Accepting a run: its quantities become the stored values. Tolerances stay, unless told otherwise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from thesislib.companion import currency, documents
from thesislib.companion.chapters import Chapter, InputError
from thesislib.companion.checks import numbers, quantities, resampled, stored_file
from thesislib.companion.orders import RECORD
from thesislib.companion.tolerances import Tolerance, ToleranceError

__all__ = ["Wishes", "accept"]

_LARGEST_SERIES = 400
"""A stored series has at most so many points; the record keeps them all."""

_SPREADS = 3.0
"""A tolerance set from a measured spread is so many times it: two or three runs do not show the largest."""


@dataclass(frozen=True)
class Wishes:
    """What to do about tolerances.

    Attributes
    ----------
    tolerances : mapping of str to (absolute, relative)
        New tolerances of quantities, by name.
    new : float or None
        Tolerance of quantities that are not stored yet: this part of the largest magnitude.
    reason : str or None
        The reason stored with the tolerances that are set.
    agreeing : sequence of mapping
        Records of other runs that should agree with this one, of the whole chapter or of a part. The
        tolerance of each quantity that one of them has becomes a multiple of the largest difference from
        them, and at least `new`.
    """

    tolerances: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    new: float | None = None
    reason: str | None = None
    agreeing: Sequence[Mapping[str, Any]] = ()


def accept(chapter: Chapter, wishes: Wishes, say: Callable[[str], None]) -> None:
    """Make the published run of a chapter the stored values, telling each difference first.

    Parameters
    ----------
    chapter : Chapter
        The chapter.
    wishes : Wishes
        What to do about tolerances.
    say : callable
        Takes each line: old and new of what changes, before anything is written.

    Raises
    ------
    InputError
        If there is no finished, current run with unchanged parameters and without stored solutions,
        a quantity would have no tolerance, or a tolerance is wished for without a reason or for a
        quantity that the run has not recorded.
    """
    record = _acceptable(chapter)
    path = stored_file(chapter)
    try:
        stored = documents.read(path) if path.is_file() else {}
    except documents.DocumentError as error:
        raise InputError(str(error)) from error
    got, old = quantities(record), quantities(stored)
    _check_wishes(chapter, wishes, got, old)
    lines, entries = [], {}
    for name, entry in got.items():
        entries[name], said = _accepted(name, entry, old.get(name), wishes)
        lines += [f"{name}: {each}" for each in said]
    lines += [f"{name}: is not recorded any more, and is dropped" for name in old if name not in got]
    for line in lines or ["nothing changes"]:
        say(f"{chapter.id} {line}")
    if lines:
        documents.write(path, _document(chapter, record, entries))


def _acceptable(chapter: Chapter) -> dict[str, Any]:
    """Return the record of the published run if it may be accepted."""
    try:
        record = documents.read(chapter.run_folder / RECORD)
    except FileNotFoundError as error:
        raise InputError(f"Chapter {chapter.id} has not been run; there is nothing to accept.") from error
    except documents.DocumentError as error:
        raise InputError(str(error)) from error
    if record["run"].get("changed"):
        raise InputError(f"The run of chapter {chapter.id} has changed parameters and cannot be accepted.")
    if record["run"].get("from_solution"):
        raise InputError(f"The run of chapter {chapter.id} used stored solutions and cannot be accepted.")
    stale = currency.staleness(chapter, record)
    if stale is not None:
        raise InputError(f"{stale} It cannot be accepted.")
    return record


def _check_wishes(chapter: Chapter, wishes: Wishes, got: Mapping[str, Any], old: Mapping[str, Any]) -> None:
    if (wishes.tolerances or wishes.agreeing or wishes.new is not None) and not (wishes.reason or "").strip():
        raise InputError("A tolerance is set with its reason only: add --reason 'one sentence'.")
    for name in wishes.tolerances:
        if name not in got or not _has_numbers(got[name]):
            known = ", ".join(each for each in got if _has_numbers(got[each]))
            raise InputError(f"Chapter {chapter.id} records no number named {name!r} (known: {known}).")
    kept = {name for name, entry in old.items() if "tolerance" in _mapping(entry)}
    bare = [name for name in got if _has_numbers(got[name]) and name not in kept | set(wishes.tolerances)]
    if bare and wishes.new is None:
        raise InputError(
            f"Chapter {chapter.id} has quantities without a stored tolerance: {', '.join(bare)}. "
            "Give them one with --new-tolerance RELATIVE --reason 'one sentence'."
        )


def _accepted(name: str, entry: Any, old: Any, wishes: Wishes) -> tuple[Any, list[str]]:
    """Return what is stored of a recorded quantity, and what to say about it."""
    if not _has_numbers(entry):
        return entry, [] if entry == old else ["is new" if old is None else "changes"]
    old = _mapping(old)
    new, said = dict(entry), []
    if "ordinate" in entry:
        new |= _thinned(entry, old)
    said += _changes(new, old)
    tolerance = _tolerance(name, new, old, wishes)
    if tolerance != old.get("tolerance"):
        was = old.get("tolerance", {})
        before = f"{was.get('absolute')}:{was.get('relative')} becomes " if was else ""
        after = f"{tolerance['absolute']}:{tolerance['relative']}"
        said.append(f"tolerance (absolute:relative) {before}{after} ({tolerance['reason']})")
    return new | {"tolerance": tolerance}, said


def _changes(new: Mapping[str, Any], old: Mapping[str, Any]) -> list[str]:
    """Say how stored numbers change."""
    if not old:
        return [f"is new, {_extent(new)}{_unit(new)}"]
    said = [
        f"{key.replace('_', ' ')} {old.get(key)!r} becomes {new.get(key)!r}"
        for key in ("unit", "abscissa_unit", "period")
        if old.get(key) != new.get(key)
    ]
    before, after = numbers(old), numbers(new)
    if before.shape != after.shape or before.dtype.kind != after.dtype.kind:
        return [*said, f"{before.size} numbers become {after.size}"]
    if old.get("abscissa") != new.get("abscissa"):
        said.append(f"the abscissa changes ({len(new['abscissa'])} points)")
    moved = np.abs(after - before)
    if moved.any():
        worst = int(np.argmax(moved))
        place = f"at {new['abscissa'][worst]:.6g} {new['abscissa_unit']}, " if "abscissa" in new else ""
        place = f"in row {worst + 1}, " if "values" in new else place
        said.append(
            f"{place}{before[worst]:.9g} becomes {after[worst]:.9g}{_unit(new)} "
            f"(difference {after[worst] - before[worst]:+.3g})"
        )
    return said


def _thinned(entry: Mapping[str, Any], old: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return a series on the stored abscissa, or on some of its own points if there is none to keep."""
    same = all(old.get(key) == entry.get(key) for key in ("abscissa_unit", "period"))
    if same and "abscissa" in old:
        try:
            kept = np.array(old["abscissa"])
            return {"abscissa": old["abscissa"], "ordinate": resampled(entry, kept).tolist()}
        except ValueError:
            pass  # the series no longer reaches as far: it gets a new abscissa, which is told
    x, y = np.array(entry["abscissa"]), np.array(entry["ordinate"])
    chosen = np.unique(np.linspace(0, x.size - 1, min(x.size, _LARGEST_SERIES)).round().astype(int))
    return {"abscissa": x[chosen].tolist(), "ordinate": y[chosen].tolist()}


def _tolerance(name: str, new: Mapping[str, Any], old: Mapping[str, Any], wishes: Wishes) -> dict[str, Any]:
    reason = wishes.reason or ""
    if name in wishes.tolerances:
        absolute, relative = wishes.tolerances[name]
        set_now = Tolerance(absolute, relative, reason, old.get("tolerance", {}).get("spread"))
        return _countable(name, set_now, new)
    agreeing = [other for other in map(quantities, wishes.agreeing) if name in other]
    if "tolerance" in old and not agreeing:
        kept: dict[str, Any] = old["tolerance"]
        return kept
    part = wishes.new if wishes.new is not None else 0.0
    least = part * (float(np.max(np.abs(numbers(new)))) or 1.0)
    spread = max((_spread(name, new, other[name]) for other in agreeing), default=None)
    absolute = max(least, _SPREADS * spread) if spread is not None else least
    # two digits: a tolerance is a decision, not a measurement
    return _countable(name, Tolerance(float(f"{absolute:.1e}"), 0.0, reason, spread), new)


def _spread(name: str, new: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    """Return the largest difference between a quantity as it is stored and another run's."""
    try:
        theirs = resampled(other, np.array(new["abscissa"])) if "abscissa" in new else numbers(other)
        return float(np.max(np.abs(theirs - numbers(new))))
    except ValueError as error:
        raise InputError(f"{name} cannot be compared with a run that should agree: {error}.") from error


def _countable(name: str, tolerance: Tolerance, new: Mapping[str, Any]) -> dict[str, Any]:
    """Return a new tolerance as it is stored if it counts."""
    try:
        return Tolerance.read(tolerance.entry(), numbers(new)).entry()
    except ToleranceError as error:
        raise InputError(f"The tolerance of {name} cannot be set: {error}.") from error


def _document(chapter: Chapter, record: Mapping[str, Any], entries: Mapping[str, Any]) -> dict[str, Any]:
    """Put the entries where the record has them."""
    return {
        "schema": documents.SCHEMA,
        "chapter": chapter.id,
        "figures": {
            number: {"series": {name: entries[f"figures/{number}/{name}"] for name in figure["series"]}}
            | ({"picture": figure["picture"]} if "picture" in figure else {})
            for number, figure in record["figures"].items()
        },
        "tables": {
            number: {"columns": {name: entries[f"tables/{number}/{name}"] for name in table["columns"]}}
            for number, table in record["tables"].items()
        },
        "values": {name: entries[f"values/{name}"] for name in record["values"]},
    }


def _has_numbers(entry: Any) -> bool:
    if not isinstance(entry, Mapping):
        return False
    return "values" not in entry or not any(isinstance(each, str) for each in entry["values"])


def _mapping(entry: Any) -> dict[str, Any]:
    return dict(entry) if isinstance(entry, Mapping) else {}


def _unit(entry: Mapping[str, Any]) -> str:
    return f" {entry['unit']}" if entry["unit"] else ""


def _extent(entry: Mapping[str, Any]) -> str:
    all_of_it = numbers(entry)
    if all_of_it.size == 1:
        return f"{all_of_it[0]:.9g}"
    return f"{all_of_it.size} numbers from {all_of_it.min():.6g} to {all_of_it.max():.6g}"
