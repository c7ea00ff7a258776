"""Small throw-away projects: a book, data and a lock in a temporary folder."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pytest

from thesislib.companion import currency
from thesislib.companion.chapters import Chapter, chapter
from thesislib.provenance import Usage, file_hash

FRONT_MATTER = """\
---
jupytext:
  text_representation:
    extension: .md
    format_name: myst
kernelspec:
  display_name: Python 3
  language: python
  name: python3
thesis:
  chapter: "{id}"
  wall_limit_s: {wall_limit_s}
---

# Chapter {id}

Prose.
"""


@dataclass(frozen=True)
class Project:
    """A project in a temporary folder."""

    root: Path

    def add(self, id: str, *cells: str, parameters: str = "", wall_limit_s: float = 120) -> Path:
        """Write a chapter with these code cells."""
        text = FRONT_MATTER.format(id=id, wall_limit_s=wall_limit_s)
        if parameters:
            text += f"\n```{{code-cell}} ipython3\n:tags: [parameters]\n\n{parameters.strip()}\n```\n"
        for cell in cells:
            text += f"\n```{{code-cell}} ipython3\n{cell.strip()}\n```\n\nMore prose.\n"
        path = self.root / "book" / (f"appendix_{id.lower()}.md" if id.isalpha() else f"{id}_small.md")
        path.write_text(text)
        return path

    def chapter(self, id: str) -> Chapter:
        """Return a chapter as it is now."""
        return chapter(id, self.root)

    def record(self, id: str) -> dict[str, Any]:
        """Return the record of a chapter's published run."""
        read: dict[str, Any] = json.loads((self.root / "_build" / "run" / id / "record.json").read_text())
        return read

    def environment(self, **changes: str) -> dict[str, str]:
        """Return the environment of a command in this project."""
        kept = {name: value for name, value in os.environ.items() if not name.startswith("THESIS_")}
        return kept | {"THESIS_ROOT": str(self.root), "THESIS_JOBS": "3"} | changes

    def thesis(self, *arguments: str, **changes: str) -> subprocess.CompletedProcess[str]:
        """Carry out a command line in this project."""
        return subprocess.run(
            [sys.executable, "-m", "thesislib", *arguments],
            cwd=self.root,
            env=self.environment(**changes),
            capture_output=True,
            text=True,
            timeout=180,
        )


def small_project(root: Path) -> Project:
    """Make a project with a lock, some data and no chapter."""
    for folder in ("book", "data/tracks", "data/vehicles", "data/expected", "data/thesis"):
        (root / folder).mkdir(parents=True)
    (root / "environment-pip.txt").write_text("numpy==2.4.6\n")
    (root / "data/tracks/short.csv").write_text("s,curvature\n0,0.0\n1,0.5\n")
    (root / "data/vehicles/car.toml").write_text("mass = 660.0\n")
    (root / "data/vehicles/unused.toml").write_text("mass = 1.0\n")
    (root / "data/thesis/01.json").write_text(
        json.dumps(
            {
                "values": {
                    "mass": {"value": 2.0, "unit": "kg", "half_digit": 0.05, "page": 7, "place": "Table 1.1"},
                    "sine": {
                        "low": -1.0,
                        "high": 1.0,
                        "unit": "",
                        "half_digit": 0.05,
                        "page": 8,
                        "place": "p",
                    },
                }
            }
        )
    )
    return Project(root)


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Project:
    """A project without chapters that this process works in."""
    made = small_project(tmp_path)
    for name in [name for name in os.environ if name.startswith("THESIS_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("THESIS_ROOT", str(made.root))
    return made


@pytest.fixture
def finished() -> Callable[..., None]:
    """Write down a finished, current run of chapter 01 with some content, instead of running it."""

    def write(project: Project, content: dict[str, Any], **changes: Any) -> None:
        project.add("01", "1")
        chapter = project.chapter("01")
        chapter.run_folder.mkdir(parents=True, exist_ok=True)
        chapter.executed.parent.mkdir(parents=True, exist_ok=True)
        chapter.executed.write_text("{}")
        used = Usage(frozenset({"thesislib.provenance"}), frozenset({"data/vehicles/car.toml"}))
        ingredients = currency.ingredients(chapter, used)
        run = {
            "status": "finished",
            "changed": False,
            "from_solution": False,
            "notebook": file_hash(chapter.executed),
            "hash": ingredients.hash,
            **asdict(ingredients),
        }
        record = content | {"run": run | changes, "solves": []}
        (chapter.run_folder / "record.json").write_text(json.dumps(record))

    return write


STUDY_CASES = """
import os
from pathlib import Path

def mass(file):
    text = (Path(os.environ["THESIS_ROOT"]) / "data" / "vehicles" / file).read_text()
    return {"mass": float(text.partition("=")[2])}
"""

GOOD = (
    """
import logging, os, sys, warnings
from pathlib import Path
from thesislib import studies
from thesislib.companion import Record, Series
import study_cases
record = Record("01")
logging.getLogger("thesislib.test").info("mesh 1: 10 intervals")
""",
    """
rows = Path("../data/tracks/short.csv").read_text().splitlines()
case = studies.run({"the car": {"file": "car.toml"}}, study_cases.mass)["the car"]
lap = studies.stored("lap", {"mass": mass}, lambda: {"time": 2.0 * mass})
thesis = Path("../data/thesis/01.json").read_text()
""",
    """
record.value("mass", mass, "kg")
record.value("car_mass", case["mass"], "kg")
record.value("lap_time", lap["time"], "s")
record.value("lap_is_stored", int(lap.stored), "")
record.value("intruders", int("intruder" in globals()), "")
record.figure("1.1", series={"line": Series([0.0, 1.0], [0.0, mass], "m", "kg")})
record.table("1.1", {"rows": (rows, "")})
record.compare(["mass"])
""",
    "print('the folder is', Path.cwd().name); mass",
)


@dataclass(frozen=True)
class Executed:
    """A project after ``thesis run --all``, and what the command said."""

    project: Project
    said: subprocess.CompletedProcess[str]


@pytest.fixture(scope="session")
def executed(tmp_path_factory: pytest.TempPathFactory) -> Executed:
    """Run a book of one good chapter and four that fail, each in its own way; not to be changed."""
    project = small_project(tmp_path_factory.mktemp("executed"))
    (project.root / "study_cases.py").write_text(STUDY_CASES)
    project.add("01", *GOOD, parameters="mass: float = 2.0  # 0 .. 10, mass of the body")
    log = "import logging, math; logging.getLogger('thesislib.test').warning('mesh 1: diverged')"
    project.add("02", "a = 1", "print('partial')", log, "math.sqrt(-a)", "b = 2")
    project.add("03", "import time; time.sleep(600)", wall_limit_s=4)
    project.add("04", "import os", "os._exit(3)")
    project.add("05", "raise SystemExit(0)")
    home = project.root / "home"
    startup = home / ".ipython" / "profile_default" / "startup"
    startup.mkdir(parents=True)
    (startup / "00-intruder.py").write_text("intruder = True\n")
    changes = {"HOME": str(home), "PYTHONPATH": str(project.root), "THESIS_JOBS": "5", "MPLBACKEND": "Agg"}
    return Executed(project, project.thesis("run", "--all", **changes))


@pytest.fixture
def copied(executed: Executed, tmp_path: Path) -> Project:
    """A copy of the executed project, to be changed."""
    root = tmp_path / "copied"
    shutil.copytree(executed.project.root, root)
    return Project(root)
