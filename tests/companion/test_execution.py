"""The process that executes a chapter ends everything it has started."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator

import psutil
import pytest

from thesislib.companion import execution

NESTED = """
import subprocess, sys, time
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
print(child.pid, flush=True)
time.sleep(600)
"""

WATCHED = """
import json, subprocess, sys
from thesislib.companion.execution import Watchman
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
watchman = Watchman(wall_limit_s=0.5)
watchman.start()
code = child.wait()
watchman.join()
print(json.dumps([code, watchman.limit_reached, watchman.seconds, watchman.peak_memory_mb]))
"""

Family = tuple["subprocess.Popen[str]", psutil.Process]


@pytest.fixture
def family() -> Iterator[Family]:
    """A process and the child it has started in a session of its own, as a kernel is."""
    with subprocess.Popen([sys.executable, "-c", NESTED], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        yield process, psutil.Process(int(process.stdout.readline()))
        execution.end_with_descendants(process.pid)


def is_gone(process: psutil.Process) -> bool:
    return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE


def wait_until_gone(process: psutil.Process) -> None:
    limit = time.monotonic() + 10
    while not is_gone(process):
        assert time.monotonic() < limit, "the process is still there"
        time.sleep(0.01)


def test_a_process_is_ended_with_its_descendants(family: Family) -> None:
    process, child = family
    execution.end_with_descendants(process.pid)
    assert process.wait(timeout=10) < 0
    wait_until_gone(child)
    execution.end_with_descendants(process.pid)  # what has gone already is passed over


def test_the_descendants_are_ended_alone_when_the_process_has_to_report(family: Family) -> None:
    process, child = family
    execution.end_with_descendants(process.pid, but_not_itself=True)
    wait_until_gone(child)
    assert process.poll() is None


def test_the_watchman_measures_what_was_started_and_ends_it_at_the_limit() -> None:
    done = subprocess.run(
        [sys.executable, "-c", WATCHED], capture_output=True, text=True, check=True, timeout=60
    )
    code, limit_reached, seconds, peak_memory_mb = json.loads(done.stdout)
    assert code < 0 and limit_reached
    assert 0.5 <= seconds < 30
    assert peak_memory_mb > 5
