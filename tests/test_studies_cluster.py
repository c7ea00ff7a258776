"""Studies on a Dask cluster, here two workers on this machine: whatever dies, nothing finished is lost."""

import importlib.util
import json
import logging
import os
import signal
import socket
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import ModuleType

import numpy as np
import psutil
import pytest

from thesislib import provenance, studies
from thesislib.studies import cluster, remote

ROOT = Path(__file__).resolve().parents[1]

CASES = """
import logging, os, signal, time
from pathlib import Path
import numpy as np

NOTES = Path(os.environ["NOTES"])
GATE = NOTES / "gate"

def note(what, name):
    with (NOTES / "notes.txt").open("a") as notes:
        notes.write(f"{what} {name} {os.getpid()} {os.getppid()}\\n")

def slide(name, g, held=False):
    import casadi as ca
    from thesislib import ocp

    note("start", name)
    while held and not GATE.exists():
        time.sleep(0.02)

    def equations(at):
        x, y, v = at.v * ca.sin(at.theta), at.v * ca.cos(at.theta), at.g * ca.cos(at.theta)
        return ocp.Equations({"x": x, "y": y, "v": v})

    problem = ocp.Problem(
        name="brachistochrone",
        independent=ocp.Independent("t", 0.0, (0.1, 10.0), unit="s"),
        states=[ocp.State(name, "", (-1, 50)) for name in ("x", "y", "v")],
        controls=[ocp.Control("theta", "rad", (0.0, 3.1))],
        equations=equations,
        mayer=lambda ends: ends.final.t,
        initial={"x": 0, "y": 0, "v": 0},
        terminal={"x": 2, "y": 2},
        constants={"g": g},
    )
    solution = ocp.solve(problem, tolerance=1e-6)
    note("end", name)
    return {"time": solution.objective, "v": solution["v"], "meshes": len(solution.history)}

def square(x, pause=0.0):
    import thesislib.polynomials

    note("start", x)
    time.sleep(pause)
    logging.getLogger("thesislib.test").info("100%% of %d", x)
    note("end", x)
    return {
        "square": x * x, "name": f"case {x}", "odd": x % 2 == 1, "threads": os.environ.get("OMP_NUM_THREADS"),
        "grid": np.arange(2.0 * x).reshape(2, x), "texts": np.array(["a", "bc"]),
    }

def fails(how):
    if how == "raises":
        raise ValueError("it is odd")
    if how == "exits":
        os._exit(7)
    if how == "kills its worker":
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(60)
    return {"members": {1, 2} if how == "returns a set" else how}
"""


