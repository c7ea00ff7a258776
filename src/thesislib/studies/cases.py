"""Independent cases in worker processes, or on a Dask cluster (`thesislib.studies.cluster`).

Local workers are *spawned*, not forked: a fork copies a process in which CasADi, BLAS or the notebook kernel
may hold locks in other threads, and the copy then waits for them for ever. A spawned worker imports
what it needs, so the function of a study has to live in a module.

A study computes one case in the slot its caller already holds and takes further slots as they become
free (`thesislib.studies.slots`). Each worker stores its case at once, so a study that was killed
resumes where it was, be it here or on a cluster.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from thesislib import arithmetic, provenance
from thesislib.studies import cluster, work
from thesislib.studies.remote import Order
from thesislib.studies.slots import Slot, Slots, slots
from thesislib.studies.store import Result, entry, load, save

__all__ = ["Follow", "StudyError", "run"]

Follow = Callable[[str, Result], Mapping[str, Mapping[str, Any]]]
"""Takes a finished case's name and result; returns the cases that they make possible."""

_POLL_S = 0.2
_SPAWN = multiprocessing.get_context("spawn")


class StudyError(RuntimeError):
    """Some cases of a study failed.

    Attributes
    ----------
    failures : dict of str to str
        Traceback by the case's name.
    """

    def __init__(self, failures: Mapping[str, str], total: int) -> None:
        self.failures = dict(failures)
        last_lines = {name: text.strip().splitlines()[-1] for name, text in failures.items()}
        said = "; ".join(f"case {name!r}: {line}" for name, line in last_lines.items())
        super().__init__(f"{len(failures)} of {total} cases failed. {said}")
        for name, text in failures.items():
            self.add_note(f"Case {name!r}:\n{text}")


def run(
    cases: Mapping[str, Mapping[str, Any]],
    function: work.Function,
    *,
    jobs: int | None = None,
    store: bool = True,
    key: Any = None,
    scheduler: str | None = None,
    follow: Follow | None = None,
) -> dict[str, Result]:
    """Compute cases side by side: independent ones, and those that follow from finished ones.

    Parameters
    ----------
    cases : mapping of str to mapping
        Keyword arguments of `function` by the case's name.
    function : callable
        Computes a case: a mapping of numbers, texts, booleans and arrays. It lives in a module.
    jobs : int, optional
        At most so many cases at a time; by default as many as there are slots, or as the cluster takes.
    store : bool
        Whether finished cases are stored, and those stored earlier under the same key taken up.
        ``THESIS_FRESH=1`` (``thesis run --again``) computes them anew all the same.
    key : object, optional
        What the results depend on besides the arguments, the sources and the data.
    scheduler : str, optional
        Address of a Dask scheduler, ``tcp://host:8786``; by default ``THESIS_SCHEDULER``. Without either,
        or with an empty text, the cases are computed by processes on this machine.
    follow : callable, optional
        Called here with each case's name and result as soon as it is there, computed or taken up; returns
        the cases that it makes possible, as `cases`. They are computed before those that wait already, so
        that a chain of cases is not held up. Nothing follows a case that failed.

    Returns
    -------
    dict of str to Result
        The results, in the order of `cases`; those that followed come after the case that they followed.

    Raises
    ------
    StudyError
        If cases failed: after the others have finished, naming each.
    ClusterError
        If the cluster cannot be used: before anything is computed; or is lost, after that.
    TypeError
        If the function does not live in a module, or a case cannot be part of a key.
    ValueError
        If `jobs` is below 1, `scheduler` is no address, or two cases have one name.
    """
    if jobs is not None and jobs < 1:
        raise ValueError(f"jobs = {jobs}; a study needs at least 1.")
    address = cluster.scheduler_address(scheduler)
    study = _Study(_name(function), function, _Files(function, key) if store else None, follow)
    study.add(cases)
    if study.pending and address is not None:
        study.compute_on(address, jobs)
    else:
        study.compute(jobs)
    if study.failures:
        raise StudyError(study.failures, len(study.cases))
    return {name: study.results[name] for name in study.cases}


def _name(function: Callable[..., Any]) -> str:
    module, name = getattr(function, "__module__", None), getattr(function, "__qualname__", "<locals>")
    if module in (None, "__main__") or "<" in name:
        raise TypeError(
            f"The function of a study must be importable by a worker process; {function!r} does not live "
            "at the top of a module."
        )
    return f"{module}.{name}"


class _Files:
    """Where the cases of a study are stored, without suffix."""

    def __init__(self, function: work.Function, key: Any) -> None:
        self.source = "".join(work.sources(function))
        self.called = _name(function)
        self.function = function
        self.key = key

    def of(self, case: str, inputs: Mapping[str, Any]) -> Path:
        """Return a case's file; raise TypeError if it cannot be part of a key."""
        return entry(f"{self.function.__name__} {case}", [self.called, dict(inputs), self.key], self.source)


@dataclass
class _Worker:
    """A worker process, its end of the pipe, the slot it works in (None: the caller's) and its case."""

    process: BaseProcess
    pipe: Connection
    slot: Slot | None
    case: str | None = None

    def stop(self) -> None:
        """End the process, whatever it does, and give its slot back."""
        self.process.kill()
        self.process.join()
        self.pipe.close()
        if self.slot is not None:
            self.slot.release()


