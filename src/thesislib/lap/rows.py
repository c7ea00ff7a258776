"""The rows of Table 4.2: what each optimises, and from which row its solve begins.

Every row has optima some hundredths of a second away from its best, into which a cold solve may fall. A row
therefore starts from a row that differs from it by little: the adjustments come one after another, and its
parent's lap is a lap that it could drive.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import cast

from thesislib.lap.adjustments import (
    AXLES,
    BALANCE,
    CONTINUOUS_BALANCE,
    MapRanges,
    bounds_of,
    parameters,
)
from thesislib.lap.setups import Setup, Suspension

HEIGHTS = ("dh_f", "dh_r")
STIFFNESSES = ("dK_h_front", "dK_h_rear")
SIDE_SLIP = tuple(f"dC_L_{axle}_beta2" for axle in AXLES)
STEER = tuple(f"dC_L_{axle}_delta2" for axle in AXLES)
ROLL = tuple(f"dC_L_{axle}_phi2" for axle in AXLES)
ANGULAR = (*SIDE_SLIP, *STEER, *ROLL)

PRINTED_RANGE = MapRanges(beta=4.0 * math.pi / 45.0)
"""The water-bed constraint with the printed β_max of 16°."""


@dataclass(frozen=True)
class Row:
    """One lap of Table 4.2, or of a variant of it.

    Attributes
    ----------
    name : str
        Letter of the table, with what is otherwise: ``"F"``, ``"F raw"``.
    what : str
        What it optimises, in a few words.
    setup : Setup
        What is solved.
    parent : str
        Name of the row from whose lap the solve begins.
    reference : str
        Name of the row that its lap time is compared with: row (C) with the same suspension.
    steps : tuple of mappings
        Adjustments that are held, one after another, on the way from the parent to the row, SI: several short
        ways take fewer iterations than a long one.
    """

    name: str
    what: str
    setup: Setup
    parent: str
    reference: str = "C"
    steps: tuple[Mapping[str, float], ...] = ()

    @property
    def letter(self) -> str:
        """Letter of Table 4.2."""
        return self.name[0]


BASE = "base lap"
"""Name of the lap from which row (C) starts: the same problem, solved to a smaller error."""

RECONCILED = "C reconciled"
"""Name of row (C) with the reconciled suspension."""

# letter: what, adjustments, suspension, parent
BALANCE_STEPS = (0.05, 0.10, 0.15)
"""Balances through which rows (M) and (P) are reached: fewer iterations than in one step."""

_TABLE: dict[str, tuple[str, tuple[str, ...], Suspension, str]] = {
    "A": ("rigid, no sensitivities", (), "table_3_1", "B"),
    "B": ("rigid", (), "table_3_1", "C"),
    "D": ("ride heights", HEIGHTS, "table_3_1", "C"),
    "E": ("heave stiffness", STIFFNESSES, "reconciled", RECONCILED),
    "F": ("heave stiffness, heights", (*STIFFNESSES, *HEIGHTS), "reconciled", "D"),
    "G": ("side-slip sensitivity", SIDE_SLIP, "table_3_1", "C"),
    "H": ("steer sensitivity", STEER, "table_3_1", "C"),
    "I": ("roll sensitivity", ROLL, "table_3_1", "C"),
    "J": ("all sensitivities", ANGULAR, "table_3_1", "G"),
    "K": ("sensitivities, heights", (*ANGULAR, *HEIGHTS), "table_3_1", "D"),
    "L": (
        "sensitivities, heights, stiffness",
        (*ANGULAR, *HEIGHTS, *STIFFNESSES),
        "reconciled",
        "K",
    ),
    "M": ("balance", (BALANCE,), "table_3_1", "C"),
    "N": ("balance, heights", (BALANCE, *HEIGHTS), "table_3_1", "M"),
    "O": ("balance, sensitivities", (BALANCE, *ANGULAR), "table_3_1", "M"),
    "P": (
        "all of these",
        (*ANGULAR, *HEIGHTS, *STIFFNESSES, BALANCE),
        "reconciled",
        "L",
    ),
    "Q": ("balance along the lap", (), "table_3_1", "C"),
}

RAW = ("C", "D", "E", "F", "L", "P")
"""Rows that are also solved with Table 3.2 as it is printed."""

LETTERS = tuple("ABCDEFGHIJKLMNOPQ")


def raw(letter: str) -> str:
    """Return the name of a row with the constants of Table 3.2 as printed."""
    return f"{letter} raw"


def printed_range(letter: str) -> str:
    """Return the name of a row with the printed range of side slip in (4.30)."""
    return f"{letter} 16°"


def rows(base: Setup) -> dict[str, Row]:
    """Return the rows of Table 4.2 and their variants, by name; parents stand before children.

    Parameters
    ----------
    base : Setup
        Of row (C).
    """
    found = [
        Row("C", "baseline", base, BASE),
        Row(RECONCILED, "baseline, reconciled", replace(base, metamodel="reconciled"), "C"),
    ]
    for letter, (what, names, suspension, parent) in _TABLE.items():
        reference = "C" if suspension == "table_3_1" else RECONCILED
        setup = replace(base, metamodel=suspension, free=bounds_of(names))
        found.append(Row(letter, what, setup, parent, reference))
    by_name = {row.name: row for row in found}
    rigid = replace(base.readings, suspension="rigid")
    for letter, readings in (("A", replace(rigid, aero_angles=False)), ("B", rigid)):
        by_name[letter] = replace(by_name[letter], setup=replace(base, readings=readings))
    for letter in "MP":
        steps = tuple({BALANCE: value} for value in BALANCE_STEPS)
        by_name[letter] = replace(by_name[letter], steps=steps)
    by_name["Q"] = replace(by_name["Q"], setup=replace(base, continuous_balance=1.0))
    for letter in RAW:
        row = by_name[RECONCILED if letter == "C" else letter]
        setup = replace(row.setup, metamodel="table_3_2")
        by_name[raw(letter)] = Row(raw(letter), row.what, setup, row.name, raw("C"))
    for letter, parent in (("G", "G"), ("J", printed_range("G"))):
        row = by_name[letter]
        wide = replace(row.setup, ranges=PRINTED_RANGE)
        by_name[printed_range(letter)] = Row(printed_range(letter), row.what, wide, parent)
    return _in_order(by_name)


def own_row(
    row: Row,
    bounds: Mapping[str, float],
    *,
    metamodel: str = "as_the_row",
    beta_max: float | None = None,
) -> Row:
    """Return a row of Table 4.2 with other bounds; it starts from the row's own lap.

    Parameters
    ----------
    row : Row
        The row.
    bounds : mapping of str to float
        Largest size of each adjustment and of `CONTINUOUS_BALANCE`, SI; what the row does not adjust is not
        read.
    metamodel : {"as_the_row", "table_3_1", "table_3_2", "reconciled"}
        Suspension.
    beta_max : float, optional
        Range of side slip in (4.30), rad; by default the row's.

    Returns
    -------
    Row

    Raises
    ------
    KeyError
        If an adjustment of the row has no bound.
    ValueError
        If the row adjusts what this suspension does not have, or a value is out of range.
    """
    setup = row.setup
    free = {}
    for name in setup.free:
        if name not in bounds:
            raise KeyError(f"row {row.name} adjusts {name}, for which no bound is given.")
        free[name] = (-bounds[name], bounds[name])
    ranges = setup.ranges if beta_max is None else replace(setup.ranges, beta=beta_max)
    own = replace(setup, free=free, ranges=ranges)
    if setup.continuous_balance:
        own = replace(own, continuous_balance=bounds[CONTINUOUS_BALANCE])
    if metamodel != "as_the_row":
        own = replace(own, metamodel=cast(Suspension, metamodel))  # the set-up refuses others
    parameters(own.free, own.car().values)  # refuses what this suspension does not have
    reference = {"table_3_1": "C", "table_3_2": raw("C"), "reconciled": RECONCILED}[own.metamodel]
    return Row(f"{row.letter} with own bounds", row.what, own, row.name, reference)


def waves(rows: Mapping[str, Row], done: Iterable[str] = (BASE,)) -> list[list[Row]]:
    """Return rows in waves: each row's parent is `done` or in an earlier wave.

    Raises
    ------
    KeyError
        If a parent is neither.
    """
    left, known, found = dict(rows), set(done), []
    while left:
        ready = [row for row in left.values() if row.parent in known]
        if not ready:
            names = ", ".join(f"{row.name} from {row.parent}" for row in left.values())
            raise KeyError(f"rows without a start: {names}")
        known |= {row.name for row in ready}
        left = {name: row for name, row in left.items() if row not in ready}
        found.append(ready)
    return found


def links(rows: Mapping[str, Row]) -> dict[str, int]:
    """Return the number of rows in the longest chain that begins with each row.

    Raises
    ------
    KeyError
        As `waves`.
    """
    found: dict[str, int] = {}
    for row in (row for wave in reversed(waves(rows)) for row in wave):
        found[row.name] = 1 + max(
            (found[child.name] for child in rows.values() if child.parent == row.name), default=0
        )
    return found


def _in_order(rows: Mapping[str, Row]) -> dict[str, Row]:
    return {row.name: row for wave in waves(rows) for row in wave}
