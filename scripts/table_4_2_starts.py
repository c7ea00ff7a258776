"""Solve every row of Table 4.2 from two more starts and keep what came of it (`make study-table-4-2`).

Chapter 4 shows the result, stamped with its day. The rows as the page solves them are solved first, or found
where the page has left them::

    .venv/bin/python scripts/table_4_2_starts.py [--tolerance 1e-4]
"""

from __future__ import annotations

import argparse
import logging
from pathlib import Path

from thesislib import provenance
from thesislib.lap import starts
from thesislib.lap.continuation import TOLERANCE, solve_rows
from thesislib.lap.rows import rows
from thesislib.lap.setups import Setup, Start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of a row's states (1e-4)")
    parser.add_argument("--interval-m", type=float, default=16.0, help="of a cold solve's first mesh (16)")
    options = parser.parse_args()
    logging.basicConfig(format="%(message)s", level=logging.INFO)
    root = provenance.project_root()
    folder = root / "_build" / "studies" / "table_4_2"
    folder.mkdir(parents=True, exist_ok=True)
    # with the numbers that are parameters of chapter 4 written down as the page does, so that either finds
    # the rows that the other has solved
    values = {name: Setup().car().values[name] for name in ("mass", "P_max", "frontal_area", "a")}
    setup = Setup(values=values)
    base = Start(setup, 1e-5, options.interval_m, str(folder / "base.npz"))
    base.solve("row C")
    solved = solve_rows(rows(setup), base, Path(folder), tolerance=options.tolerance)
    path = starts.write(starts.study(solved, options.interval_m), root)
    stored = starts.StoredStudy.read(root)
    for letter in stored.rows:
        times = ", ".join(f"{start} {time:.4f}" for start, time in stored.lap_times(letter).items())
        print(f"{letter}: {times}")
    print(f"kept in {path.relative_to(root)}")


if __name__ == "__main__":
    main()
