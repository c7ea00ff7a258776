"""Studies: one pool of slots, results that survive a kill, failures that name their case."""

import logging
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import psutil
import pytest

from thesislib import provenance, studies
from thesislib.studies import store

CASES = """
import os, time
from pathlib import Path
import numpy as np

ROOT = Path(os.environ["THESIS_ROOT"])

def note(name):
    with (ROOT / "calls.txt").open("a") as calls:
        calls.write(f"{name}\\n")

def square(x):
    note(x)
    return {"square": x * x, "root": np.sqrt(x), "name": f"case {x}", "grid": np.arange(x), "odd": x % 2 == 1}

def reads_data(name):
    return {"text": (ROOT / "data" / name).read_text()}

def fails_if_odd(x):
    note(x)
    if x % 2:
        raise ValueError(f"{x} is odd")
    return {"x": x}

def dies(x):
    if x == 1:
        os._exit(7)
    return {"x": x}

def slow(x):
    note(x)
    time.sleep(0.4)
    return {"x": x, "pid": os.getpid()}

def says(x):
    import logging
    logging.getLogger("thesislib.test").info("100%% of case %d", x)
    return {"threads": os.environ.get("OMP_NUM_THREADS", "")}

def returns_a_set():
    return {"members": {1, 2}}
"""


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "book").mkdir()
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "a.txt").write_text("a")
    (tmp_path / provenance.LOCK).write_text("")
    monkeypatch.setenv("THESIS_ROOT", str(tmp_path))
    monkeypatch.setenv("THESIS_JOBS", "2")
    for name in ("SLOTS", "STORE", "FROM_SOLUTION", "FRESH", "LOG", "SCHEDULER"):
        monkeypatch.delenv(f"THESIS_{name}", raising=False)
    monkeypatch.setattr(provenance._watch, "elsewhere", provenance.Usage())
    return tmp_path


