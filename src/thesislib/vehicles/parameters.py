"""Parameter sets: named numbers with unit, meaning, source and admissible range, read from TOML.

A file has one table per parameter::

    [mass]
    value = 660.0
    unit = "kg"
    symbol = "M"
    description = "Vehicle mass with driver"
    source = "Table C.1"
    range = [400.0, 1200.0]

``printed`` (what stands in the source, where the value differs from it) and ``note`` (why) are optional.
Units are those of the source; everything read from a set is in SI.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from thesislib import provenance

# factor to SI and the SI unit, for every unit of the data files
_SI = {
    **{
        unit: (1.0, unit)
        for unit in ("1", "kg", "m", "s", "N", "W", "J", "V", "rad", "Ω", "m²", "m/s", "m/s²")
    },
    **{unit: (1.0, unit) for unit in ("kg m²", "kg/m³", "N m s/rad", "1/m", "1/m²", "1/rad²")},
    "deg": (math.pi / 180.0, "rad"),
    "mm": (1e-3, "m"),
    "kW": (1e3, "W"),
    "kJ": (1e3, "J"),
    "MJ": (1e6, "J"),
    "%": (1e-2, "1"),
}

_REQUIRED = {"value", "unit", "symbol", "description", "source", "range"}
_OPTIONAL = {"printed", "note"}


@dataclass(frozen=True)
class Parameter:
    """One number of a model.

    Attributes
    ----------
    name : str
        Name in the model's equations.
    value, low, high : float
        Value and inclusive admissible range, SI.
    unit : str
        SI unit of the three; "1" for a pure number.
    symbol, description, source : str
        TeX symbol, meaning, and where the value is printed.
    quoted_unit : str
        Unit of the source.
    printed, note : str
        What stands in the source where the value differs from it, and why; else empty.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    symbol: str
    description: str
    source: str
    quoted_unit: str
    printed: str = ""
    note: str = ""

    def changed(self, value: float) -> Parameter:
        """Return this parameter with another value in SI.

        Raises
        ------
        TypeError
            If ``value`` is not a number.
        ValueError
            If it is not finite or outside the admissible range.
        """
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise TypeError(
                f"{self.name} = {value!r} is not a number; {self.name} is a number in {self.unit}."
            )
        if not self.low <= value <= self.high:  # also refuses nan
            unit = "" if self.unit == "1" else f" {self.unit}"
            raise ValueError(
                f"{self.name} = {value:g}{unit} is outside {self.low:g} .. {self.high:g}{unit} "
                f"({self.description[0].lower()}{self.description[1:]}, {self.source})."
            )
        return replace(self, value=float(value))

    def quoted(self, value: float) -> float:
        """Return a value in SI as the source would quote it, in ``quoted_unit``."""
        factor, _ = _SI[self.quoted_unit]
        return value / factor


@dataclass(frozen=True)
class ParameterSet:
    """Parameters of one model, in the order of their file.

    Attributes
    ----------
    name : str
        Name of the set: the stem of its file.
    parameters : tuple of Parameter
        Its members; no name occurs twice.
    """

    name: str
    parameters: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for parameter in self.parameters:
            if parameter.name in seen:
                raise ValueError(f"{parameter.name} is defined twice in the parameter set {self.name}.")
            seen.add(parameter.name)

    @classmethod
    def from_file(cls, name_or_path: str | Path, folder: str = "vehicles") -> ParameterSet:
        """Read a set from ``data/<folder>/<name>.toml`` or from the path of a TOML file.

        Raises
        ------
        FileNotFoundError
            If there is no such set; the message lists the known ones.
        ValueError
            If an entry lacks a key, has an unknown one, an unknown unit or a value outside its own range.
        """
        path = _location(name_or_path, folder)
        with path.open("rb") as stream:
            try:
                tables = tomllib.load(stream)
            except tomllib.TOMLDecodeError as error:
                raise ValueError(f"{path.name} is not a TOML file: {error}.") from error
        return cls(path.stem, tuple(_parameter(path.name, name, table) for name, table in tables.items()))

    @classmethod
    def union(cls, name: str, sets: Iterable[ParameterSet]) -> ParameterSet:
        """Join several sets under one name.

        Raises
        ------
        ValueError
            If two sets define the same name.
        """
        return cls(name, tuple(parameter for one in sets for parameter in one.parameters))

    @property
    def values(self) -> dict[str, float]:
        """Name to value, SI."""
        return {parameter.name: parameter.value for parameter in self.parameters}

    def __getitem__(self, name: str) -> Parameter:
        """Return one parameter; raises KeyError with the nearest known name."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(unknown_name(name, self.values, self.name))

    def replace(self, **values: float) -> ParameterSet:
        """Return this set with other values, each given in SI.

        Raises
        ------
        KeyError
            If a name is unknown; the message suggests the nearest one.
        TypeError, ValueError
            If a value is not a number or outside its range.
        """
        changed = {name: self[name].changed(value) for name, value in values.items()}
        return ParameterSet(self.name, tuple(changed.get(one.name, one) for one in self.parameters))


def unknown_name(name: str, known: Iterable[str], owner: str) -> str:
    """Return the sentence that refuses an unknown parameter name and suggests the nearest one."""
    names = list(known)
    nearest = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean {nearest[0]}?" if nearest else f"known are {', '.join(names)}."
    return f"{owner} has no parameter {name}; {hint}"


def _location(name_or_path: str | Path, folder: str) -> Path:
    path = Path(name_or_path)
    if path.suffix == ".toml":
        if not path.is_file():
            raise FileNotFoundError(f"There is no parameter file {path}.")
        return path
    home = provenance.project_root() / "data" / folder
    path = home / f"{name_or_path}.toml"
    if not path.is_file():
        known = ", ".join(sorted(one.stem for one in home.glob("*.toml")))
        raise FileNotFoundError(
            f"There is no parameter set {name_or_path} in data/{folder}; known are {known}."
        )
    return path


def _parameter(file: str, name: str, table: Any) -> Parameter:
    where = f"{file}, [{name}]"
    if not isinstance(table, Mapping):
        raise ValueError(f"{where}: a parameter is a table with value, unit and so on, not {table!r}.")
    if missing := _REQUIRED - table.keys():
        raise ValueError(f"{where}: {', '.join(sorted(missing))} missing.")
    if extra := table.keys() - _REQUIRED - _OPTIONAL:
        raise ValueError(f"{where}: unknown key {', '.join(sorted(extra))}.")
    unit = table["unit"]
    if unit not in _SI:
        raise ValueError(f"{where}: unknown unit {unit!r}; known are {', '.join(_SI)}.")
    factor, si_unit = _SI[unit]
    numbers = [table["value"], *table["range"]]
    if len(numbers) != 3 or not all(type(one) in (int, float) and math.isfinite(one) for one in numbers):
        raise ValueError(f"{where}: value and range must be one and two finite numbers, not {numbers}.")
    value, low, high = (float(one) for one in numbers)
    if not low <= value <= high:
        raise ValueError(f"{where}: value {value:g} is outside its own range {low:g} .. {high:g}.")
    return Parameter(
        name=name,
        value=value * factor,
        unit=si_unit,
        low=low * factor,
        high=high * factor,
        symbol=table["symbol"],
        description=table["description"],
        source=table["source"],
        quoted_unit=unit,
        printed=table.get("printed", ""),
        note=table.get("note", ""),
    )