class LocalCluster:
    """A scheduler and its workers, each a process without a nanny, so that killing one kills the worker."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.environment = os.environ | {
            "PYTHONPATH": os.pathsep.join((str(ROOT / "src"), str(folder))),
            "THESIS_ROOT": str(ROOT),
            "THESIS_COMPILE": "0",
            "NOTES": str(folder),
            "HOME": str(folder),  # Dask writes its settings there
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",
        }
        self.environment.pop("OMP_NUM_THREADS", None)
        self.environment["DASK_TEMPORARY_DIRECTORY"] = str(folder)
        self.workers: list[subprocess.Popen[bytes]] = []
        # the idle limit ends all of them even if these tests are killed
        self.scheduler = self.start("scheduler", "--port", "0", "--idle-timeout", "120 s")

    @cached_property
    def address(self) -> str:
        """What the scheduler has written into its file."""
        wait_until(lambda: self.file.is_file() and self.file.read_text().rstrip().endswith("}"))
        return str(json.loads(self.file.read_text())["address"])

    def start(self, role: str, *options: str) -> subprocess.Popen[bytes]:
        options = ("--scheduler-file", str(self.file), *options)
        command = [sys.executable, "-m", "dask", role, "--host", "127.0.0.1"]
        with (self.folder / "dask.log").open("ab") as log:
            return subprocess.Popen(
                [*command, "--no-dashboard", "--dashboard-address", "127.0.0.1:0", *options],
                cwd=self.folder,
                env=self.environment,
                stdout=log,
                stderr=log,
            )

    def with_workers(self, count: int) -> None:
        """Have so many workers alive and registered."""
        assert self.address
        self.workers = [worker for worker in self.workers if worker.poll() is None]
        options = (
            "--no-nanny",
            "--nthreads",
            "1",
            "--local-directory",
            str(self.folder),
            "--death-timeout",
            "60",
        )
        registered = self.registered()
        missing = count - len(self.workers)
        self.workers += [self.start("worker", *options) for _ in range(missing)]
        wait_until(lambda: self.registered() >= registered + missing)

    def registered(self) -> int:
        return (self.folder / "dask.log").read_bytes().count(b"Registered to:")

    def close(self) -> None:
        for process in (self.scheduler, *self.workers):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalCluster]:
    folder = tmp_path_factory.mktemp("cluster")
    (folder / "cluster_cases.py").write_text(CASES)
    local = LocalCluster(folder)
    try:
        yield local
    finally:
        local.close()


@pytest.fixture
def workers(started: LocalCluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LocalCluster:
    """The cluster with two workers, no notes, and an empty store."""
    started.with_workers(2)
    for name in ("notes.txt", "gate"):
        (started.folder / name).unlink(missing_ok=True)
    for name in ("THESIS_SCHEDULER", "THESIS_FROM_SOLUTION", "THESIS_FRESH", "THESIS_LOG", "THESIS_SLOTS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("THESIS_ROOT", str(ROOT))
    monkeypatch.setenv("THESIS_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("THESIS_COMPILE", "0")
    monkeypatch.setenv("NOTES", str(started.folder))
    monkeypatch.setattr(provenance._watch, "elsewhere", provenance.Usage())
    return started


@pytest.fixture
def cases(workers: LocalCluster, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    monkeypatch.syspath_prepend(workers.folder)
    import cluster_cases

    yield cluster_cases
    sys.modules.pop("cluster_cases", None)


def notes(workers: LocalCluster) -> list[tuple[str, str, int, int]]:
    """What the cases have noted: start or end, the case, its process and that process's parent."""
    path = workers.folder / "notes.txt"
    lines = path.read_text().splitlines() if path.is_file() else []
    return [(what, name, int(pid), int(parent)) for what, name, pid, parent in map(str.split, lines)]


def ends(workers: LocalCluster) -> list[str]:
    return sorted(name for what, name, *_ in notes(workers) if what == "end")


def wait_until(condition: Callable[[], bool], seconds: float = 240.0) -> None:
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit, "the condition did not come true in time"
        time.sleep(0.02)


class InBackground:
    """Does something while the ``with`` block runs, and raises afterwards what went wrong with it."""

    def __init__(self, action: Callable[[], None]) -> None:
        self.pool = ThreadPoolExecutor(1)
        self.action = action

    def __enter__(self) -> None:
        self.future = self.pool.submit(self.action)

    def __exit__(self, *_: object) -> None:
        self.pool.shutdown()
        self.future.result()


def slides(count: int, held: int) -> dict[str, dict[str, object]]:
    """So many solves, of which one waits for the gate."""
    return {f"g{n}": {"name": f"g{n}", "g": 5.0 + n, "held": n == held} for n in range(count)}


# -- a study ------------------------------------------------------------------------------------


