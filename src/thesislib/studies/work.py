"""One case, computed: what a worker process does, whoever gives it the case."""

from __future__ import annotations

import inspect
import logging
import os
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from thesislib import provenance
from thesislib.studies.store import Value, save

__all__ = ["Answer", "Function", "computed", "log_through", "log_to_run", "sources"]

Function = Callable[..., Mapping[str, Value]]


@dataclass(frozen=True)
class Answer:
    """What came of a case.

    Attributes
    ----------
    values : mapping
        Its numbers, texts, booleans and arrays by name; empty if it failed.
    seconds : float
        Time it took, s.
    used : Usage
        Modules and data files of the process that computed it.
    failure : str or None
        Traceback, or a sentence; None if all went well.
    """

    values: Mapping[str, Value] = field(default_factory=dict)
    seconds: float = 0.0
    used: provenance.Usage = field(default_factory=provenance.Usage)
    failure: str | None = None


def computed(function: Function, inputs: Mapping[str, Any], file: Path | None) -> Answer:
    """Compute a case in this process and store it under `file`, if that is given."""
    values: dict[str, Value] = {}
    failure = None
    started = time.perf_counter()
    try:
        values = dict(function(**inputs))
        seconds = time.perf_counter() - started
        if file is not None:
            save(file, values, seconds)
    except Exception:
        seconds = time.perf_counter() - started
        failure = traceback.format_exc()
    return Answer(values, seconds, provenance.usage(), failure)


def sources(function: Function) -> tuple[str, str]:
    """Return the hashes of what a case depends on besides its inputs.

    Returns
    -------
    tuple of str
        `thesislib.provenance.source_hash`, and the hash of the file in which the function lives.
    """
    return provenance.source_hash(), provenance.file_hash(Path(inspect.getfile(function)))


def log_to_run(prefix: str = "") -> None:
    """Send this process's progress lines to the run's log, ``THESIS_LOG``, if it is in a run.

    Parameters
    ----------
    prefix : str
        Stands before each line; a study's worker names its case.
    """
    path = os.environ.get("THESIS_LOG")
    if path:
        log_through(logging.FileHandler(path, mode="a", encoding="utf-8"), prefix)


def log_through(handler: logging.Handler, prefix: str = "") -> None:
    """Send this process's progress lines through a handler, and through no other."""
    log = logging.getLogger("thesislib")
    for earlier in list(log.handlers):
        log.removeHandler(earlier)
        earlier.close()
    handler.setFormatter(logging.Formatter(prefix.replace("%", "%%") + "%(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False  # nothing of it is for the page