class _Study:
    """A study under way.

    Attributes
    ----------
    cases : dict
        Arguments of all cases so far.
    pending : deque of str
        Those that wait to be computed.
    results, failures : dict
        What came of the others.
    """

    def __init__(
        self, name: str, function: work.Function, places: _Files | None, follow: Follow | None
    ) -> None:
        self.name = name
        self.function = function
        self.places = places
        self.follow = follow
        self.cases: dict[str, Mapping[str, Any]] = {}
        self.files: dict[str, Path] = {}
        self.pending: deque[str] = deque()
        self.results: dict[str, Result] = {}
        self.failures: dict[str, str] = {}
        self.workers: list[_Worker] = []

    def add(self, cases: Mapping[str, Mapping[str, Any]]) -> None:
        """Take up the cases that are stored already; the others are the next to be computed."""
        if twice := sorted(cases.keys() & self.cases.keys()):
            raise ValueError(f"The study has a case {twice[0]!r} already.")
        self.cases |= cases
        if self.places is not None:
            self.files |= {name: self.places.of(name, inputs) for name, inputs in cases.items()}
        fresh = os.environ.get("THESIS_FRESH") == "1"
        found = {name: load(self.files[name]) for name in cases if name in self.files and not fresh}
        self.pending.extendleft(reversed([name for name in cases if found.get(name) is None]))
        for name, result in found.items():
            if result is not None:
                self.finish(name, result)

    def finish(self, case: str, result: Result) -> None:
        """Take a case's result, and what follows from it."""
        self.results[case] = result
        if self.follow is not None:
            self.add(self.follow(case, result))

    def take(self, case: str, answer: work.Answer) -> None:
        """Take what came of a case."""
        provenance.merge(answer.used)
        if answer.failure is None:
            self.finish(case, Result(answer.values, stored=False, seconds=answer.seconds))
        else:
            self.failures[case] = answer.failure

    def compute_on(self, address: str, jobs: int | None) -> None:
        """Compute cases on a cluster, and store those that the workers may have stored elsewhere only."""
        sources = work.sources(self.function)

        def orders() -> dict[str, Order]:
            found = {
                case: Order.of(case, self.function, self.cases[case], self.files.get(case), sources)
                for case in self.pending
            }
            self.pending.clear()
            for folder in {self.files[case].parent for case in found if case in self.files}:
                folder.mkdir(parents=True, exist_ok=True)  # workers store where they find it
            return found

        def keep(case: str, answer: work.Answer) -> Mapping[str, Order]:
            if answer.failure is None and case in self.files:
                try:
                    save(self.files[case], answer.values, answer.seconds, answer.used)
                except TypeError:
                    answer = replace(answer, failure=traceback.format_exc())
            self.take(case, answer)
            return orders()

        cluster.compute(address, orders(), jobs, keep)

    def compute(self, jobs: int | None) -> None:
        """Compute cases in processes on this machine."""
        pool, pending = slots(), self.pending
        limit = jobs or pool.count
        try:
            while pending or self.workers:
                while pending and len(self.workers) < limit and self._start(pool):
                    self._give(self.workers[-1], pending.popleft())
                ready = wait([worker.pipe for worker in self.workers], timeout=_POLL_S)
                for worker in [worker for worker in self.workers if worker.pipe in ready]:
                    self._receive(worker)
                    if worker.case is None and pending:
                        self._give(worker, pending.popleft())
                    elif worker.case is None:
                        self._dismiss(worker)
        finally:
            for worker in list(self.workers):
                self._dismiss(worker)

    def _start(self, pool: Slots) -> bool:
        """Start a worker in the caller's slot or, if that is taken, in a free one."""
        slot = None
        if any(worker.slot is None for worker in self.workers):
            slot = pool.take()
            if slot is None:
                return False
        ours, theirs = _SPAWN.Pipe()
        process = _SPAWN.Process(target=_work, args=(theirs, self.function), name=self.name)
        with _digits_that_repeat():
            process.start()
        theirs.close()
        self.workers.append(_Worker(process, ours, slot))
        return True

    def _give(self, worker: _Worker, case: str) -> None:
        worker.case = case
        worker.pipe.send((case, dict(self.cases[case]), self.files.get(case)))

    def _receive(self, worker: _Worker) -> None:
        """Take a worker's answer, or note that it died; a dead one is replaced by the next start."""
        case = worker.case
        assert case is not None, "only a worker with a case answers"
        try:
            answer = worker.pipe.recv()
        except (EOFError, ConnectionResetError):
            worker.process.join()
            self.failures[case] = f"its process ended with exit code {worker.process.exitcode}"
            self._dismiss(worker)
            return
        worker.case = None
        self.take(case, answer)

    def _dismiss(self, worker: _Worker) -> None:
        self.workers.remove(worker)
        worker.stop()


@contextmanager
def _digits_that_repeat() -> Iterator[None]:
    """Have the processes started inside use one BLAS thread each and one kernel, unless told otherwise."""
    ours = {name: value for name, value in arithmetic.environment().items() if name not in os.environ}
    os.environ.update(ours)
    try:
        yield
    finally:
        for name in ours:
            del os.environ[name]


def _work(pipe: Connection, function: work.Function) -> None:
    """Compute cases until the study ends; the body of a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the study's process answers Ctrl-C, for all
    threading.Thread(target=_die_with_parent, daemon=True).start()
    provenance.watch()
    while True:
        try:
            case, inputs, file = pipe.recv()
        except EOFError:  # the study's process is gone
            return
        work.log_to_run(f"{case}: ")
        pipe.send(work.computed(function, inputs, file))


def _die_with_parent() -> None:
    """End this process when the study's process dies, so that a killed run leaves nothing behind."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
