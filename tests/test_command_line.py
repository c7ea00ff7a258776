"""The command ``thesis``: what it refuses, before what, and with which exit status."""

import json
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from thesislib.__main__ import main

CHAPTER = """\
---
kernelspec: {{name: python3, display_name: Python 3}}
thesis: {{chapter: "{id}"}}
---

# A lap

```{{code-cell}} ipython3
:tags: [parameters]

mass_kg: float = 660.0  # 400 .. 1200, vehicle mass
track: str = "barcelona"  # {{barcelona | monza}}, centre line
refine: bool = True  # whether the mesh is refined
```
"""

HEAVY = ("casadi", "cvxpy", "matplotlib", "pandas", "jupytext", "papermill", "jupyter_client", "numpy")


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "book").mkdir()
    (tmp_path / "environment-pip.txt").write_text("")
    (tmp_path / "book/04_lap.md").write_text(CHAPTER.format(id="04"))
    (tmp_path / "book/appendix_b.md").write_text(CHAPTER.format(id="B"))
    for name in ("THESIS_JOBS", "THESIS_SLOTS", "THESIS_SCHEDULER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("THESIS_ROOT", str(tmp_path))
    return tmp_path


REFUSED = [
    (["run", "04", "MASS_KG=700"], "Chapter 04 has no parameter 'MASS_KG'; did you mean 'mass_kg'?"),
    (["run", "04", "mas_kg=700"], "Chapter 04 has no parameter 'mas_kg'; did you mean 'mass_kg'?"),
    (["run", "04", "mass_kg=heavy"], "mass_kg must be a float, not 'heavy' (vehicle mass)."),
    (["run", "04", "mass_kg=99"], "mass_kg = 99 is outside 400 .. 1200 (vehicle mass)."),
    (["run", "04", "mass_kg=nan"], "mass_kg = nan is not a finite number (vehicle mass)."),
    (["run", "04", "track=monsa"], "track = monsa is not one of {barcelona | monza} (centre line)"),
    (["run", "04", "refine=yes"], "refine must be a bool (true or false), not 'yes'."),
    (["run", "04", "refine=true", "refine=false"], "refine is given twice: 'true' and 'false'."),
    (["run", "05"], "There is no chapter '05' (known: 04, B); did you mean '04'?"),
    (["run", "04", "B", "mass_kg=700"], "Parameters (mass_kg) can be changed for one chapter at a time."),
    (["run", "--all", "mass_kg=700"], "Parameters (mass_kg) can be changed for one chapter at a time."),
    (["run"], "Say either which chapters to run or --all."),
    (["run", "04", "--all"], "Say either which chapters to run or --all."),
    (["check", "5"], "There is no chapter '5' (known: 04, B)"),
    (["accept", "9"], "There is no chapter '9' (known: 04, B)"),
    (["accept", "04"], "Chapter 04 has not been run; there is nothing to accept."),
    (["accept", "04", "--tolerance", "values/a"], "A tolerance is written QUANTITY=ABSOLUTE or"),
    (["accept", "04", "--tolerance", "values/a=x"], "The tolerance 'x' of values/a is not ABSOLUTE or"),
]


@pytest.mark.parametrize(("arguments", "said"), REFUSED)
def test_refused_input_is_one_sentence_and_exit_status_2(
    root: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith(f"thesis: {said}")
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert not (root / "_build").exists(), "nothing was started"


@pytest.mark.parametrize("arguments", [[], ["fly"], ["run", "--fast"], ["accept"], ["list", "04"]])
def test_a_malformed_command_line_is_exit_status_2(root: Path, arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as info:
        main(arguments)
    assert info.value.code == 2


def test_a_wrong_number_of_jobs_is_refused(
    root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("THESIS_JOBS", "many")
    assert main(["run", "04"]) == 2
    assert capsys.readouterr().err == "thesis: THESIS_JOBS = 'many' is not a whole number from 1 to 1024.\n"


def test_a_cluster_that_cannot_be_used_is_refused_before_anything_starts(
    root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("thesislib.studies.cluster._CONNECT_S", 0.5)
    for said, sentence in (
        ("localhost", "THESIS_SCHEDULER = 'localhost' is no address of a Dask scheduler"),
        ("tcp://127.0.0.1:1", "No Dask scheduler answers at tcp://127.0.0.1:1"),
    ):
        monkeypatch.setenv("THESIS_SCHEDULER", said)
        assert main(["run", "04"]) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"thesis: {sentence}") and error.count("\n") == 1
    assert not (root / "_build").exists(), "nothing was started"


def test_a_folder_that_is_no_project_is_refused(
    root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("THESIS_ROOT", str(root / "book"))
    assert main(["list"]) == 2
    assert "is not a project: it has no folder book/" in capsys.readouterr().err


def test_a_chapter_whose_own_default_is_not_allowed_is_not_run(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = root / "book/04_lap.md"
    path.write_text(path.read_text().replace("660.0", "66.0"))
    for arguments in (["run", "04"], ["run", "--all"], ["run", "04", "refine=false"]):
        assert main(arguments) == 2
        assert "mass_kg = 66 is outside 400 .. 1200" in capsys.readouterr().err


def loaded_after(root: Path, arguments: list[str]) -> tuple[int, set[str]]:
    """Return the exit status of a command and the heavy modules that it has imported."""
    script = textwrap.dedent(
        """
        import json, sys
        from thesislib.__main__ import main
        status = main(json.loads(sys.argv[1]))
        print(json.dumps([status, sorted({name.partition(".")[0] for name in sys.modules})]))
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", script, json.dumps(arguments)], capture_output=True, text=True, check=True
    )
    status, modules = json.loads(done.stdout.splitlines()[-1])
    return status, set(HEAVY) & set(modules)


@pytest.mark.parametrize(
    "arguments", [["run", "04", "mas_kg=700"], ["run", "04", "mass_kg=heavy"], ["run", "04", "mass_kg=9"]]
)
def test_a_parameter_is_refused_before_anything_heavy_is_imported(root: Path, arguments: list[str]) -> None:
    assert loaded_after(root, arguments) == (2, set())


def test_listing_imports_nothing_heavy(root: Path) -> None:
    assert loaded_after(root, ["list"]) == (0, set())


def test_the_list_shows_chapters_parameters_and_the_state_of_their_runs(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:6] == [
        "04  A lap  (book/04_lap.md)",
        "      mass_kg = 660.0  400 .. 1200  vehicle mass",
        "      track = barcelona  {barcelona | monza}  centre line",
        "      refine = True  {true | false}  whether the mesh is refined",
        "      no run",
        "      not current: Chapter 04 has not been run.",
    ]
    assert lines[6].startswith("B  ")


def test_a_check_that_misses_is_exit_status_1_with_a_line_for_each_chapter(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "04 chapter 04 has not been run",
        "B chapter B has not been run",
    ]


def test_a_record_that_is_no_json_is_a_miss_and_no_traceback(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (root / "_build/run/04").mkdir(parents=True)
    (root / "_build/run/04/record.json").write_text("{")
    assert main(["check", "04"]) == 1
    assert "record.json is not JSON" in capsys.readouterr().out
    assert main(["accept", "04"]) == 2
    assert "record.json is not JSON" in capsys.readouterr().err
    assert main(["list"]) == 0
    assert "The record of chapter 04 cannot be read" in capsys.readouterr().out


def test_a_site_that_is_not_built_is_exit_status_1(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (root / "_toc.yml").write_text("format: jb-book\nroot: 04_lap\nchapters: [{file: appendix_b}]\n")
    assert main(["site"]) == 1
    assert "Chapter 04 has not been run" in capsys.readouterr().err


def test_a_reader_who_has_seen_enough_ends_a_listing_in_silence(root: Path) -> None:
    # the pipe is closed before anything is written to it
    command = f"{sys.executable} -c 'import sys; from thesislib.__main__ import main; sys.exit(main())' list"
    script = f"set -o pipefail; {{ sleep 1; {command}; }} | true"
    done = subprocess.run(["bash", "-c", script], cwd=root, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
