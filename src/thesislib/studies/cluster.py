"""A study on a Dask cluster: its cases sent out, watched, and handed back one by one.

Where cases are computed, which worker has which, and what happens to the cases of one that dies is the
scheduler's business. Here is the client's: to refuse a cluster that is not there or has other sources
before anything is computed, to keep no more than the wanted number of cases under way, and to say what
became of each.
"""

from __future__ import annotations

import asyncio
import importlib.util
import logging
import os
import pickle
import time
import traceback
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from thesislib import provenance
from thesislib.studies import remote
from thesislib.studies.work import Answer

if TYPE_CHECKING:  # it takes half a second to import, and most studies are local
    from distributed import Client, Future

__all__ = ["ClusterError", "check", "compute", "scheduler_address"]

_CONNECT_S = 10.0
_FIRST_WORKER_S = 10.0
_NEW_WORKER_S = 60.0
_POLL_S = 0.05
_log = logging.getLogger(__name__)


class ClusterError(RuntimeError):
    """A cluster that cannot be used: not there, without workers, or with other sources."""


def scheduler_address(said: str | None = None) -> str | None:
    """Return the address of the Dask scheduler that studies go to; None if they stay in local processes.

    Parameters
    ----------
    said : str, optional
        Address as ``tcp://host:8786`` or ``tls://host:8786``; if it is None, ``THESIS_SCHEDULER`` decides.
        An empty text means local processes.

    Raises
    ------
    ValueError
        If that is no such address.
    ClusterError
        If there is an address and the package distributed is not installed.
    """
    name = "THESIS_SCHEDULER" if said is None else "scheduler"
    address = os.environ.get("THESIS_SCHEDULER", "") if said is None else said
    if not address:
        return None
    try:
        parts = urlsplit(address)
        well = parts.scheme in ("tcp", "tls") and bool(parts.hostname) and bool(parts.port)
        rest = address.removeprefix(f"{parts.scheme}://{parts.netloc}") + (parts.username or "")
    except ValueError:  # a port that is no number, or beyond 65535
        well, rest = False, ""
    if not well or rest or any(letter.isspace() for letter in address):
        raise ValueError(
            f"{name} = {address!r} is no address of a Dask scheduler; one looks like 'tcp://host:8786' "
            "or 'tls://host:8786'."
        )
    if importlib.util.find_spec("distributed") is None:
        raise ClusterError(
            f"{name} = {address!r} needs the package distributed, which is not installed; "
            "`pip install thesislib[cluster]` brings it."
        )
    return address


def check(address: str) -> None:
    """Raise `ClusterError` unless a scheduler answers and its workers have this process's sources."""
    with _connected(address):
        pass


def compute(
    address: str,
    orders: Mapping[str, remote.Order],
    jobs: int | None,
    take: Callable[[str, Answer], Mapping[str, remote.Order]],
) -> None:
    """Compute cases on a cluster.

    Parameters
    ----------
    address : str
        What `scheduler_address` returned.
    orders : mapping of str to Order
        The cases.
    jobs : int, optional
        At most so many cases are with the cluster at a time; by default all.
    take : callable
        Takes each case's name and answer as soon as it is there; returns the cases that follow from it,
        which are sent before those that wait.

    Raises
    ------
    ClusterError
        If the scheduler does not answer, has no worker or has one with other sources, before anything is
        computed; if it is lost, or no worker is left for a minute, after that.
    """
    from distributed import as_completed

    keys = {_key(order): (case, order) for case, order in orders.items()}
    with _connected(address) as client, _lines(client, keys):
        finished = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        pending = deque(keys)
        under_way: dict[str, Future] = {}
        patience = _Patience(client, address)
        try:
            while pending or under_way:
                while pending and len(under_way) < (jobs or len(keys)):
                    key = pending.popleft()
                    order = pickle.dumps(keys[key][1])
                    under_way[key] = client.submit(remote.perform, order, key, key=key, pure=False)
                    finished.add(under_way[key])
                if not finished.has_ready():
                    patience.wait()
                    continue
                future, result = next(finished)
                answer = _answer(future, result)
                if answer is None:
                    left = len(pending) + len(under_way)
                    raise ClusterError(
                        f"The scheduler {address} was lost with {left} of {len(keys)} cases unfinished. "
                        "Started again, the study takes up what has been stored."
                    )
                del under_way[future.key]
                followers = {
                    _key(order): (case, order) for case, order in take(keys[future.key][0], answer).items()
                }
                keys |= followers
                pending.extendleft(reversed(followers))
        finally:
            if client.status == "running":
                client.cancel(list(under_way.values()))


