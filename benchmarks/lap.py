"""A cold lap of chapter 4, row C of Table 4.2: CPU time, wall time, memory and the history of meshes.

The process does nothing else, so that its user CPU time and its peak memory are those of the lap, imports
included. Derivatives that were compiled before are taken from the cache; ``--cold-cache`` compiles them anew.
"""

from __future__ import annotations

import logging
import os
import resource
import sys
import tempfile
import time

import reporting

from thesislib import ocp
from thesislib.lap.minimum_time import minimum_lap_time
from thesislib.lap.setups import Setup

# Units of ru_maxrss are kilobytes, on macOS bytes (getrusage(2) of either).
RSS_PER_MB = 1024**2 if sys.platform == "darwin" else 1024


def main() -> None:
    parser = reporting.options(__doc__.partition("\n")[0])
    parser.add_argument("--track", default="barcelona", help="road by name, or its file (barcelona)")
    parser.add_argument("--tolerance", type=float, default=1e-5, help="relative state error (1e-5)")
    parser.add_argument("--interval-m", type=float, default=16.0, help="intervals of the first mesh (16 m)")
    parser.add_argument("--cold-cache", action="store_true", help="compile the derivatives anew")
    options = parser.parse_args()
    logging.basicConfig(format="%(message)s", level=logging.INFO)  # one line per mesh, on stderr
    with tempfile.TemporaryDirectory() as empty:
        if options.cold_cache:
            os.environ["XDG_CACHE_HOME"] = empty
        begun = time.perf_counter()
        setup = Setup(options.track)
        lap = minimum_lap_time(
            setup.road(), setup.car(), tolerance=options.tolerance, interval_m=options.interval_m
        )
        wall = time.perf_counter() - begun
    text = "\n\n".join((report(lap.solution, wall), reporting.surroundings()))
    reporting.publish("lap", f"Lap of {lap.track.name}, cold\n\n{text}", options.keep)


def report(solution: ocp.Solution, wall: float) -> str:
    """Return what the lap has cost, in all and mesh by mesh."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    columns = (
        "mesh",
        "intervals",
        "points",
        "lap time s",
        "error",
        "iterations",
        "CPU s",
        "CPU ms/iteration",
    )
    rows = [
        (
            str(number),
            str(mesh.intervals),
            str(mesh.points),
            f"{mesh.objective:.4f}",
            f"{mesh.error:.1e}",
            str(mesh.iterations),
            f"{mesh.seconds:.1f}",
            f"{1e3 * mesh.seconds / max(mesh.iterations, 1):.0f}",
        )
        for number, mesh in enumerate(solution.history, 1)
    ]
    iterations = sum(mesh.iterations for mesh in solution.history)
    derivatives = "compiled" if solution.compiled else "on the virtual machine"
    totals = "\n".join(
        (
            f"lap time {solution.objective:.4f} s, error estimate {solution.error:.1e}, "
            f"{iterations} iterations, derivatives {derivatives}",
            f"user CPU {used.ru_utime:.1f} s (compiler {children.ru_utime:.1f} s), "
            f"wall {wall:.1f} s from reading the road on, peak memory {used.ru_maxrss / RSS_PER_MB:.0f} MB",
        )
    )
    return "\n\n".join((totals, reporting.table(columns, rows)))


if __name__ == "__main__":
    main()
