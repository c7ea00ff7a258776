"""Chapters as data: run them, record what they show, check it, list it, build the site."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thesislib.companion.records import Record, Series

__all__ = ["Record", "Series"]


def __getattr__(name: str) -> Any:
    # a command that only lists or refuses need not wait for numpy
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from thesislib.companion import records

    return getattr(records, name)