def _key(order: remote.Order) -> str:
    """Return the task's key: where the result is stored names it, so that it is computed once for all."""
    if order.file is None or order.fresh:
        return f"{order.file.name if order.file is not None else order.case}-{uuid.uuid4()}"
    return order.file.name


def _answer(future: Future, result: Any) -> Answer | None:
    """Return what came of a task; None if it was lost together with the scheduler."""
    from distributed import KilledWorker

    if future.status == "finished":
        answer: Answer = pickle.loads(result)
        return answer
    if future.status != "error":
        return None
    kind, error, trace = result
    if isinstance(error, KilledWorker):
        return Answer(
            failure=f"{error.allowed_failures + 1} workers died while they computed it, "
            f"the last one at {error.last_worker.address}"
        )
    return Answer(failure="".join(traceback.format_exception(kind, error, trace)))


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    """Be a client of the scheduler, once that and its workers have been found in order."""
    from distributed import Client

    try:
        with ThreadPoolExecutor(1) as thread:  # a notebook's own thread has a running event loop already
            thread.submit(asyncio.run, _greeting(address)).result()
        with warnings.catch_warnings(
            record=True
        ) as said:  # of versions that differ: for the log, not the page
            warnings.simplefilter("always")
            client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except Exception as error:  # refused, timed out, unknown host, no scheduler, another protocol
        raise ClusterError(
            f"No Dask scheduler answers at {address} within {_CONNECT_S:g} s ({_sentence(error)}). "
            "`dask scheduler` starts one and says its address."
        ) from error
    for warning in said:
        _log.warning("%s", warning.message)
    try:
        _compare_sources(client, address)
        yield client
    finally:
        client.close()


async def _greeting(address: str) -> None:
    """Exchange greetings with the scheduler; a client alone would wait for those of a mute one for ever."""
    from distributed.comm import connect
    from distributed.security import Security

    arguments = Security().get_connection_args("client")
    async with asyncio.timeout(_CONNECT_S):
        comm = await connect(address, timeout=0.8 * _CONNECT_S, **arguments)
    await comm.close()


def _compare_sources(client: Client, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=_FIRST_WORKER_S)
    except TimeoutError as error:
        raise ClusterError(
            f"The scheduler {address} has no workers; `dask worker {address}` in a checkout of this project "
            "starts one."
        ) from error
    ours = provenance.source_hash()
    for worker, theirs in client.run(remote.source, on_error="return").items():
        if isinstance(theirs, BaseException):
            raise ClusterError(f"Worker {worker} cannot compute for this project: {_sentence(theirs)}.")
        if theirs != ours:
            raise ClusterError(
                f"Worker {worker} has other sources, data or lock than this process: their hash is {theirs} "
                f"there and {ours} here. Bring both checkouts to the same state."
            )


def _sentence(error: BaseException) -> str:
    """Return what an error, or the one that caused it, says, in one line."""
    said = error.__cause__ or error
    return f"{type(said).__name__}: {said}".partition("\n")[0].rstrip(" .:")


@contextmanager
def _lines(client: Client, keys: Collection[str]) -> Iterator[None]:
    """Log the progress lines of the cases as if they were this process's."""

    def say(event: tuple[float, Mapping[str, Any]]) -> None:
        said = event[1]
        if said["key"] in keys:
            _log.log(said["level"], "%s", said["line"])

    client.subscribe_topic(remote.LINES, say)
    try:
        yield
    finally:
        if client.status == "running":
            client.unsubscribe_topic(remote.LINES)


class _Patience:
    """Waits for the cluster as long as it has workers, and a while for new ones when it has not."""

    def __init__(self, client: Client, address: str) -> None:
        self.client = client
        self.address = address
        self.looked = self.alone_since = time.monotonic()

    def wait(self) -> None:
        """Wait a moment; raise `ClusterError` if there has been no worker for too long."""
        time.sleep(_POLL_S)
        now = time.monotonic()
        if now < self.looked + 1.0:
            return
        self.looked = now
        if self.client.status != "running" or self.client.nthreads():
            self.alone_since = now
        elif now > self.alone_since + _NEW_WORKER_S:
            raise ClusterError(
                f"The scheduler {self.address} has had no workers for {_NEW_WORKER_S:g} s. Started again, "
                "the study takes up what has been stored."
            )
