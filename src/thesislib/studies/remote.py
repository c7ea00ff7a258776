"""A case on another machine: what a Dask worker does with it.

A Dask worker lives long and may work in several threads, while a case wants sources that are those on
disk now, a log of its own and a solver that shares its process with no other. So the worker computes
nothing itself: it starts a process for the case (`perform`), which imports what the case needs, checks
that its sources are the study's, computes and ends (`serve`). A case that crashes takes its process
with it and not the worker. The two talk through a pipe, and when the worker dies the pipe breaks and the
process ends too.
"""

from __future__ import annotations

import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from thesislib import arithmetic, provenance
from thesislib.studies import work
from thesislib.studies.store import load

__all__ = ["LINES", "Order", "perform", "serve", "source"]

LINES = "thesislib-study"
"""Dask topic of the progress lines: ``{"key": …, "level": …, "line": …}``."""

# -P: the folder the worker was started in is no place to import from
_CHILD = [sys.executable, "-P", "-c", f"import sys; from {__name__} import serve; serve(int(sys.argv[1]))"]

# A case is no place for a study of its own on the cluster, and its lines go through the pipe.
_NOT_PASSED_ON = ("THESIS_SCHEDULER", "THESIS_LOG")


@dataclass(frozen=True)
class Order:
    """A case as it is sent.

    Attributes
    ----------
    case : str
        Its name.
    call : bytes
        Function and keyword arguments, pickled: only the process that computes them imports what they
        need, and not before it has compared the sources.
    sources : tuple of str
        What `work.sources` said where the study was started.
    file : Path or None
        Where the case is stored, without suffix.
    fresh : bool
        Whether it is computed even if it is stored.
    settings : mapping of str to str
        Environment variables of the process that computes it.
    """

    case: str
    call: bytes
    sources: tuple[str, str]
    file: Path | None
    fresh: bool
    settings: Mapping[str, str]

    @classmethod
    def of(
        cls,
        case: str,
        function: work.Function,
        inputs: Mapping[str, Any],
        file: Path | None,
        sources: tuple[str, str],
    ) -> Order:
        """Make the order for a case out of this process's sources and settings."""
        names = ("THESIS_FRESH", "THESIS_FROM_SOLUTION", "THESIS_COMPILE")
        settings = {name: os.environ[name] for name in names if name in os.environ}
        fresh = settings.get("THESIS_FRESH") == "1"
        return cls(case, pickle.dumps((function, dict(inputs))), sources, file, fresh, settings)

    def answer(self) -> work.Answer:
        """Compute the case, or take it up where an earlier attempt at it has stored it."""
        folder = self.file.parent if self.file is not None else None
        shared = folder is not None and folder.is_dir() and os.access(folder, os.W_OK)
        file = self.file if shared else None
        if file is not None and not self.fresh and (found := load(file)) is not None:
            return work.Answer(dict(found), found.seconds, provenance.usage())
        try:
            self._compare(provenance.source_hash(), self.sources[0], "package, data files and lock")
            function, inputs = pickle.loads(self.call)
            self._compare(work.sources(function)[1], self.sources[1], f"file of {function.__name__}")
        except Exception:
            return work.Answer(failure=traceback.format_exc())
        return work.computed(function, inputs, file)

    @staticmethod
    def _compare(here: str, there: str, of: str) -> None:
        if here != there:
            raise RuntimeError(
                f"The worker's sources are not the study's: {of} have the hash {here} at the worker and "
                f"{there} where the study was started. Bring both to the same state."
            )


def source() -> str:
    """Return the hash of this process's sources; raises as `thesislib.provenance.project_root`."""
    return provenance.source_hash()


def perform(order: bytes, key: str) -> bytes:
    """Have a case computed by a process of its own: the task of a Dask worker.

    Parameters
    ----------
    order : bytes
        A pickled `Order`; the worker does not look into it.
    key : str
        Stands with each progress line.

    Returns
    -------
    bytes
        The pickled `work.Answer`.
    """
    from distributed import get_worker

    worker = get_worker()
    ours, theirs = Pipe()
    environment = arithmetic.environment() | {k: v for k, v in os.environ.items() if k not in _NOT_PASSED_ON}
    started = time.perf_counter()
    process = subprocess.Popen(
        [*_CHILD, str(theirs.fileno())],
        stdin=subprocess.DEVNULL,
        pass_fds=[theirs.fileno()],
        env=environment,
    )
    theirs.close()
    try:
        ours.send_bytes(order)
        while isinstance(said := ours.recv(), tuple):
            level, line = said
            worker.log_event(LINES, {"key": key, "level": level, "line": line})
        answer: bytes = said
    except (EOFError, ConnectionError):
        failure = f"its process on worker {worker.address} ended with exit code {process.wait()}"
        answer = pickle.dumps(work.Answer(seconds=time.perf_counter() - started, failure=failure))
    finally:
        ours.close()
        process.kill()
        process.wait()
    return answer


def serve(descriptor: int) -> None:
    """Compute the one case that comes through a pipe; the body of the process `perform` starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C at a worker's terminal is for the worker
    pipe = Connection(descriptor)
    order: Order = pickle.loads(pipe.recv_bytes())
    threading.Thread(target=_end_with_worker, args=(pipe,), daemon=True).start()
    os.environ.update(order.settings)
    provenance.watch()
    work.log_through(_Lines(pipe), f"{order.case}: ")
    answer = order.answer()
    try:
        packed = pickle.dumps(answer)
    except Exception:
        packed = pickle.dumps(work.Answer(seconds=answer.seconds, failure=traceback.format_exc()))
    pipe.send(packed)


class _Lines(logging.Handler):
    """Sends progress lines to the worker."""

    def __init__(self, pipe: Connection) -> None:
        super().__init__()
        self.pipe = pipe

    def emit(self, record: logging.LogRecord) -> None:
        self.pipe.send((record.levelno, self.format(record)))


def _end_with_worker(pipe: Connection) -> None:
    """End this process when the worker dies; nothing more ever comes from a living one."""
    try:
        pipe.recv_bytes()
    except (EOFError, OSError):
        os._exit(1)
