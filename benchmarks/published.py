"""Eight published problems, solved by this library and by other packages: optimum, mesh and CPU time.

Each solve is a process of its own, ended at a limit of its CPU time, and each package but ours lives in a
virtual environment of its own below ``_build/peers``. The CPU time is the user time of the solve, imports
excluded, and the median of up to three runs: what took long is not run again. Code that is compiled in
other processes is counted apart; our first run compiles, the others find the code in the cache.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import resource
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import reporting
from peers import protocol

from thesislib.classical.benchmarks import results as measured
from thesislib.classical.benchmarks.problems import STATEMENTS

ROOT = Path(__file__).resolve().parents[1]
PEERS = Path(__file__).resolve().parent / "peers"
KEPT = measured.kept_file()

# How a package comes to its mesh; only adaptive ones written in Python are rivals on equal terms.
KINDS = {
    "thesislib": "adaptive",
    "maptor": "adaptive",
    "pycollo": "adaptive",
    "pockit": "adaptive",
    "dymos": "adaptive",
    "yapss": "fixed mesh",
    "ASSET": "compiled",
}
PEER_NAMES = tuple(name for name in KINDS if name != measured.OURS)

# What every package was asked for.
SETTINGS = {
    "mesh_tolerance": protocol.MESH_TOLERANCE,
    "nlp_tolerance": protocol.NLP_TOLERANCE,
    "nlp_iterations": protocol.NLP_ITERATIONS,
    "intervals": protocol.INTERVALS,
    "points": protocol.POINTS,
    "lowest": protocol.LOWEST,
    "highest": protocol.HIGHEST,
    "meshes": protocol.MESHES,
}

# CPU time does not pass in a process that waits: after so many times the limit on the clock it ends, too.
PATIENCE = 5

# SLSQP's matrices are dense: what it has not solved by then takes it many minutes.
SOONER = {"dymos": 30.0}

# A run that took more CPU seconds than this is not repeated.
LONG = 5.0


def main() -> None:
    parser = reporting.options(__doc__.partition("\n")[0])
    known = ", ".join(KINDS)
    parser.add_argument(
        "--packages", nargs="+", default=[measured.OURS], choices=KINDS, metavar="NAME", help=known
    )
    parser.add_argument("--peers", action="store_true", help="all packages but ours")
    parser.add_argument("--problems", nargs="+", default=list(STATEMENTS), choices=STATEMENTS, metavar="NAME")
    parser.add_argument("--repetitions", type=int, default=3, help="of which the median counts (3)")
    parser.add_argument("--limit", type=float, default=90.0, help="CPU seconds of one solve (90)")
    options = parser.parse_args()
    content = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.is_file() else {"packages": {}, "rows": []}
    for package in PEER_NAMES if options.peers else options.packages:
        content = merged(content, measure(package, options))
        if options.keep:  # after each package: a measurement that is interrupted has not been for nothing
            KEPT.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    text = "\n\n".join((table(content), reporting.surroundings()))
    reporting.publish("published", text, options.keep)


def measure(package: str, options: argparse.Namespace) -> dict[str, Any]:
    """Return a package's answers to the problems asked for."""
    python, failure = environment(package)
    limit = min(options.limit, SOONER.get(package, options.limit))
    if python:
        rows = [row(package, name, python, options.repetitions, limit) for name in options.problems]
    else:
        rows = [absent(package, name, failure) for name in options.problems]
    numbers = [{key: row[key] for key in row if key not in ("versions", "python")} for row in rows]
    return {"packages": {package: about(package, rows, limit)}, "rows": numbers}


def environment(package: str) -> tuple[Path | None, str]:
    """Make a package's environment, or find it current; return its Python, or None and what failed."""
    if package == measured.OURS:
        return Path(sys.executable), ""
    requirements = PEERS / "requirements" / f"{package.lower()}.txt"
    folder = ROOT / "_build" / "peers" / package.lower()
    python, installed = folder / "bin" / "python", folder / "installed.txt"
    wanted = requirements.read_text(encoding="utf-8")
    if installed.is_file() and installed.read_text(encoding="utf-8") == wanted:
        return python, ""
    shutil.rmtree(folder, ignore_errors=True)
    print(f"installing {package} in {folder.relative_to(ROOT)}", file=sys.stderr)
    uv = Path(sys.executable).with_name("uv")  # the project's installer, where it was not asked to do without
    installer = [str(uv), "pip", "install", "--python", str(python)]
    if not uv.is_file():
        installer = [str(python), "-m", "pip", "install"]
    for command in (
        [sys.executable, "-m", "venv", str(folder)],
        [*installer, "--quiet", "--no-deps", "--requirement", str(requirements)],
    ):
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode:
            said = (run.stderr.strip() or "the installer failed without a word").splitlines()
            return None, said[-1].strip()[:200]
    installed.write_text(wanted, encoding="utf-8")
    return python, ""


