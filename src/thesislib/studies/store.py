"""Solutions kept on disk: numbers and texts as JSON, arrays as npz, nothing pickled.

The key of a solution is made of its name and inputs and of everything it may depend on: the package's
sources (but for those that only draw), the data files and the locked environment. A change of any of
them makes another key, so a solution that is found is the one that would be computed.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import logging
import os
import re
import time
import zipfile
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from thesislib import provenance

__all__ = ["Result", "canonical", "entry", "load", "save", "stored"]

Value = bool | int | float | str | np.ndarray

_SCHEMA = 1
_log = logging.getLogger(__name__)


class Result(dict[str, Value]):
    """A solution's numbers, texts and arrays by name.

    Attributes
    ----------
    stored : bool
        Whether the solution was read rather than computed.
    seconds : float
        Time it took to compute, s.
    """

    def __init__(self, values: Mapping[str, Value], *, stored: bool, seconds: float) -> None:
        super().__init__(values)
        self.stored = stored
        self.seconds = seconds


def folder() -> Path:
    """Return the folder of the stored solutions: ``THESIS_STORE``, or ``_build/solutions``."""
    named = os.environ.get("THESIS_STORE")
    return Path(named) if named else provenance.project_root() / "_build" / "solutions"


def canonical(value: Any) -> Any:
    """Return a value as JSON can say it, so that equal inputs and only those look equal.

    Numbers, texts, booleans, None, lists, mappings, arrays, paths and dataclasses of these are
    understood; an array counts by type, shape and bytes, a dataclass by the fields that it is compared by.

    Raises
    ------
    TypeError
        If the value is of another type.
    """
    if isinstance(value, np.generic):
        return canonical(value.item())
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in "biufcSU":
            raise TypeError(f"An array of type {value.dtype} cannot be part of a solution's key.")
        content = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return {"array": [value.dtype.str, list(value.shape), content]}
    if isinstance(value, Path):
        return {"path": value.as_posix()}
    if isinstance(value, Mapping):
        if not all(isinstance(name, str) for name in value):
            raise TypeError("A mapping in a solution's key must have texts as names.")
        return {name: canonical(member) for name, member in value.items()}
    if isinstance(value, list | tuple):
        return [canonical(member) for member in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        members = {
            each.name: canonical(getattr(value, each.name))
            for each in dataclasses.fields(value)
            if each.compare
        }
        return {type(value).__qualname__: members}
    raise TypeError(
        f"A {type(value).__name__} cannot be part of a solution's key; numbers, texts, booleans, lists, "
        "mappings, arrays, paths and dataclasses can."
    )


def entry(name: str, inputs: Any, source: str) -> Path:
    """Return the file, without suffix, of a solution.

    Parameters
    ----------
    name : str
        What the solution is called; it is part of the file name and of the key.
    inputs : object
        Everything besides the sources that it depends on, as `canonical` understands it.
    source : str
        `thesislib.provenance.source_hash`.
    """
    key = provenance.digest([_SCHEMA, name, canonical(inputs), source])
    slug = re.sub(r"[^A-Za-z0-9.]+", "-", name).strip("-.")[:60]
    return folder() / f"{slug or 'solution'}-{key[:32]}"


def save(
    path: Path, values: Mapping[str, Value], seconds: float, used: provenance.Usage | None = None
) -> None:
    """Store a solution with what has been used to compute it.

    Parameters
    ----------
    path : Path
        What `entry` returned.
    values : mapping
        Numbers, texts, booleans and arrays by name.
    seconds : float
        Time it took, s.
    used : Usage, optional
        Modules and data files; by default those of this process.

    Raises
    ------
    TypeError
        If a value is of another type.
    """
    scalars: dict[str, Any] = {}
    arrays: dict[str, np.ndarray] = {}
    for name, value in values.items():
        if isinstance(value, np.ndarray) and value.dtype.kind in "biufcSU":
            arrays[name] = value
            continue
        plain = value.item() if isinstance(value, np.generic) else value
        if not isinstance(plain, bool | int | float | str):
            raise TypeError(
                f"A solution's {name!r} is a {type(plain).__name__}; only numbers, texts, booleans and "
                "arrays of them are stored."
            )
        scalars[name] = plain
    packed = BytesIO()
    np.savez_compressed(
        packed, allow_pickle=False, **{f"array_{i}": a for i, a in enumerate(arrays.values())}
    )
    provenance.write_atomically(path.with_name(f"{path.name}.npz"), packed.getvalue())
    content = {
        "schema": _SCHEMA,
        "order": list(values),
        "scalars": scalars,
        "arrays": list(arrays),
        "seconds": seconds,
        "used": (used or provenance.usage()).as_lists(),
    }
    # written last: a solution without this file does not exist
    provenance.write_atomically(path.with_name(f"{path.name}.json"), json.dumps(content, indent=1))


def load(path: Path) -> Result | None:
    """Return a stored solution, None if there is none; what it has used counts as used here."""
    try:
        content = json.loads(path.with_name(f"{path.name}.json").read_text(encoding="utf-8"))
        with np.load(path.with_name(f"{path.name}.npz"), allow_pickle=False) as packed:
            arrays = {name: packed[f"array_{i}"] for i, name in enumerate(content["arrays"])}
        values = content["scalars"] | arrays
        result = Result(
            {name: values[name] for name in content["order"]}, stored=True, seconds=content["seconds"]
        )
        provenance.merge(provenance.Usage.from_lists(content["used"]))
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, OSError, zipfile.BadZipFile) as error:
        _log.warning("The stored solution %s cannot be read (%s); it is computed again.", path.name, error)
        return None
    return result


def stored(name: str, inputs: Any, compute: Callable[[], Mapping[str, Value]]) -> Result:
    """Return a solution: the stored one in a run from stored solutions, else computed and stored.

    Only ``THESIS_FROM_SOLUTION=1`` (``thesis run --from-solution``) makes it read; such a run is
    marked and cannot be published.

    Parameters
    ----------
    name : str
        What the solution is called.
    inputs : object
        Everything besides this package's sources and data that `compute` depends on.
    compute : callable
        Computes the solution: a mapping of numbers, texts, booleans and arrays.
    """
    path = entry(name, inputs, provenance.source_hash())
    if os.environ.get("THESIS_FROM_SOLUTION") == "1" and (found := load(path)) is not None:
        return found
    started = time.perf_counter()
    values = compute()
    result = Result(values, stored=False, seconds=time.perf_counter() - started)
    save(path, result, result.seconds)
    return result
