"""The one pool of a command: as many job slots as it may keep cores busy.

A slot is a lock on a file below ``THESIS_SLOTS``; there are ``THESIS_JOBS`` of them (default: the
cores). Chapters running side by side and the studies inside them take from the same files. The
operating system releases a lock when its holder dies, so a killed run leaves no slot taken.
"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from thesislib import provenance

__all__ = ["Slot", "Slots", "jobs", "slots"]

_POLL_S = 0.1


def jobs() -> int:
    """Return how many jobs may run side by side: ``THESIS_JOBS``, or the cores this process may use.

    Raises
    ------
    ValueError
        If ``THESIS_JOBS`` is not a whole number from 1 to 1024.
    """
    said = os.environ.get("THESIS_JOBS", "")
    if not said:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not said.isascii() or not said.isdigit() or not 1 <= int(said) <= 1024:
        raise ValueError(f"THESIS_JOBS = {said!r} is not a whole number from 1 to 1024.")
    return int(said)


@dataclass
class Slot:
    """A slot that is held until it is released, or until its holder dies."""

    descriptor: int

    def release(self) -> None:
        """Give the slot back; a second call does nothing."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1


@dataclass(frozen=True)
class Slots:
    """A pool of slots.

    Attributes
    ----------
    folder : Path
        Folder of the lock files.
    count : int
        Number of slots.
    """

    folder: Path
    count: int

    def take(self) -> Slot | None:
        """Take a free slot; None if there is none."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for number in range(self.count):
            descriptor = os.open(self.folder / f"slot-{number}", os.O_CREAT | os.O_RDWR, 0o600)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                continue
            return Slot(descriptor)
        return None

    @contextmanager
    def held(self) -> Iterator[Slot]:
        """Wait for a slot and hold it for the length of a ``with`` block."""
        while (slot := self.take()) is None:
            time.sleep(_POLL_S)
        try:
            yield slot
        finally:
            slot.release()


def slots() -> Slots:
    """Return the pool this process belongs to.

    Outside a command, where ``THESIS_SLOTS`` is not set, that is the project's own pool in
    ``_build/slots``.
    """
    folder = os.environ.get("THESIS_SLOTS")
    return Slots(Path(folder) if folder else provenance.project_root() / "_build" / "slots", jobs())
