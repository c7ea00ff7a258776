"""Runs of chapters, side by side: ordered, watched, and published whole or not at all.

Each chapter is executed by `thesislib.companion.execution` in a process and a working folder of its
own. Only a run that went well takes the place of the one before it; a run that failed leaves its
partial notebook, its log and the reason in ``_build/failed``.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from thesislib import arithmetic, studies
from thesislib.companion import bookkeeping, currency, documents, execution, keeping
from thesislib.companion.orders import LOG, RECORD, Order

__all__ = ["Report", "run"]

_POLL_S = 0.1


@dataclass(frozen=True)
class Report:
    """How a run went: the order, its time in seconds, and what failed, if anything did."""

    order: Order
    seconds: float
    failure: str | None


class _Interruption(BaseException):
    """The command was interrupted; the run is given up without a trace."""


def run(orders: Sequence[Order], say: Callable[[str], None]) -> list[Report]:
    """Run chapters side by side, in the slots there are.

    Parameters
    ----------
    orders : sequence of Order
        What to run.
    say : callable
        Takes each line of progress.

    Returns
    -------
    list of Report
        In the order of the orders.

    Raises
    ------
    KeyboardInterrupt
        After all processes of the runs have been ended and their working folders removed.
    """
    cancelled = threading.Event()
    with _pool() as pool, ThreadPoolExecutor(max_workers=len(orders) or 1) as threads:
        # the longest first, so that the short ones fill the gaps
        longest_first = sorted(orders, key=_expected_seconds, reverse=True)
        futures = {
            order.name: threads.submit(_Run(order, pool, say, cancelled).report) for order in longest_first
        }
        try:
            return [futures[order.name].result() for order in orders]
        except BaseException:
            cancelled.set()
            raise


@contextmanager
def _pool() -> Iterator[studies.Slots]:
    """Make the pool of slots of this command, or join the one this process already belongs to."""
    if os.environ.get("THESIS_SLOTS"):
        yield studies.slots()
        return
    with tempfile.TemporaryDirectory(prefix="thesis-slots-") as folder:
        yield studies.Slots(Path(folder), studies.jobs())


def _expected_seconds(order: Order) -> float:
    try:
        return float(documents.read(order.folder / RECORD)["run"]["seconds"])
    except (FileNotFoundError, KeyError, documents.DocumentError):
        return order.chapter.wall_limit_s


class _Run:
    """One run, from its order to its published folder."""

    def __init__(
        self, order: Order, pool: studies.Slots, say: Callable[[str], None], cancelled: threading.Event
    ) -> None:
        self.order = order
        self.chapter = order.chapter
        self.pool = pool
        self.say = say
        self.cancelled = cancelled
        self.working = order.folder.with_name(f".{order.name}.unfinished")
        self.log = self.working / LOG
        self.started = 0.0

    def report(self) -> Report:
        """Carry out the order."""
        self.working.parent.mkdir(parents=True, exist_ok=True)
        with _only_one(self.working.with_suffix(".lock")) as alone:
            if not alone:
                return Report(self.order, 0.0, "another command is running it")
            try:
                return self._in_a_slot()
            except _Interruption:
                return Report(self.order, time.time() - self.started, "it was interrupted")
            finally:
                shutil.rmtree(self.working, ignore_errors=True)

    def _in_a_slot(self) -> Report:
        while (slot := self.pool.take()) is None:
            if self.cancelled.wait(_POLL_S):
                raise _Interruption
        try:
            self.started = time.time()
            self.say(f"{self.order.name}: started")
            return self._execute()
        finally:
            slot.release()

    def _execute(self) -> Report:
        shutil.rmtree(self.working, ignore_errors=True)
        (self.working / execution.PRIVATE).mkdir(parents=True)
        # hashes from before the run: what is edited while it runs makes it stale, not wrongly current
        before = currency.ingredients(self.chapter)
        documents.write(
            self.working / execution.ORDER,
            {
                "text": self.chapter.text,
                "parameters": dict(self.order.values),
                "book": str(self.chapter.path.parent),
                "wall_limit_s": self.chapter.wall_limit_s,
            },
        )
        exit_code = self._wait_for_process()
        try:
            outcome = execution.Outcome(**documents.read(self.working / execution.OUTCOME))
        except FileNotFoundError:
            sentence = f"its process ended with exit code {exit_code}"
            outcome = execution.Outcome(sentence, time.time() - self.started, 0.0)
        failure = outcome.failure
        if failure is None and not (self.working / bookkeeping.USED).is_file():
            failure = "it stopped before its last cell"
        if failure is not None:
            keeping.keep_failure(self.order, self.working, failure)
        else:
            keeping.publish(self.order, self.working, outcome, before, self.started)
        return Report(self.order, outcome.seconds, failure)

    def _wait_for_process(self) -> int:
        """Run the chapter's process, passing on what it logs."""
        with self.log.open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", execution.__name__, str(self.working)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env=self._environment(),
                start_new_session=True,  # Ctrl-C is for the command, which ends the run in order
            )
        try:
            with self.log.open("r", encoding="utf-8", errors="replace") as lines:
                while process.poll() is None:
                    self._pass_on(lines)
                    if self.cancelled.wait(_POLL_S):
                        raise _Interruption
                self._pass_on(lines)
        finally:
            if process.poll() is None:  # else its number may belong to another process by now
                execution.end_with_descendants(process.pid)
                process.wait()
        return process.returncode

    def _pass_on(self, lines: TextIO) -> None:
        start = lines.tell()
        while (line := lines.readline()).endswith("\n"):
            self.say(f"{self.order.name}: {line.rstrip()}")
            start = lines.tell()
        lines.seek(start)  # the rest of an unfinished line comes later

    def _environment(self) -> dict[str, str]:
        """Return the environment of the chapter's process: the user's, but for what could change a run."""
        private = self.working / execution.PRIVATE
        ours = {
            "THESIS_ROOT": str(self.chapter.root),
            "THESIS_CHAPTER": self.chapter.id,
            "THESIS_RUN_DIR": str(self.working),
            "THESIS_LOG": str(self.log),
            "THESIS_STARTED": repr(self.started),
            "THESIS_SLOTS": str(self.pool.folder),
            "THESIS_JOBS": str(self.pool.count),
            "THESIS_FROM_SOLUTION": "1" if self.order.from_solution else "0",
            "THESIS_FRESH": "1" if self.order.fresh else "0",
            # this environment's kernel, and nobody's start-up files or settings
            "JUPYTER_PREFER_ENV_PATH": "1",
            "JUPYTER_CONFIG_DIR": str(private / "jupyter"),
            "JUPYTER_DATA_DIR": str(private / "jupyter"),
            "JUPYTER_RUNTIME_DIR": str(private / "runtime"),
            "IPYTHONDIR": str(private / "ipython"),
            "MPLBACKEND": "module://matplotlib_inline.backend_inline",
            # kept between runs, because it holds the list of fonts, which takes seconds to make
            "MPLCONFIGDIR": str(self.chapter.root / "_build" / "cache" / "matplotlib"),
            "PYDEVD_DISABLE_FILE_VALIDATION": "1",
            # the slots share out the cores; threads in the linear algebra would take them twice
            **arithmetic.environment(),
        }
        theirs = {"JUPYTER_PATH", "JUPYTER_CONFIG_PATH", "MATPLOTLIBRC", "PYTHONSTARTUP"}
        return {name: value for name, value in os.environ.items() if name not in theirs} | ours


@contextmanager
def _only_one(lock: Path) -> Iterator[bool]:
    """Whether this process is the only one that does what the lock file stands for."""
    with lock.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield True
