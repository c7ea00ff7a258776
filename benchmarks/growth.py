"""How an iteration on the lap problem grows with the number of collocation points.

The minimum lap time problem of chapter 4 is put on uniform meshes of intervals of four points, and IPOPT
makes a few iterations from the quasi-steady start. The median of the user CPU times between two iterations
counts: it has no share of the preparations, which are told apart, and none of the iterations that had to
factorise more than once. The exponent is the slope of a straight line through the logarithms.
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import reporting

from thesislib import ocp
from thesislib.lap.setups import Setup
from thesislib.lap.start import quasi_steady_start

POINTS_PER_INTERVAL = 4
ITERATIONS = 12

# Linear, with an allowance for the caches that a large problem does not fit into.
GOAL = 1.1


@dataclass(frozen=True)
class Measurement:
    """Collocation points; CPU seconds of an iteration and of everything before the first."""

    points: int
    iteration: float
    preparation: float


def main() -> None:
    parser = reporting.options(__doc__.partition("\n")[0])
    parser.add_argument(
        "--points",
        type=int,
        nargs="+",
        default=[500, 1000, 2000, 5000, 10_000, 20_000],
        help="collocation points of the meshes (500 to 20000)",
    )
    options = parser.parse_args()
    setup = Setup()
    problem = setup.problem("minimum lap time")
    start = quasi_steady_start(setup.road(), setup.car())
    cost(problem, start, options.points[0])  # code that lies in no cache is compiled here, outside all times
    measurements = [cost(problem, start, points) for points in options.points]
    reporting.publish("growth", "\n\n".join((report(measurements), reporting.surroundings())), options.keep)


def cost(problem: ocp.Problem, start: dict[str, object], points: int) -> Measurement:
    """Measure a mesh of about so many points."""
    mesh = ocp.Mesh.uniform(round(points / POINTS_PER_INTERVAL), POINTS_PER_INTERVAL)
    clock = []

    def note(_: ocp.Progress) -> None:
        clock.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime)

    begun = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    ocp.solve(
        problem,
        start,
        mesh,
        iterations=ITERATIONS,
        meshes=1,
        tolerance=0.9,
        accept_best=True,
        progress=note,
    )
    each = float(np.median(np.diff(clock)))
    print(f"{mesh.points} points: {1e3 * each:.0f} ms/iteration", file=sys.stderr)
    return Measurement(mesh.points, each, clock[0] - begun)


def exponent(points: Sequence[float], seconds: Sequence[float]) -> float:
    """Return the slope of the straight line through the logarithms, by least squares."""
    return float(np.polyfit(np.log(points), np.log(seconds), 1)[0])


def report(measurements: Sequence[Measurement]) -> str:
    """Return the table and the exponent."""
    rows = [
        (
            str(m.points),
            f"{1e3 * m.iteration:.1f}",
            f"{1e6 * m.iteration / m.points:.1f}",
            f"{m.preparation:.2f}",
        )
        for m in measurements
    ]
    table = reporting.table(
        ("points", "CPU ms/iteration", "CPU µs/iteration/point", "preparation CPU s"), rows
    )
    slope = exponent([m.points for m in measurements], [m.iteration for m in measurements])
    verdict = "within" if slope <= GOAL else "above"
    return f"{table}\n\nCPU time of an iteration grows as points^{slope:.3f}, {verdict} the goal of {GOAL}"


if __name__ == "__main__":
    main()
