"""Reading a centre line from its table, and refusing a table that cannot be one.

The format is a CSV file: lines ``# key: value`` with at least ``period_m``, ``source`` and ``licence``, one
line of column names, then one row per station. Required columns: ``s_m``, ``curvature_1pm``, ``w_right_m``,
``w_left_m``, ``x_m``, ``y_m``, ``theta_rad``.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thesislib import provenance
from thesislib.roads.centreline import CentreLine

COLUMNS = ("s_m", "curvature_1pm", "w_right_m", "w_left_m", "x_m", "y_m", "theta_rad")
REQUIRED_KEYS = ("period_m", "source", "licence")

# What the table may miss by. A centimetre is well above the rounding of the columns (1 mm, 1e-6 rad) and well
# below anything a lap time notices; the angle is a centimetre over a hundred metres.
POSITION_TOLERANCE_M = 0.01
HEADING_TOLERANCE_RAD = 1e-4


class RoadFileError(ValueError):
    """A road table is refused; the message names file, row and reason."""


@dataclass(frozen=True)
class _Table:
    """The contents of a file, parsed and not yet judged."""

    file: str
    keys: dict[str, str]
    columns: dict[str, NDArray[np.float64]]
    rows: list[int]  # line number in the file of every station

    def refuse(self, station: int, reason: str) -> RoadFileError:
        return RoadFileError(f"{self.file}, row {self.rows[station]}: {reason}.")


def names() -> tuple[str, ...]:
    """Return the names of the roads in ``data/tracks``."""
    return tuple(sorted(path.stem for path in _home().glob("*.csv")))


def load(name_or_path: str | Path) -> CentreLine:
    """Read a road by its name in ``data/tracks`` or from the path of a CSV file.

    Parameters
    ----------
    name_or_path : str or Path
        For example ``"barcelona"`` or ``Path("my_road.csv")``.

    Raises
    ------
    FileNotFoundError
        If there is no such road; the message lists the known ones.
    RoadFileError
        If the table lacks a key or column, holds anything but finite numbers, its stations do not
        increase, or its curvature disagrees by more than 1 cm with closure or with its own x, y, theta.
    """
    path = Path(name_or_path)
    if path.suffix != ".csv":
        path = _home() / f"{name_or_path}.csv"
        if not path.is_file():
            raise FileNotFoundError(f"There is no road {name_or_path}; known are {', '.join(names())}.")
    elif not path.is_file():
        raise FileNotFoundError(f"There is no road file {path}.")
    table = _table(path)
    length = _period(table)
    _refuse_bad_stations(table, length)
    columns = table.columns
    road = CentreLine(
        name=table.keys.get("name", path.stem),
        s=columns["s_m"],
        station_curvature=columns["curvature_1pm"],
        length=length,
        start=(float(columns["x_m"][0]), float(columns["y_m"][0]), float(columns["theta_rad"][0])),
        station_width_right=columns["w_right_m"],
        station_width_left=columns["w_left_m"],
        attributes=table.keys,
    )
    _refuse_inconsistent(table, road)
    return road


def _home() -> Path:
    return provenance.project_root() / "data" / "tracks"


def _table(path: Path) -> _Table:
    keys: dict[str, str] = {}
    header: list[str] | None = None
    values: list[list[float]] = []
    rows: list[int] = []
    with path.open(encoding="utf-8", newline="") as stream:
        for row, line in enumerate(stream, start=1):
            text = line.strip()
            if not text:
                continue
            if text.startswith("#"):
                key, _, value = text[1:].partition(":")
                keys[key.strip()] = value.strip()
                continue
            cells = [cell.strip() for cell in next(csv.reader([text]))]
            if header is None:
                header = cells
                if missing := [name for name in COLUMNS if name not in header]:
                    raise RoadFileError(f"{path.name}, row {row}: missing column {', '.join(missing)}.")
                continue
            values.append(_numbers(path.name, row, header, cells))
            rows.append(row)
    if header is None or len(values) < 4:
        raise RoadFileError(f"{path.name}, last row: {len(values)} stations; a periodic spline needs four.")
    array = np.array(values)
    columns = {name: array[:, header.index(name)] for name in COLUMNS}
    return _Table(path.name, keys, columns, rows)


def _numbers(file: str, row: int, header: list[str], cells: list[str]) -> list[float]:
    if len(cells) != len(header):
        raise RoadFileError(f"{file}, row {row}: {len(cells)} values under {len(header)} columns.")
    numbers = []
    for name, cell in zip(header, cells, strict=True):
        try:
            number = float(cell)
        except ValueError as error:
            raise RoadFileError(f"{file}, row {row}: {name} = {cell!r} is not a number.") from error
        if not math.isfinite(number):
            raise RoadFileError(f"{file}, row {row}: {name} = {cell} is not finite.")
        numbers.append(number)
    return numbers


def _period(table: _Table) -> float:
    for key in REQUIRED_KEYS:
        if not table.keys.get(key):
            raise RoadFileError(f"{table.file}, head: the line '# {key}: …' is missing.")
    text = table.keys["period_m"]
    try:
        period = float(text)
    except ValueError as error:
        raise RoadFileError(f"{table.file}, head: period_m = {text!r} is not a number.") from error
    if not 0.0 < period < math.inf:
        raise RoadFileError(f"{table.file}, head: period_m = {text} is not a positive length.")
    return period


def _refuse_bad_stations(table: _Table, period: float) -> None:
    s = table.columns["s_m"]
    if s[0] != 0.0:
        raise table.refuse(0, f"s_m starts at {s[0]:g}, not at 0")
    not_increasing = np.flatnonzero(np.diff(s) <= 0.0)
    if not_increasing.size:
        station = int(not_increasing[0]) + 1
        raise table.refuse(station, f"s_m = {s[station]:g} does not exceed the {s[station - 1]:g} before it")
    if s[-1] >= period:
        raise table.refuse(
            len(s) - 1,
            f"s_m = {s[-1]:g} is not below period_m = {period:g}; the first station is not repeated",
        )
    for name in ("w_right_m", "w_left_m"):
        not_positive = np.flatnonzero(table.columns[name] <= 0.0)
        if not_positive.size:
            station = int(not_positive[0])
            raise table.refuse(station, f"{name} = {table.columns[name][station]:g} is not a positive width")


def _refuse_inconsistent(table: _Table, road: CentreLine) -> None:
    """Compare the integral of the curvature with closure and with the columns x, y, theta."""
    x, y = road.position(road.s)
    miss = np.hypot(x - table.columns["x_m"], y - table.columns["y_m"])
    turn = np.abs(road.heading(road.s) - table.columns["theta_rad"])
    off = np.flatnonzero((miss > POSITION_TOLERANCE_M) | (turn > HEADING_TOLERANCE_RAD))
    if off.size:
        station = int(off[0])
        raise table.refuse(
            station,
            f"the integrated curvature is {miss[station]:.3g} m and {turn[station]:.3g} rad away from "
            f"x_m, y_m, theta_rad; {POSITION_TOLERANCE_M:g} m and {HEADING_TOLERANCE_RAD:g} rad are allowed",
        )
    closure = road.closure()
    far = closure.distance > POSITION_TOLERANCE_M or abs(closure.heading) > HEADING_TOLERANCE_RAD
    if far or closure.turns == 0:
        raise table.refuse(
            len(road.s) - 1,
            f"with period_m = {road.length:g} the lap ends {closure.distance:.3g} m and "
            f"{closure.heading:.3g} rad from its start after {closure.turns} turns; "
            f"{POSITION_TOLERANCE_M:g} m and {HEADING_TOLERANCE_RAD:g} rad are allowed",
        )
