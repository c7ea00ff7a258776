"""Write ``data/stability/mid_corner_trims.csv``: the mid-corner trims of chapter 4's accepted laps.

Chapter 7 asks from which disturbances the car of chapter 4 returns in mid-corner, and does not solve the lap
again. The accepted results of chapter 4 hold the trims as a table. Run it again when the laps of chapter 4
have changed::

    .venv/bin/python scripts/mid_corner_trims.py
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from thesislib.stability.racing_trim import MOTION_UNITS, control_unit
from thesislib.vehicles.racing_car import CONTROLS

ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / "data" / "stability" / "mid_corner_trims.csv"
TABLE = "mid-corner-trims"


def write(columns: Mapping[str, Mapping[str, Any]], file: Path = FILE) -> int:
    """Write the columns of the table (name to ``values``) and return the number of rows."""
    units = {"s": "m", **MOTION_UNITS, **{name: control_unit(name) for name in CONTROLS}}
    header = ["lap", "corner", *(f"{name}_{unit}" if unit else name for name, unit in units.items())]
    rows = list(zip(*(columns[name]["values"] for name in ("lap", "corner", *units)), strict=True))
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(
            [lap, int(corner), *(f"{value:.7g}" for value in rest)] for lap, corner, *rest in rows
        )
    return len(rows)


def main() -> None:
    accepted = json.loads((ROOT / "data" / "expected" / "04.json").read_text(encoding="utf-8"))
    if TABLE not in accepted["tables"]:
        raise SystemExit(
            f'The accepted results of chapter 4 have no table "{TABLE}": run and accept it first.'
        )
    print(f"{write(accepted['tables'][TABLE]['columns'])} rows")


if __name__ == "__main__":
    main()
