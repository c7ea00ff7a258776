"""What is left of a run: a record in the place of the last one, or a failure that can be looked at."""

from __future__ import annotations

import datetime
import shutil
from pathlib import Path
from typing import Any

from thesislib import provenance
from thesislib.companion import bookkeeping, currency, documents, execution
from thesislib.companion.orders import LOG, RECORD, Order
from thesislib.companion.parameters import parameters

__all__ = ["keep_failure", "publish"]


def keep_failure(order: Order, working: Path, failure: str) -> None:
    """Leave the log and the partial notebook of a failed run in ``_build/failed``.

    The record of the run before stays; that the last one failed is noted beside the notebook, so that
    the record does not count as current.

    Parameters
    ----------
    order : Order
        What was run.
    working : Path
        The run's working folder.
    failure : str
        What failed.
    """
    log, notebook, marker = _failure_files(order)
    marker.parent.mkdir(parents=True, exist_ok=True)
    (working / LOG).replace(log)
    if (working / execution.NOTEBOOK).is_file():
        (working / execution.NOTEBOOK).replace(notebook)
    else:
        notebook.unlink(missing_ok=True)  # one from an earlier failure would mislead
    documents.write(marker, {"chapter": order.chapter.id, "failure": failure})


def publish(
    order: Order,
    working: Path,
    outcome: execution.Outcome,
    before: currency.Ingredients,
    started: float,
) -> None:
    """Complete the record of a run that went well, and put the run in the place of the last one.

    Parameters
    ----------
    order : Order
        What was run.
    working : Path
        The run's working folder; it becomes the run's folder.
    outcome : Outcome
        Time and memory.
    before : Ingredients
        Hashes of everything from before the run: what was edited while it ran makes it stale, and
        does not count as what it has used.
    started : float
        Start of the run, s since the epoch.
    """
    chapter = order.chapter
    used = documents.read(working / bookkeeping.USED)
    named = provenance.Usage.from_lists(used)
    ingredients = before.only(named, currency.ingredients(chapter, named))
    record: dict[str, Any] = {"figures": {}, "tables": {}, "values": {}, "solves": []}
    if (working / RECORD).is_file():
        record = {kind: documents.read(working / RECORD)[kind] for kind in record}
    compiled = [solve["compiled"] for solve in record["solves"] if "compiled" in solve]
    start = datetime.datetime.fromtimestamp(started, datetime.UTC)
    run = {
        "status": "finished",
        "started": start.isoformat(timespec="seconds"),
        "seconds": round(outcome.seconds, 3),
        "peak_memory_mb": round(max(outcome.peak_memory_mb, used["peak_memory_mb"]), 1),
        "parameters": {each.name: each.default for each in parameters(chapter)} | dict(order.values),
        "changed": bool(order.values),
        "from_solution": order.from_solution,
        "compiled": all(compiled) if compiled else None,
        "versions": used["versions"],
        "notebook": provenance.file_hash(working / execution.NOTEBOOK),
        "hash": ingredients.hash,
        "code": ingredients.code,
        "python": ingredients.python,
        "lock": ingredients.lock,
        "data_files": ingredients.data_files,
        "modules": ingredients.modules,
    }
    head = {"schema": documents.SCHEMA, "chapter": chapter.id, "run": run}
    documents.write(working / RECORD, head | record)
    for passing in (execution.ORDER, execution.OUTCOME, bookkeeping.USED):
        (working / passing).unlink()
    shutil.rmtree(working / execution.PRIVATE, ignore_errors=True)
    # the notebook first: the record, which names its hash, is what makes the run count
    if order.values:
        (working / execution.NOTEBOOK).rename(working / order.notebook.name)
    else:
        order.notebook.parent.mkdir(parents=True, exist_ok=True)
        (working / execution.NOTEBOOK).replace(order.notebook)
    _take_the_place_of(order.folder, working)
    for left in _failure_files(order):
        left.unlink(missing_ok=True)


def _failure_files(order: Order) -> tuple[Path, Path, Path]:
    """Return where the log, the partial notebook and the reason of a failed run are kept."""
    marker = currency.failure_file(order.chapter)
    if order.values:
        marker = marker.with_name(f"{order.name}.json")
    return marker.with_suffix(".log.txt"), marker.with_suffix(".ipynb"), marker


def _take_the_place_of(old: Path, new: Path) -> None:
    """Rename a folder to another's name; at no time is there half a folder."""
    away = old.with_name(f".{old.name}.old")
    shutil.rmtree(away, ignore_errors=True)
    if old.exists():
        old.rename(away)
    new.rename(old)
    shutil.rmtree(away, ignore_errors=True)
