"""What the kernel of a run does before the chapter's first cell and after its last one."""

from __future__ import annotations

import os
from pathlib import Path

from thesislib import provenance, studies
from thesislib.companion import documents, pages

__all__ = ["FINISH", "START", "TAG", "USED", "finish", "start"]

TAG = "thesis-bookkeeping"
"""Tag of the cells that the runner adds, and takes out of the executed notebook again."""

USED = "used.json"
"""File in the run's folder that `finish` writes."""

# as expressions, so that they leave no name in the chapter's own
_IMPORT = f"__import__('importlib').import_module({__name__!r})"
START = f"{_IMPORT}.start()"
FINISH = f"{_IMPORT}.finish()"


def start() -> None:
    """Watch which files the chapter opens, and send progress lines to the run's log."""
    provenance.watch()
    studies.log_to_run()


def finish() -> None:
    """Write what the run has used, its versions and its peak memory for the runner."""
    used = provenance.usage()
    documents.write(
        Path(os.environ["THESIS_RUN_DIR"]) / USED,
        {
            **used.as_lists(),
            "versions": pages.versions(),
            "peak_memory_mb": pages.peak_memory_mb(),
        },
    )