@pytest.fixture
def cases(root: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """A module that worker processes can import."""
    (root / "study_cases.py").write_text(CASES)
    monkeypatch.syspath_prepend(root)
    monkeypatch.delitem(sys.modules, "study_cases", raising=False)
    import study_cases

    yield study_cases
    sys.modules.pop("study_cases", None)


def calls(root: Path) -> list[str]:
    path = root / "calls.txt"
    return sorted(path.read_text().split()) if path.is_file() else []


def test_results_come_back_whole_in_order_and_are_taken_up_the_next_time(
    root: Path, cases: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = {f"x = {x}": {"x": x} for x in (4, 9, 1)}
    first = studies.run(wanted, cases.square)
    assert list(first) == ["x = 4", "x = 9", "x = 1"]
    assert not any(result.stored for result in first.values())
    again = studies.run(wanted, cases.square)
    assert all(result.stored for result in again.values())
    assert calls(root) == ["1", "4", "9"]
    for results in (first, again):
        result = results["x = 9"]
        assert list(result) == ["square", "root", "name", "grid", "odd"]
        assert (result["square"], result["root"], result["name"], result["odd"]) == (81, 3.0, "case 9", True)
        np.testing.assert_array_equal(result["grid"], np.arange(9))
    files = list((root / "_build" / "solutions").iterdir())
    assert sorted(path.suffix for path in files) == [".json"] * 3 + [".npz"] * 3
    for path in files:
        if path.suffix == ".npz":
            np.load(path, allow_pickle=False)["array_0"]  # nothing on disk is pickled
    monkeypatch.setenv("THESIS_FRESH", "1")
    assert not studies.run({"x = 4": {"x": 4}}, cases.square)["x = 4"].stored
    assert calls(root) == ["1", "4", "4", "9"]


def test_a_failing_case_is_named_after_the_others_have_finished(root: Path, cases: ModuleType) -> None:
    said = r"1 of 3 cases failed.*case 'odd'.*ValueError: 3 is odd"
    with pytest.raises(studies.StudyError, match=said) as info:
        studies.run({"odd": {"x": 3}, "two": {"x": 2}, "four": {"x": 4}}, cases.fails_if_odd)
    assert list(info.value.failures) == ["odd"]
    assert "fails_if_odd" in info.value.failures["odd"], "the traceback leads to the function"
    assert calls(root) == ["2", "3", "4"]
    results = studies.run({"two": {"x": 2}, "four": {"x": 4}}, cases.fails_if_odd)
    assert all(result.stored for result in results.values()), "what finished is kept"


def halves(case: str, result: studies.Result) -> dict[str, dict[str, int]]:
    """Return the cases that follow a number: the two that differ by one from its half, down to four."""
    half = int(result["x"]) // 2
    return {f"{case}, {x}": {"x": x} for x in (half - 1, half + 1)} if half > 3 else {}


def test_cases_follow_from_results_and_go_before_those_that_wait(
    root: Path, cases: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = {"a": {"x": 16}, "b": {"x": 2}}
    first = studies.run(wanted, cases.slow, jobs=1, follow=halves)
    names = ["a", "b", "a, 7", "a, 9", "a, 9, 3", "a, 9, 5"]
    assert sorted(first) == sorted(names) and list(first)[:2] == ["a", "b"]
    order = (root / "calls.txt").read_text().split()
    assert order == ["16", "7", "9", "3", "5", "2"], "a chain is finished before what waits is begun"
    again = studies.run(wanted, cases.slow, follow=halves)
    assert list(again) and all(result.stored for result in again.values()) and set(again) == set(first)
    next((root / "_build" / "solutions").glob("slow-a-9-????????????????????????????????.json")).unlink()
    (root / "calls.txt").unlink()
    third = studies.run(wanted, cases.slow, follow=halves)
    assert [name for name, result in third.items() if not result.stored] == ["a, 9"]
    assert calls(root) == ["9"], "what follows a case that was lost is still there"


def test_nothing_follows_a_failure_and_the_rest_is_finished(root: Path, cases: ModuleType) -> None:
    with pytest.raises(studies.StudyError, match=r"2 of 3 cases failed.*case 'a, 7'.*case 'a, 9'") as info:
        studies.run({"a": {"x": 16}}, cases.fails_if_odd, follow=halves)
    assert set(info.value.failures) == {"a, 7", "a, 9"}
    assert calls(root) == ["16", "7", "9"]


def test_a_case_that_is_there_already_cannot_follow(root: Path, cases: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"The study has a case 'a' already\."):
        studies.run({"a": {"x": 2}}, cases.slow, follow=lambda *_: {"a": {"x": 4}})


def test_a_case_whose_process_dies_is_named_with_its_exit_code(root: Path, cases: ModuleType) -> None:
    with pytest.raises(studies.StudyError, match=r"case 'deadly'.*exit code 7") as info:
        studies.run({"deadly": {"x": 1}, "well": {"x": 2}}, cases.dies, jobs=1)
    assert list(info.value.failures) == ["deadly"]


def test_a_killed_study_resumes_with_the_cases_that_were_not_finished(root: Path, cases: ModuleType) -> None:
    script = textwrap.dedent(
        """
        import study_cases
        from thesislib import studies
        if __name__ == "__main__":
            studies.run({str(x): {"x": x} for x in range(4)}, study_cases.slow, jobs=1)
        """
    )
    (root / "script.py").write_text(script)
    process = subprocess.Popen([sys.executable, str(root / "script.py")], cwd=root)
    finished = root / "_build" / "solutions"
    wait_until(lambda: len(running_below(root)) >= 2)
    wait_until(lambda: len(list(finished.glob("slow*.json"))) >= 2)
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = {path.name for path in finished.glob("slow*.json")}
    assert 2 <= len(done) < 4, "the kill came in the middle"
    wait_until(lambda: not running_below(root))  # the workers end with their study
    results = studies.run({str(x): {"x": x} for x in range(4)}, cases.slow, jobs=1)
    assert [result.stored for result in results.values()].count(True) >= len(done)
    recomputed = [x for x in calls(root) if calls(root).count(x) > 1]
    assert len(set(recomputed)) <= 1, "only the case that was under way is computed twice"


def running_below(root: Path) -> list[str]:
    """Return the processes that were started in a project's folder."""
    return [
        process.info["name"]
        for process in psutil.process_iter(["cwd", "name", "status"])
        if process.info["cwd"] == str(root.resolve()) and process.info["status"] != psutil.STATUS_ZOMBIE
    ]


def wait_until(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit, "the condition did not come true in time"
        time.sleep(0.02)


def test_data_files_that_a_worker_opens_count_as_used_here_also_when_taken_up(
    root: Path, cases: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    studies.run({"a": {"name": "a.txt"}}, cases.reads_data)
    assert "data/a.txt" in provenance.usage().data_files
    monkeypatch.setattr(provenance._watch, "elsewhere", provenance.Usage())
    assert "data/a.txt" not in provenance.usage().data_files
    assert studies.run({"a": {"name": "a.txt"}}, cases.reads_data)["a"].stored
    assert "data/a.txt" in provenance.usage().data_files
    (root / "data" / "a.txt").write_text("b")
    result = studies.run({"a": {"name": "a.txt"}}, cases.reads_data)["a"]
    assert (result.stored, result["text"]) == (False, "b"), "an edited data file is another key"


def test_progress_of_a_worker_goes_to_the_log_of_the_run_with_its_case(
    root: Path, cases: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("THESIS_LOG", str(root / "log.txt"))
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    results = studies.run({"100 %": {"x": 5}}, cases.says, store=False)
    assert (root / "log.txt").read_text() == "100 %: 100% of case 5\n"
    assert results["100 %"]["threads"] == "1", "workers share the cores: one thread each"
    assert "OMP_NUM_THREADS" not in os.environ
    assert not (root / "_build" / "solutions").exists(), "store=False writes nothing"


@pytest.mark.parametrize(
    "function", [lambda x: {"x": x}, type("Callable", (), {"__call__": lambda self, x: {"x": x}})()]
)
def test_a_function_that_a_worker_cannot_import_is_refused(root: Path, function: Any) -> None:
    with pytest.raises(TypeError, match="does not live at the top of a module"):
        studies.run({"a": {"x": 1}}, function)


def test_arguments_that_cannot_be_part_of_a_key_are_refused(root: Path, cases: ModuleType) -> None:
    with pytest.raises(TypeError, match="A set cannot be part of a solution's key"):
        studies.run({"a": {"x": {1, 2}}}, cases.square)
    with pytest.raises(TypeError, match="An array of type object"):
        studies.run({"a": {"x": np.array([None])}}, cases.square)
    assert calls(root) == []


def test_a_result_that_cannot_be_stored_fails_its_case(root: Path, cases: ModuleType) -> None:
    with pytest.raises(studies.StudyError, match="A solution's 'members' is a set"):
        studies.run({"a": {}}, cases.returns_a_set)


def test_a_study_needs_a_job(root: Path, cases: ModuleType) -> None:
    with pytest.raises(ValueError, match="jobs = 0"):
        studies.run({"a": {"x": 1}}, cases.square, jobs=0)


def test_equal_keys_are_equal_inputs_only() -> None:
    def key(value: Any) -> str:
        return provenance.digest(store.canonical(value))

    assert key({"a": np.float64(1.5), "b": (1, 2)}) == key({"b": [1, 2], "a": 1.5})
    assert key(np.array([1.0, 2.0])) != key(np.array([1.0, 2.0], dtype="f4"))
    assert key(np.array([[1.0, 2.0]])) != key(np.array([1.0, 2.0]))
    assert key(1.0) != key(1.0 + 2**-52)
    assert key(True) != key("true")


# -- one solve ----------------------------------------------------------------------------------


def test_a_solution_is_read_only_in_a_run_from_stored_solutions(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    computed = []

    def compute() -> dict[str, Any]:
        computed.append(1)
        return {"x": np.linspace(0, 1, 3), "status": "Solve_Succeeded", "count": np.int64(3)}

    assert not studies.stored("row C", {"mass": 660.0}, compute).stored
    assert not studies.stored("row C", {"mass": 660.0}, compute).stored, "a normal run solves"
    monkeypatch.setenv("THESIS_FROM_SOLUTION", "1")
    found = studies.stored("row C", {"mass": 660.0}, compute)
    assert found.stored and found["count"] == 3 and found["status"] == "Solve_Succeeded"
    np.testing.assert_array_equal(found["x"], [0.0, 0.5, 1.0])
    assert not studies.stored("row C", {"mass": 661.0}, compute).stored, "another mass is another solution"
    assert len(computed) == 3


def test_a_damaged_solution_is_computed_again(
    root: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("THESIS_FROM_SOLUTION", "1")
    studies.stored("lap", {}, lambda: {"x": np.ones(3)})
    next((root / "_build" / "solutions").glob("lap-*.npz")).write_bytes(b"PK half a file")
    monkeypatch.setattr(logging.getLogger("thesislib"), "propagate", True)
    assert not studies.stored("lap", {}, lambda: {"x": np.ones(3)}).stored
    assert "computed again" in caplog.text


# -- slots --------------------------------------------------------------------------------------


def test_there_are_no_more_slots_than_jobs(root: Path) -> None:
    pool = studies.slots()
    assert pool == studies.Slots(root / "_build" / "slots", 2)
    taken = [pool.take(), pool.take()]
    assert all(slot is not None for slot in taken) and pool.take() is None
    for slot in taken:
        assert slot is not None
        slot.release()
        slot.release()  # a second release is no error and frees nothing else
    with pool.held():
        last = pool.take()
        assert last is not None and pool.take() is None
        last.release()


def test_the_slot_of_a_process_that_is_killed_is_free_again(root: Path) -> None:
    pool = studies.Slots(root / "slots", 1)
    script = "import sys, time; from pathlib import Path; from thesislib.studies import Slots;"
    script += "Slots(Path(sys.argv[1]), 1).take(); print('taken', flush=True); time.sleep(60)"
    holder = subprocess.Popen([sys.executable, "-c", script, str(root / "slots")], stdout=subprocess.PIPE)
    assert holder.stdout is not None
    holder.stdout.readline()
    assert pool.take() is None
    holder.kill()
    holder.communicate()
    assert pool.take() is not None


def test_a_study_goes_on_in_its_callers_slot_when_all_are_taken(root: Path, cases: ModuleType) -> None:
    pool = studies.slots()
    with pool.held(), pool.held():
        results = studies.run({str(x): {"x": x} for x in range(2)}, cases.slow)
    assert len({result["pid"] for result in results.values()}) == 1


def test_a_study_takes_the_slots_that_are_free(root: Path, cases: ModuleType) -> None:
    with studies.slots().held():  # the caller's own
        results = studies.run({str(x): {"x": x} for x in range(4)}, cases.slow)
    assert len({result["pid"] for result in results.values()}) == 2
    pool = studies.slots()
    assert pool.take() is not None and pool.take() is not None, "the study has given its slots back"


@pytest.mark.parametrize("said", ["0", "two", "-1", "1.5", "²", "2000"])
def test_a_number_of_jobs_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch, said: str) -> None:
    monkeypatch.setenv("THESIS_JOBS", said)
    with pytest.raises(ValueError, match="not a whole number from 1 to 1024"):
        studies.jobs()
