"""Chapters are run by the real papermill, published whole or not at all, and stopped cleanly."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import nbformat
import psutil
import pytest

SCHEMA = json.loads((Path(__file__).resolve().parents[2] / "docs" / "record-schema.json").read_text())


def values(record: dict[str, Any]) -> dict[str, float]:
    return {name: entry["value"] for name, entry in record["values"].items()}


def wait_until(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit, "the condition did not come true in time"
        time.sleep(0.05)


def running_below(root: Path) -> list[str]:
    """Return the names of the processes whose working folder is in a project."""
    found = []
    for process in psutil.process_iter(["cwd", "name", "status"]):
        folder, status = process.info["cwd"], process.info["status"]
        if folder and Path(folder).is_relative_to(root.resolve()) and status != psutil.STATUS_ZOMBIE:
            found.append(process.info["name"])
    return found


# -- a run that goes well -----------------------------------------------------------------------


def test_a_good_chapter_is_published_though_others_fail(executed: Any) -> None:
    assert executed.said.returncode == 1
    record = executed.project.record("01")
    jsonschema.validate(record, SCHEMA)
    assert record["run"]["status"] == "finished"
    assert values(record)["mass"] == 2.0 and values(record)["car_mass"] == 660.0
    folder = executed.project.root / "_build/run/01"
    assert {path.name for path in folder.iterdir()} == {
        "record.json",
        "log.txt",
        "figure_1.1_line.csv",
        "table_1.1.csv",
    }


def test_the_record_says_how_and_of_what_it_was_made(executed: Any) -> None:
    run = executed.project.record("01")["run"]
    assert 0 < run["seconds"] < 120
    assert 40 < run["peak_memory_mb"] < 2000
    assert run["parameters"] == {"mass": 2.0}
    assert (run["changed"], run["from_solution"], run["compiled"]) == (False, False, None)
    assert run["versions"]["numpy"] and run["versions"]["thesislib"]
    assert run["python"] == ".".join(map(str, sys.version_info[:3]))
    assert set(run["data_files"]) == {"data/tracks/short.csv", "data/vehicles/car.toml"}
    assert {"thesislib.companion.records", "thesislib.studies.cases"} <= set(run["modules"])
    assert "thesislib.companion.checks" not in run["modules"], "what checks a run cannot change it"


def test_the_executed_notebook_is_the_chapters_cells_and_no_others(executed: Any) -> None:
    chapter = executed.project.chapter("01")
    notebook = nbformat.read(chapter.executed, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.source.strip() for cell in code] == [source.strip() for source in chapter.code]
    assert [cell.execution_count for cell in code] == [1, 2, 3, 4, 5]
    assert code[-1].outputs[0].text == "the folder is book\n"
    assert code[-1].outputs[1].execution_count == 5
    html = code[-2].outputs[0].data["text/html"]
    assert "<td>2.0 kg</td><td>2.00 kg</td>" in html


def test_progress_goes_to_the_log_and_the_terminal_and_not_into_the_page(executed: Any) -> None:
    log = (executed.project.root / "_build/run/01/log.txt").read_text()
    assert "mesh 1: 10 intervals\n" in log
    assert "01: mesh 1: 10 intervals\n" in executed.said.stdout
    notebook = nbformat.read(executed.project.chapter("01").executed, as_version=4)
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert outputs and "mesh 1" not in json.dumps(outputs)


def test_start_up_files_of_the_user_do_not_change_a_run(executed: Any) -> None:
    assert values(executed.project.record("01"))["intruders"] == 0


def test_run_times_are_told_at_the_end(executed: Any) -> None:
    last = executed.said.stdout.splitlines()[-1]
    assert last.startswith("01: ") and last.endswith("_build/run/01") and " s, " in last


# -- runs that fail -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("id", "said"),
    [
        ("02", "code cell 4 raised ValueError: math domain error"),
        ("03", "it was stopped at its wall limit of 4 s"),
        ("04", "its kernel died"),
        ("05", "it stopped before its last cell"),
    ],
)
def test_a_failing_chapter_is_named_with_its_cell_and_keeps_what_there_is(
    executed: Any, id: str, said: str
) -> None:
    line = next(line for line in executed.said.stderr.splitlines() if f"chapter {id} failed" in line)
    assert said in line
    failed = executed.project.root / "_build/failed"
    assert (failed / f"{id}_small.log.txt").is_file()
    assert said in json.loads((failed / f"{id}_small.json").read_text())["failure"]
    assert not (executed.project.root / "_build/run" / id).exists()
    assert not executed.project.chapter(id).executed.exists()


def test_the_partial_notebook_shows_how_far_it_came(executed: Any) -> None:
    notebook = nbformat.read(executed.project.root / "_build/failed/02_small.ipynb", as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert code[1].outputs[0].text == "partial\n"
    assert code[3].outputs[0].ename == "ValueError"
    assert code[4].outputs == []


def test_the_log_of_a_failed_chapter_is_kept(executed: Any) -> None:
    assert "mesh 1: diverged" in (executed.project.root / "_build/failed/02_small.log.txt").read_text()


def test_nothing_is_left_running_or_half_written(executed: Any) -> None:
    assert running_below(executed.project.root) == []
    left = [path.name for path in (executed.project.root / "_build/run").glob(".*") if path.is_dir()]
    assert left == []


def test_a_failure_leaves_the_record_before_it_until_a_run_goes_well(copied: Any) -> None:
    before = copied.record("01")
    good = copied.chapter("01").path.read_text()
    copied.add("01", "raise ValueError('two\\nlines')")
    failed = copied.thesis("run", "01")
    assert failed.returncode == 1
    # the first line of the exception only, and where the rest of the run is to be found
    kept = "(its partial notebook and its log are kept in _build/failed)"
    assert failed.stderr.endswith(f"code cell 1 raised ValueError: two {kept}\n")
    assert copied.record("01") == before
    copied.chapter("01").path.write_text(good)
    listed = copied.thesis("list").stdout
    assert "not current: The last run of chapter 01 failed: code cell 1 raised ValueError: two" in listed

    # from its stored solution the chapter runs again, which is marked and not publishable
    done = copied.thesis("run", "01", "--from-solution", PYTHONPATH=str(copied.root))
    assert done.returncode == 0, done.stderr
    assert not list((copied.root / "_build/failed").glob("01*"))
    record = copied.record("01")
    assert record["run"]["hash"] == before["run"]["hash"]
    assert record["run"]["from_solution"] is True
    assert values(before)["lap_is_stored"] == 0
    assert values(record)["lap_is_stored"] == 1
    assert values(record)["lap_time"] == 4.0
    assert "not current: The run of chapter 01 used stored solutions." in copied.thesis("list").stdout
    refused = copied.thesis("accept", "01", "--new-tolerance", "1e-3", "--reason", "r")
    assert refused.returncode == 2 and "used stored solutions and cannot be accepted" in refused.stderr


# -- what is run, and what is not ---------------------------------------------------------------


def test_a_current_chapter_is_not_run_again(copied: Any) -> None:
    before = (copied.root / "_build/run/01/record.json").stat().st_mtime_ns
    done = copied.thesis("run", "01")
    assert (done.returncode, done.stdout) == (0, "01: is current\n")
    assert (copied.root / "_build/run/01/record.json").stat().st_mtime_ns == before
    assert "      current\n" in copied.thesis("list").stdout


def test_editing_a_file_that_only_a_worker_opened_makes_the_run_stale(copied: Any) -> None:
    (copied.root / "data/vehicles/car.toml").write_text("mass = 661.0\n")
    assert "data file data/vehicles/car.toml has changed" in copied.thesis("list").stdout


def test_a_changed_run_never_touches_the_published_one(copied: Any) -> None:
    published = [
        *(copied.root / "_build/run/01").iterdir(),
        copied.chapter("01").executed,
    ]
    before = {path: path.read_bytes() for path in published}
    done = copied.thesis("run", "1", "mass=3", PYTHONPATH=str(copied.root))
    assert done.returncode == 0, done.stderr
    assert {path: path.read_bytes() for path in published} == before
    (folder,) = [path for path in (copied.root / "_build/changed").iterdir() if path.is_dir()]
    assert folder.name.startswith("01-")
    record = json.loads((folder / "record.json").read_text())
    jsonschema.validate(record, SCHEMA)
    assert values(record)["mass"] == 3.0
    assert (record["run"]["changed"], record["run"]["parameters"]) == (True, {"mass": 3.0})
    notebook = nbformat.read(folder / "01_small.ipynb", as_version=4)
    injected = [cell for cell in notebook.cells if "injected-parameters" in cell.metadata.get("tags", [])]
    assert len(injected) == 1 and "mass = 3.0" in injected[0].source
    assert copied.thesis("run", "01", "mass=3.0").stdout == f"{folder.name}: is current\n"


# -- runs that are interrupted ------------------------------------------------------------------


def test_kernels_that_start_at_once_cannot_take_each_others_ports(project: Any) -> None:
    project.add(
        "01",
        "import json; from ipykernel.connect import get_connection_info",
        "from thesislib.companion import Record; told = json.loads(get_connection_info())",
        "Record('01').value('by_socket', float(told['transport'] == 'ipc'), '')",
    )
    done = project.thesis("run", "01")
    assert done.returncode == 0, done.stderr
    assert project.record("01")["values"]["by_socket"]["value"] == 1.0


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_run_leaves_no_half_record_and_no_process(project: Any, sent: signal.Signals) -> None:
    project.add(
        "01",
        "import logging, time; from thesislib.companion import Record; record = Record('01')",
        "record.value('a', 1.0, ''); logging.getLogger('thesislib').info('mesh 1')",
        "time.sleep(600)",
    )
    command = subprocess.Popen(
        [sys.executable, "-m", "thesislib", "run", "01"],
        cwd=project.root,
        env=project.environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # tests that a script runs in the background ignore an interrupt, and so would what they start
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert command.stdout is not None
    assert any("mesh 1" in line for line in command.stdout)
    command.send_signal(sent)
    _, error = command.communicate(timeout=30)
    wait_until(lambda: running_below(project.root) == [])
    assert not (project.root / "_build/run/01").exists()
    assert not (project.root / "_build/executed").exists()
    if sent is not signal.SIGKILL:
        assert (command.returncode, error) == (130, "thesis: interrupted\n")
        assert not (project.root / "_build/run/.01.unfinished").exists()
        assert not (project.root / "_build/failed").exists(), "an interruption is no failure of the chapter"
