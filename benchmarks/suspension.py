"""What ride heights cost: by 26 equations, by two unknowns, by a metamodel, and as the thesis solved them.

The front axle is solved on 31 x 31 loads for 11 heave stiffnesses, in one process and in turns. SciPy's
`fsolve` stands for the thesis's own way, one case after the other without derivatives; it gets a part of the
mesh, and its time is counted up.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import reporting
from scipy.optimize import fsolve

from thesislib.suspension import Axle, WheelLoads, surrogate
from thesislib.suspension.mechanism import UNKNOWNS, Mechanism
from thesislib.suspension.reduced import ReducedAxle
from thesislib.suspension.tyre import loaded_radius

CASES_OF_FSOLVE = 100
AGREEMENT = 1e-7  # m: a thousandth of what the metamodels are fitted to


def main() -> None:
    parser = reporting.options(__doc__.partition("\n")[0])
    parser.add_argument("--repetitions", type=int, default=7, help="of which the median counts (7)")
    options = parser.parse_args()
    axle = Axle.from_file("front_axle")
    load = np.linspace(0.0, -6e3, 31)
    K_h = axle.heave_stiffness * np.linspace(0.5, 1.5, 11)
    F_l, F_r, K = (one.ravel() for one in np.meshgrid(load, load, K_h, indexing="ij"))
    loads = WheelLoads.of(F_l, F_r)
    mechanism, reduced = Mechanism(axle), ReducedAxle(axle)
    model = surrogate.fitted(surrogate.sweep(reduced, -6e3, stiffnesses=K_h))
    ways: dict[str, Callable[[], np.ndarray]] = {
        "26 equations": lambda: mechanism.solve(loads, heave_stiffness=K).height,
        "two unknowns": lambda: reduced.solve(loads, heave_stiffness=K).height,
        "metamodel": lambda: model(F_l, F_r, K)[0],
    }
    heights = {way: solve() for way, solve in ways.items()}  # also makes the functions, once
    difference = np.abs(heights["26 equations"] - heights["two unknowns"]).max()
    if not difference < AGREEMENT:
        raise SystemExit(f"26 equations and two unknowns differ by {1e3 * difference:.1e} mm")
    seconds = {way: [] for way in ways}
    for _ in range(options.repetitions):
        for way, solve in ways.items():
            begun = time.process_time()
            solve()
            seconds[way].append(time.process_time() - begun)
    medians = {way: float(np.median(taken)) for way, taken in seconds.items()}
    medians["fsolve, no derivatives"] = by_fsolve(mechanism, F_l, F_r, K)
    slowest = medians["26 equations"]
    rows = [
        (way, f"{taken:.3f}", f"{1e6 * taken / len(F_l):.2f}", f"{taken / slowest:.3g}")
        for way, taken in medians.items()
    ]
    heading = f"Ride heights of {len(F_l)} cases (31 x 31 loads, 11 heave stiffnesses), front axle"
    table = reporting.table(("CPU", "s", "us per case", "over 26 equations"), rows)
    reporting.publish("suspension", "\n\n".join((heading, table, reporting.surroundings())), options.keep)


def by_fsolve(mechanism: Mechanism, F_l: np.ndarray, F_r: np.ndarray, K_h: np.ndarray) -> float:
    """Return the CPU seconds that `fsolve` would take for all cases, from a part of them."""
    axle = mechanism.axle
    chosen = np.random.default_rng(1).choice(len(F_l), CASES_OF_FSOLVE, replace=False)
    begun = time.process_time()
    for i in chosen:
        radii = loaded_radius(F_l[i]), loaded_radius(F_r[i])
        springs = K_h[i], axle.torsion_stiffness, axle.anti_roll_stiffness
        given = np.array([0, 0, F_l[i], 0, 0, F_r[i], *6 * [0], *radii, 0, *springs])

        def residual(x: np.ndarray, given: np.ndarray = given) -> np.ndarray:
            return np.asarray(mechanism.equations(x, given)[0]).ravel()

        _, _, status, message = fsolve(residual, np.zeros(UNKNOWNS), full_output=True)
        if status != 1:
            raise SystemExit(f"fsolve failed: {message}")
    return (time.process_time() - begun) * len(F_l) / len(chosen)


if __name__ == "__main__":
    main()