def test_killing_a_worker_loses_nothing_finished_and_repeats_only_what_it_had_under_way(
    workers: LocalCluster, cases: ModuleType
) -> None:
    wanted = slides(5, held=1)

    def kill_the_worker_that_is_held() -> None:
        wait_until(
            lambda: len(ends(workers)) >= 2 and any(note[:2] == ("start", "g1") for note in notes(workers))
        )
        child, worker = next(note[2:] for note in notes(workers) if note[:2] == ("start", "g1"))
        os.kill(worker, signal.SIGKILL)
        wait_until(lambda: not psutil.pid_exists(child))  # the case's process ends with its worker
        (workers.folder / "gate").touch()

    with InBackground(kill_the_worker_that_is_held):
        results = studies.run(wanted, cases.slide, scheduler=workers.address)

    assert ends(workers) == sorted(wanted), "each case has finished once"
    starts = [name for what, name, *_ in notes(workers) if what == "start"]
    assert sorted(starts) == sorted([*wanted, "g1"]), "only the case under way was begun twice"
    assert list(results) == list(wanted) and not any(result.stored for result in results.values())
    for n, result in enumerate(results.values()):
        # T goes as the root of 1/g; an optimal time's error is of second order in that of the states, 1e-6
        assert result["time"] == pytest.approx(0.8243386694 * np.sqrt(9.81 / (5.0 + n)), rel=1e-7)

    again = studies.run(wanted, cases.slide, scheduler=workers.address)
    assert all(result.stored for result in again.values()) and len(ends(workers)) == len(wanted)
    here = studies.run({"g3": wanted["g3"]}, cases.slide, store=False)["g3"]
    for found in (results["g3"], again["g3"]):
        assert list(found) == list(here) and found["time"] == here["time"]
        np.testing.assert_array_equal(found["v"], here["v"])


def test_a_study_whose_process_is_killed_goes_on_from_what_is_stored(
    workers: LocalCluster, cases: ModuleType, tmp_path: Path
) -> None:
    wanted = slides(4, held=2)
    script = f"""
        import cluster_cases
        from thesislib import studies
        studies.run({wanted!r}, cluster_cases.slide)
    """
    (tmp_path / "script.py").write_text(textwrap.dedent(script))
    environment = workers.environment | {
        name: os.environ[name] for name in ("THESIS_STORE", "THESIS_COMPILE", "THESIS_ROOT")
    }
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "script.py")], env=environment | {"THESIS_SCHEDULER": workers.address}
    )
    kept = tmp_path / "store"
    try:
        wait_until(
            lambda: len(list(kept.glob("*.json"))) >= 1 and "g2" in {note[1] for note in notes(workers)}
        )
    finally:
        process.kill()
        process.wait()
    (workers.folder / "gate").touch()
    wait_until(lambda: bool(list(kept.glob("slide-g2-*.json"))))  # the case under way ends and is stored
    results = studies.run(wanted, cases.slide, scheduler=workers.address)
    assert results["g2"].stored and sum(result.stored for result in results.values()) >= 2
    assert ends(workers) == sorted(wanted), "no case has finished twice"


