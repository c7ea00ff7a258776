"""Wishes for runs: which chapter, with which parameters, and where the run is kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from thesislib import provenance
from thesislib.companion import currency, documents
from thesislib.companion.chapters import Chapter
from thesislib.companion.parameters import Value

__all__ = ["LOG", "RECORD", "Order"]

RECORD = "record.json"
LOG = "log.txt"


@dataclass(frozen=True)
class Order:
    """A wish for one run of a chapter.

    Attributes
    ----------
    chapter : Chapter
        The chapter.
    values : mapping of str to value
        Parameters that differ from the published run; empty for the published run itself.
    from_solution : bool
        Whether stored solutions are used instead of solving.
    fresh : bool
        Whether the cases of studies that are stored already are computed anew.
    """

    chapter: Chapter
    values: Mapping[str, Value] = field(default_factory=dict)
    from_solution: bool = False
    fresh: bool = False

    @property
    def name(self) -> str:
        """The chapter's id; of a changed run, with the hash of its parameters."""
        if not self.values:
            return self.chapter.id
        return f"{self.chapter.id}-{provenance.digest(dict(self.values))[:10]}"

    @property
    def folder(self) -> Path:
        """Folder of the run."""
        if not self.values:
            return self.chapter.run_folder
        return self.chapter.root / "_build" / "changed" / self.name

    @property
    def notebook(self) -> Path:
        """The executed notebook of the run."""
        return self.folder / f"{self.chapter.stem}.ipynb" if self.values else self.chapter.executed

    def staleness(self) -> str | None:
        """Return the sentence saying why the run has to be done; None if there is a current one."""
        try:
            record = documents.read(self.folder / RECORD)
        except FileNotFoundError:
            return f"Chapter {self.name} has not been run."
        except documents.DocumentError as error:
            return f"The record of chapter {self.name} cannot be read: {error}"
        if record.get("run", {}).get("from_solution"):
            return f"The run of chapter {self.name} used stored solutions."
        if not self.notebook.is_file():
            return f"Chapter {self.name} has no executed notebook."
        return currency.staleness(self.chapter, record)