def row(package: str, problem: str, python: Path, repetitions: int, limit: float) -> dict[str, Any]:
    """Return a package's row for a problem, the median of its runs."""
    runs = []
    with tempfile.TemporaryDirectory() as cache:
        for _ in range(repetitions):
            runs.append(solved(package, problem, python, limit, cache))
            print(f"{package}, {problem}: {runs[-1]['status']}", file=sys.stderr)
            if runs[-1]["status"] == "timeout" or (runs[-1]["cpu_seconds"] or LONG) >= LONG:
                break
    last = runs[-1]
    seconds = [run["cpu_seconds"] for run in runs if run["cpu_seconds"] is not None]
    last["cpu_seconds"] = round(statistics.median(seconds), 4) if seconds else None
    last["all_cpu_seconds"] = [round(value, 4) for value in seconds]
    # only the first run finds an empty cache
    last["compiler_seconds"] = round(runs[0]["compiler_seconds"], 4)
    return last


def solved(package: str, problem: str, python: Path, limit: float, cache: str) -> dict[str, Any]:
    """Run an adapter once and return its answer with a status."""
    script = PEERS / f"with_{package.lower()}.py"
    threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
    process = subprocess.Popen(
        [str(python), str(script), problem],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=cache,
        env={**os.environ, **threads, "XDG_CACHE_HOME": cache},
        start_new_session=True,  # so that what the package has started ends with it
    )
    resource.prlimit(process.pid, resource.RLIMIT_CPU, (int(limit), int(limit)))
    try:
        said, complaints = process.communicate(timeout=PATIENCE * limit)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return {**absent(package, problem, f"no answer within {PATIENCE * limit:g} s"), "status": "timeout"}
    if process.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return {**absent(package, problem, f"no answer within {limit:g} CPU s"), "status": "timeout"}
    lines = said.splitlines()
    if process.returncode or not lines:
        last = (complaints.strip().splitlines() or ["without a word"])[-1]
        return {
            **absent(package, problem, f"ended with status {process.returncode}: {last[:150]}"),
            "status": "failed",
        }
    answer = json.loads(lines[-1])
    return {**answer, "status": "solved" if answer.pop("converged") else "failed"}


def absent(package: str, problem: str, reason: str) -> dict[str, Any]:
    """Return the row of a package that did not come to an answer."""
    numbers = ("objective", "points", "intervals", "meshes", "error", "cpu_seconds")
    return {
        "package": package,
        "problem": problem,
        "status": "not installed",
        "reason": reason,
        **dict.fromkeys(numbers),
        "compiler_seconds": 0.0,
        "all_cpu_seconds": [],
    }


def about(package: str, rows: list[dict[str, Any]], limit: float) -> dict[str, Any]:
    """Return what a package was measured with."""
    answered = next((row for row in rows if "versions" in row), {})
    return {
        "kind": KINDS[package],
        "versions": answered.get("versions", {}),
        "python": answered.get("python", ""),
        "date": datetime.date.today().isoformat(),
        "cpu_limit_s": limit,
        "surroundings": reporting.surroundings().splitlines()[1:],
    }


def merged(kept: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Return what is kept already with the new rows in the place of the old ones."""
    replaced = {(row["package"], row["problem"]) for row in new["rows"]}
    rows = [row for row in kept["rows"] if (row["package"], row["problem"]) not in replaced]
    packages = {**kept["packages"], **new["packages"]}
    return {
        "schema": measured.SCHEMA,
        "settings": SETTINGS,
        "packages": {name: packages[name] for name in KINDS if name in packages},
        "rows": rows + new["rows"],
    }


def table(content: dict[str, Any]) -> str:
    """Return the results as text, with the reason below for every package that did not answer."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "published.json"
        path.write_text(json.dumps(content), encoding="utf-8")
        found = measured.read(path)
    columns = found.columns()
    cells = [[str(cell) for cell in row] for row in zip(*columns.values(), strict=True)]
    reasons = [f"{row.package}, {row.problem}: {row.reason}" for row in found.rows if row.reason]
    versions = [
        f"{name}: {', '.join(f'{k} {v}' for k, v in entry['versions'].items())} ({entry['date']})"
        for name, entry in found.packages.items()
        if entry["versions"]
    ]
    return "\n".join((reporting.table(list(columns), cells), "", *reasons, "", *versions))


if __name__ == "__main__":
    main()