def test_results_come_back_whole_and_a_local_study_takes_them_up(
    workers: LocalCluster,
    cases: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setenv("THESIS_SCHEDULER", workers.address)
    monkeypatch.setattr(logging.getLogger("thesislib"), "propagate", True)
    wanted = {f"x = {x}": {"x": x} for x in (4, 9, 1)}
    with caplog.at_level(logging.INFO, logger="thesislib"):
        first = studies.run(wanted, cases.square)
    assert {f"x = {x}: 100% of {x}" for x in (4, 9, 1)} <= set(caplog.messages), "progress is logged here"
    assert {note[3] for note in notes(workers)} <= {worker.pid for worker in workers.workers}
    used = provenance._watch.elsewhere.modules
    assert "thesislib.polynomials" in used, "what the workers used counts as used here"

    monkeypatch.setenv("THESIS_SCHEDULER", "")
    again = studies.run(wanted, cases.square)
    assert [result.stored for result in (*first.values(), *again.values())] == 3 * [False] + 3 * [True]
    expected = cases.square(9)
    for result in (first["x = 9"], again["x = 9"]):
        assert list(result) == list(expected)
        for name, value in expected.items():
            if not isinstance(value, np.ndarray):
                assert result[name] == ("1" if name == "threads" else value)
                continue
            array = result[name]
            assert isinstance(array, np.ndarray) and array.dtype == value.dtype and array.flags.writeable
            np.testing.assert_array_equal(array, value)


def test_cases_follow_from_results_of_a_cluster(workers: LocalCluster, cases: ModuleType) -> None:
    def next_ones(case: str, result: studies.Result) -> dict[str, dict[str, int]]:
        x = int(result["square"])
        return {f"{case}, {y}": {"x": y} for y in (x - 1, x + 1)} if x < 10 else {}

    results = studies.run(
        {"a": {"x": 2}, "b": {"x": 4}}, cases.square, jobs=1, scheduler=workers.address, follow=next_ones
    )
    assert [name for what, name, *_ in notes(workers) if what == "end"] == ["2", "3", "8", "10", "5", "4"]
    assert {name: result["square"] for name, result in results.items()} == {
        "a": 4, "b": 16, "a, 3": 9, "a, 5": 25, "a, 3, 8": 64, "a, 3, 10": 100,
    }  # fmt: skip
    local = studies.run({"a": {"x": 2}, "b": {"x": 4}}, cases.square, follow=next_ones)
    assert all(result.stored for result in local.values()) and set(local) == set(results)


def test_a_fresh_study_computes_again_one_case_at_a_time_if_told_so(
    workers: LocalCluster, cases: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = {f"x = {x}": {"x": x, "pause": 0.1} for x in (1, 2)}
    monkeypatch.setenv("THESIS_FRESH", "1")
    for _ in range(2):
        results = studies.run(wanted, cases.square, jobs=1, scheduler=workers.address)
        assert not any(result.stored for result in results.values())
    assert [what for what, *_ in notes(workers)] == 4 * ["start", "end"], "never two at a time"


def test_results_of_workers_that_do_not_share_the_store_are_stored_by_the_study(
    workers: LocalCluster, cases: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    made = remote.Order.of.__func__

    def elsewhere(cls: type[remote.Order], case: str, *arguments: object) -> remote.Order:
        order = made(cls, case, *arguments)
        return replace(order, file=tmp_path / "another machine" / order.file.name)

    monkeypatch.setattr(remote.Order, "of", classmethod(elsewhere))
    studies.run({"a": {"x": 2}}, cases.square, scheduler=workers.address)
    assert not (tmp_path / "another machine").exists()
    assert studies.run({"a": {"x": 2}}, cases.square, scheduler=workers.address)["a"].stored
    (record,) = (tmp_path / "store").glob("square-a-*.json")
    assert "thesislib.polynomials" in json.loads(record.read_text())["used"]["modules"], (
        "with what the worker used"
    )


def test_failing_cases_are_named_after_the_others_have_finished(
    workers: LocalCluster, cases: ModuleType
) -> None:
    workers.with_workers(3)  # two of them are going to be killed
    ways = ("kills its worker", "raises", "exits", "returns a set", "goes well")
    with pytest.raises(studies.StudyError, match="4 of 5 cases failed") as info:
        # one at a time: the scheduler blames whatever a dying worker had under way for its death
        studies.run({way: {"how": way} for way in ways}, cases.fails, jobs=1, scheduler=workers.address)
    failures = info.value.failures
    assert sorted(failures) == sorted(ways[:4])
    assert "2 workers died while they computed it" in failures["kills its worker"]
    assert "ValueError: it is odd" in failures["raises"] and "in fails" in failures["raises"]
    assert "ended with exit code 7" in failures["exits"] and "on worker tcp://" in failures["exits"]
    assert "A solution's 'members' is a set" in failures["returns a set"]
    well = studies.run({"goes well": {"how": "goes well"}}, cases.fails, scheduler=workers.address)
    assert well["goes well"].stored, "what finished is kept"


def test_a_lost_scheduler_is_said_and_what_was_finished_is_kept(
    workers: LocalCluster, cases: ModuleType, tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> None:
    folder = tmp_path_factory.mktemp("another")
    (folder / "cluster_cases.py").write_text(CASES)
    another = LocalCluster(folder)

    def kill_the_scheduler() -> None:
        wait_until(lambda: bool(list((tmp_path / "store").glob("*.json"))))
        another.scheduler.kill()

    try:
        another.with_workers(1)
        wanted = {str(x): {"x": x, "pause": 0.0 if x == 1 else 60.0} for x in (1, 2)}
        with (
            InBackground(kill_the_scheduler),
            pytest.raises(studies.ClusterError, match=r"was lost with [12] of 2 cases"),
        ):
            studies.run(wanted, cases.square, scheduler=another.address)
    finally:
        another.close()
    assert studies.run({"1": wanted["1"]}, cases.square, scheduler=workers.address)["1"].stored


# -- refusals -----------------------------------------------------------------------------------


def test_workers_with_other_sources_are_refused_with_both_hashes(
    workers: LocalCluster, cases: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    theirs = provenance.source_hash()
    (tmp_path / "book").mkdir()
    monkeypatch.setenv("THESIS_ROOT", str(tmp_path))  # a project with other data
    ours = provenance.source_hash()
    with pytest.raises(studies.ClusterError, match=f"their hash is {theirs} there and {ours} here"):
        studies.run({"a": {"x": 1}}, cases.square, scheduler=workers.address)
    assert notes(workers) == []


def test_a_case_compares_the_sources_once_more_where_it_is_computed(cases: ModuleType) -> None:
    there = ("a" * 64, "b" * 64)
    order = remote.Order.of("late", cases.square, {"x": 1}, None, there)
    failure = order.answer().failure
    assert failure is not None and f"{provenance.source_hash()} at the worker and {there[0]} where" in failure
    order = remote.Order.of("late", cases.square, {"x": 1}, None, (provenance.source_hash(), there[1]))
    failure = order.answer().failure
    assert failure is not None and "file of square have the hash" in failure


def test_a_scheduler_that_does_not_answer_is_said_before_anything_is_computed(
    workers: LocalCluster, cases: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "_CONNECT_S", 1.0)
    with socket.socket() as mute:
        mute.bind(("127.0.0.1", 0))
        mute.listen()
        for address in ("tcp://127.0.0.1:1", f"tcp://127.0.0.1:{mute.getsockname()[1]}"):
            with pytest.raises(
                studies.ClusterError, match=f"No Dask scheduler answers at {address} within 1 s"
            ):
                studies.run({"a": {"x": 1}}, cases.square, scheduler=address)
    assert notes(workers) == []


NOWHERE = """
    host:8786 tcp://host tcp://:8786 tcp://host:0 tcp://host:99999 tcp://host:87a http://host:8786
    tcp://host:8786/ tcp://host:8786?x tcp://me@host:8786
"""


@pytest.mark.parametrize("said", [*NOWHERE.split(), " tcp://host:8786", "tcp://ho st:8786"])
def test_an_address_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch, said: str) -> None:
    with pytest.raises(ValueError, match=r"scheduler = .* is no address of a Dask scheduler"):
        cluster.scheduler_address(said)
    monkeypatch.setenv("THESIS_SCHEDULER", said)
    with pytest.raises(ValueError, match=r"THESIS_SCHEDULER = .* is no address of a Dask scheduler"):
        cluster.scheduler_address()
    assert cluster.scheduler_address("") is None, "an empty address means local processes"


@pytest.mark.parametrize("address", ["tcp://host:8786", "tls://10.0.0.7:1", "tcp://[::1]:8786"])
def test_an_address_needs_the_package_that_the_extra_brings(
    monkeypatch: pytest.MonkeyPatch, address: str
) -> None:
    assert cluster.scheduler_address(address) == address
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(studies.ClusterError, match=r"pip install thesislib\[cluster\]"):
        cluster.scheduler_address(address)
