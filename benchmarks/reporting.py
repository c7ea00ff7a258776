"""Tables of measurements, with the versions and the kind of machine they were taken on."""

from __future__ import annotations

import argparse
import datetime
import os
import platform
import subprocess
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from thesislib.ocp.compilation import find_compiler

RESULTS = Path(__file__).resolve().parent / "results"


def options(description: str) -> argparse.ArgumentParser:
    """Return the parser of a benchmark's command line, which every benchmark shares."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--keep", action="store_true", help="also write the report into benchmarks/results")
    return parser


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return columns as text, the first to the left and the others to the right."""
    cells = [columns, *rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(columns))]
    lines = []
    for name, *numbers in cells:
        right = [text.rjust(width) for text, width in zip(numbers, widths[1:], strict=True)]
        lines.append("  ".join((name.ljust(widths[0]), *right)).rstrip())
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)


def surroundings() -> str:
    """Say what was measured on: versions, compiler, processor and cores; no name of host or folder."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("thesislib", "casadi", "numpy", "scipy"))
    return "\n".join(
        (
            f"{packages}, Python {platform.python_version()}",
            f"compiler: {_compiler()}",
            f"machine: {_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
            f"load of the machine at the end: {os.getloadavg()[0]:.1f} processes",
        )
    )


def publish(name: str, text: str, keep: bool) -> None:
    """Print a report; with `keep`, also write it under its date into ``benchmarks/results``.

    Parameters
    ----------
    name : str
        Name of the benchmark.
    text : str
        The report.
    keep : bool
        Whether to write it.
    """
    print(text)
    if keep:
        RESULTS.mkdir(exist_ok=True)
        (RESULTS / f"{datetime.date.today()}-{name}.txt").write_text(f"{text}\n", encoding="utf-8")


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown processor"


def _compiler() -> str:
    found = find_compiler()
    if found is None:
        return "none"
    said = subprocess.run([found, "--version"], capture_output=True, text=True, check=False).stdout
    return said.partition("\n")[0] or "of unknown version"
