"""One run of one chapter, in a process of its own: text to notebook, notebook to kernel.

The process watches over its kernel: it measures the memory of the kernel and everything the kernel
has started, stops all of it at the wall limit, and stops it too when the command that wanted the run
is gone. ``python -m thesislib.companion.execution <folder>`` reads the order from ``order.json`` in
the folder and leaves the notebook and ``outcome.json`` there.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from thesislib.companion import documents
from thesislib.companion.bookkeeping import FINISH, START, TAG

__all__ = [
    "NOTEBOOK",
    "ORDER",
    "OUTCOME",
    "PRIVATE",
    "Outcome",
    "Watchman",
    "end_with_descendants",
    "execute",
]

ORDER = "order.json"
OUTCOME = "outcome.json"
NOTEBOOK = "notebook.ipynb"
PRIVATE = "private"
"""Folder of the kernel's own settings, instead of the user's."""

_SAMPLE_S = 0.2
_LONGEST_SOCKET_PATH = 90  # the system allows 107 bytes; what stands behind the folder's name needs a few

_psutil = importlib.import_module("psutil")  # comes with the kernel and has no type information


@dataclass(frozen=True)
class Outcome:
    """How a run went.

    Attributes
    ----------
    failure : str or None
        The sentence that says what failed; None if nothing did.
    seconds : float
        Wall-clock time from the start of the kernel, s.
    peak_memory_mb : float
        Largest memory that the kernel and what it has started had resident at one time, MB.
    """

    failure: str | None
    seconds: float
    peak_memory_mb: float


class Watchman(threading.Thread):
    """Measures the kernel's memory, and ends the kernel at its limit or when nobody waits for it."""

    def __init__(self, wall_limit_s: float) -> None:
        super().__init__(daemon=True)
        self.started = time.monotonic()
        self.wall_limit_s = wall_limit_s
        self.peak_memory_mb = 0.0
        self.limit_reached = False
        self.done = threading.Event()
        self.commander = os.getppid()

    @property
    def seconds(self) -> float:
        """Time since the start, s."""
        return time.monotonic() - self.started

    def run(self) -> None:
        while not self.done.wait(_SAMPLE_S):
            self.peak_memory_mb = max(self.peak_memory_mb, _descendants_memory_mb())
            if os.getppid() != self.commander:
                end_with_descendants(os.getpid())
            if self.seconds > self.wall_limit_s:
                self.limit_reached = True
                end_with_descendants(os.getpid(), but_not_itself=True)
                return


def execute(order: Mapping[str, Any], folder: Path) -> Outcome:
    """Execute a chapter.

    Parameters
    ----------
    order : mapping
        ``text`` of the chapter, ``parameters`` to inject, ``book`` (the working folder) and
        ``wall_limit_s``.
    folder : Path
        Where the executed notebook is left, also the partial one of a run that fails.
    """
    import jupytext
    import nbformat
    import papermill

    notebook = jupytext.reads(order["text"], fmt="md:myst")
    for position, source in ((0, START), (len(notebook.cells) + 1, FINISH)):
        cell = nbformat.v4.new_code_cell(source, metadata={"tags": [TAG, "remove-cell"]})
        notebook.cells.insert(position, cell)
    watchman = Watchman(order["wall_limit_s"])
    watchman.start()
    failure = None
    try:
        with tempfile.TemporaryDirectory(prefix="thesis-") as sockets:
            papermill.execute_notebook(
                notebook,
                folder / NOTEBOOK,
                parameters=order["parameters"],
                kernel_name="python3",
                progress_bar=False,
                cwd=order["book"],
                config=_connection(sockets),
            )
    except papermill.PapermillExecutionError as error:
        said = error.evalue.strip().partition("\n")[0]
        failure = f"code cell {_failed_cell(folder / NOTEBOOK)} raised {error.ename}: {said}"
    except RuntimeError as error:  # what the notebook client raises when the kernel is gone
        failure = f"its kernel died ({error})"
    finally:
        watchman.done.set()
    if watchman.limit_reached:
        failure = f"it was stopped at its wall limit of {order['wall_limit_s']:g} s"
    if (folder / NOTEBOOK).is_file():
        _without_bookkeeping(folder / NOTEBOOK)
    return Outcome(failure, watchman.seconds, watchman.peak_memory_mb)


def _connection(sockets: str) -> Any:
    """Return how the kernel is talked to: by sockets in a folder of its own.

    Ports would be chosen by the client and bound by the kernel a moment later. Where many kernels start at
    once, another may have taken one in between; the kernel then lives without its heartbeat, and the run
    hangs.
    """
    from traitlets.config import Config

    config = Config()
    if len(sockets) <= _LONGEST_SOCKET_PATH:
        config.KernelManager.transport = "ipc"
        config.KernelManager.ip = f"{sockets}/kernel"
    return config


def end_with_descendants(pid: int, *, but_not_itself: bool = False) -> None:
    """Kill a process and everything it has started; what has gone already is passed over."""
    try:
        process = _psutil.Process(pid)
        doomed = process.children(recursive=True)
    except _psutil.NoSuchProcess:
        return
    for each in doomed if but_not_itself else [*doomed, process]:
        try:
            each.kill()
        except _psutil.NoSuchProcess:
            continue


def _descendants_memory_mb() -> float:
    total = 0.0
    for process in _psutil.Process().children(recursive=True):
        try:
            total += process.memory_info().rss
        except _psutil.NoSuchProcess:
            continue
    return total / 1e6


def _is_of_the_chapter(cell: Any) -> bool:
    """Whether a cell stands in the chapter's text, and was not put in to run it."""
    return not {TAG, "injected-parameters"} & set(cell.metadata.get("tags", []))


def _failed_cell(path: Path) -> int:
    """Return the number, counted in the chapter's text, of the code cell that failed."""
    import nbformat

    number = 0
    for cell in nbformat.read(path, as_version=4).cells:
        if cell.cell_type == "code":
            number += _is_of_the_chapter(cell)
            if cell.metadata.get("papermill", {}).get("exception"):
                break
    return number


def _without_bookkeeping(path: Path) -> None:
    """Take the runner's own cells out of a notebook, and number the others as if they had not been."""
    import nbformat

    notebook = nbformat.read(path, as_version=4)
    notebook.cells = [cell for cell in notebook.cells if TAG not in cell.metadata.get("tags", [])]
    for cell in notebook.cells:
        for counted in [cell, *cell.get("outputs", [])]:
            if counted.get("execution_count"):
                counted["execution_count"] -= 1
    nbformat.write(notebook, path)


def main(folder: Path) -> None:
    """Carry out the order in a folder."""
    # the kernel answers SIGTERM too late when it is inside a solver
    signal.signal(signal.SIGTERM, lambda *_: end_with_descendants(os.getpid()))
    outcome = execute(documents.read(folder / ORDER), folder)
    documents.write(folder / OUTCOME, asdict(outcome))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
