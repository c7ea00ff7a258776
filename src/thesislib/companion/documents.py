"""Records and stored values as JSON files that a reader, and a diff, can follow."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from thesislib import provenance

__all__ = ["SCHEMA", "DocumentError", "formatted", "read", "write"]

SCHEMA = 1
"""Version of the layout described in ``docs/record-schema.json``."""

_NUMBERS_PER_LINE = 4


class DocumentError(ValueError):
    """A file that is not the JSON document it should be."""


def formatted(value: Any, indent: str = "") -> str:
    """Return JSON with one member per line and long lists of scalars a few to a line.

    Numbers are written with `repr`: the shortest text that gives the same double again.

    Raises
    ------
    ValueError
        If a number is not finite.
    """
    deeper = indent + " "
    if isinstance(value, dict) and value:
        members = (
            f"{deeper}{json.dumps(str(name), ensure_ascii=False)}: {formatted(member, deeper)}"
            for name, member in value.items()
        )
        return "{\n" + ",\n".join(members) + f"\n{indent}}}"
    if isinstance(value, list | tuple) and value:
        if any(isinstance(member, dict | list | tuple) for member in value):
            lines = [deeper + formatted(member, deeper) for member in value]
        else:
            texts = [_scalar(member) for member in value]
            if len(texts) <= _NUMBERS_PER_LINE:
                return "[" + ", ".join(texts) + "]"
            starts = range(0, len(texts), _NUMBERS_PER_LINE)
            lines = [deeper + ", ".join(texts[i : i + _NUMBERS_PER_LINE]) for i in starts]
        return "[\n" + ",\n".join(lines) + f"\n{indent}]"
    return _scalar(value)


def _scalar(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def read(path: Path) -> dict[str, Any]:
    """Return the JSON object in a file.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    DocumentError
        If it is not a JSON object of the known schema version.
    """
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise DocumentError(f"{path} is not JSON: {error}.") from error
    if not isinstance(value, dict):
        raise DocumentError(f"{path} holds a {type(value).__name__}, not a JSON object.")
    if value.get("schema", SCHEMA) != SCHEMA:
        raise DocumentError(f"{path} has schema {value['schema']!r}; this program knows {SCHEMA}.")
    return value


def write(path: Path, value: dict[str, Any]) -> None:
    """Write a JSON object to a file, whole or not at all."""
    provenance.write_atomically(path, formatted(value) + "\n")
