"""What there is to run: chapters, their parameters, their last run and whether it is current."""

from __future__ import annotations

from collections.abc import Iterator

from thesislib.companion import documents
from thesislib.companion.chapters import Chapter
from thesislib.companion.orders import RECORD, Order
from thesislib.companion.parameters import parameters

__all__ = ["listing"]


def listing(chapter: Chapter) -> Iterator[str]:
    """Return the lines that describe a chapter."""
    yield f"{chapter.id}  {chapter.title}  (book/{chapter.path.name})"
    for each in parameters(chapter):
        yield f"      {each.name} = {each.default}  {each.allowed}  {each.description}"
    order = Order(chapter)
    try:
        run = documents.read(order.folder / RECORD)["run"]
        yield (
            f"      last run {run['started']}: {run['seconds']:.1f} s, {run['peak_memory_mb']:.0f} MB, "
            f"{run['status']}"
        )
    except (FileNotFoundError, documents.DocumentError):
        yield "      no run"
    stale = order.staleness()
    yield f"      {'current' if stale is None else 'not current: ' + stale}"
