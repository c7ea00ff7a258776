"""Write ``data/suspension/lap_loads.csv``: the normal tyre loads of chapter 4's accepted lap.

Chapter 3 shakes the suspension with the loads of a lap, and is run before chapter 4 exists. The accepted
results of chapter 4 hold ride heights and roll angle along the lap; Table 3.1, which made them from the
loads, gives the loads back. Run it again when the lap of chapter 4 has changed::

    .venv/bin/python scripts/lap_loads.py
"""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np

from thesislib.suspension import AxleMetamodel, Metamodel

ROOT = Path(__file__).resolve().parents[1]


def loads_for(
    metamodel: AxleMetamodel, height: np.ndarray, roll: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the loads (N) with the given ride heights (m) and roll angles (rad), by Newton's method."""
    F = np.full((2, len(height)), -3000.0)
    step = 1.0  # N: the polynomials are quadratic, so that central differences are exact
    for _ in range(20):
        misses = np.stack(metamodel(*F)) - np.stack((height, roll))
        columns = [
            (np.stack(metamodel(*(F + change))) - np.stack(metamodel(*(F - change)))) / (2 * step)
            for change in step * np.eye(2)[:, :, None]
        ]
        change = np.linalg.solve(np.stack(columns, axis=1).transpose(2, 0, 1), misses.T[:, :, None])[
            :, :, 0
        ].T
        F -= change
        if np.abs(change).max() < 1e-6:
            return F[0], F[1]
    raise SystemExit("no loads belong to the ride heights of chapter 4")


def main() -> None:
    accepted = json.loads((ROOT / "data" / "expected" / "04.json").read_text(encoding="utf-8"))
    series = {
        name: accepted["figures"][figure]["series"][key]
        for name, figure, key in (
            ("x", "4.6", "x"),
            ("y", "4.6", "y"),
            ("speed", "4.7", "speed"),
            ("h_f", "4.9", "front"),
            ("h_r", "4.9", "rear"),
            ("phi", "4.10", "front"),
        )
    }
    s = np.array(series["speed"]["abscissa"])
    period = series["speed"]["period"]
    along = {
        name: np.interp(s, one["abscissa"], one["ordinate"], period=period) for name, one in series.items()
    }
    # the mass centre's own path, closed: the centre line is longer or shorter than it by a few metres
    steps = np.hypot(*(np.diff(along[axis], append=along[axis][0]) for axis in ("x", "y")))
    mean_speed = 0.5 * (along["speed"] + np.roll(along["speed"], -1)) / 3.6
    t = np.concatenate(([0.0], np.cumsum(steps / mean_speed)))
    table = Metamodel.from_file()
    phi = np.radians(along["phi"])
    front = loads_for(table.front, 1e-3 * along["h_f"], phi)
    rear = loads_for(table.rear, 1e-3 * along["h_r"], phi)
    rows = [*zip(t[:-1], *front, *rear, strict=True), (t[-1], *(load[0] for load in (*front, *rear)))]
    with (ROOT / "data" / "suspension" / "lap_loads.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("t_s", "F_flz_N", "F_frz_N", "F_rlz_N", "F_rrz_N"))
        writer.writerows(
            [f"{time:.4f}", *(f"{min(load, 0.0):.1f}" for load in loads)] for time, *loads in rows
        )
    scale = t[-1] / accepted["values"]["lap_time"]["value"]
    print(f"{len(rows)} rows; time along the stored path is {scale:.4f} of the lap time")


if __name__ == "__main__":
    main()
