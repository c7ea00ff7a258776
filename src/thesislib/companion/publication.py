"""A chapter's page: the prose of its text notebook with the outputs of its executed one.

The page takes prose, captions and tags from the text as it is now and outputs from the run, so that
a corrected sentence needs no new run. What belongs to the machine and not to the reader stays behind:
standard error, the runner's own cells and metadata, and the names of this machine's folders.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jupytext
import nbformat
from nbformat import NotebookNode

from thesislib.companion import bookkeeping
from thesislib.companion.chapters import Chapter

__all__ = ["PublicationError", "machine_paths", "page", "without_paths"]

INJECTED = "injected-parameters"
"""Tag that papermill gives to the cell with changed parameters."""


class PublicationError(RuntimeError):
    """A notebook that cannot be published; one sentence says why."""


def page(chapter: Chapter, executed: NotebookNode, hidden: Mapping[str, str] | None = None) -> NotebookNode:
    """Join a chapter's text with the outputs of its run.

    Parameters
    ----------
    chapter : Chapter
        The chapter as it is now.
    executed : NotebookNode
        The notebook that the run has left.
    hidden : mapping, optional
        Folder names and what stands for each on the page; `machine_paths` of the project by default.

    Returns
    -------
    NotebookNode
        A notebook for MyST-NB. Its cell ids are counted, so that the same run gives the same bytes.

    Raises
    ------
    PublicationError
        If the run stopped at an exception, had changed parameters, or ran other code.
    """
    hidden = machine_paths(chapter.root) if hidden is None else hidden
    run = [cell for cell in executed.cells if cell.cell_type == "code" and bookkeeping.TAG not in _tags(cell)]
    if executed.metadata.get("papermill", {}).get("exception") or any(_stopped(cell) for cell in run):
        raise PublicationError(f"The executed notebook of chapter {chapter.id} stopped at an exception.")
    if any(INJECTED in _tags(cell) for cell in run):
        raise PublicationError(f"The executed notebook of chapter {chapter.id} has changed parameters.")

    text = jupytext.reads(chapter.text, fmt="md:myst")
    code = [cell for cell in text.cells if cell.cell_type == "code"]
    if [cell.source.rstrip() for cell in code] != [cell.source.rstrip() for cell in run]:
        raise PublicationError(
            f"The executed notebook of chapter {chapter.id} has other code cells than {chapter.path.name}."
        )
    for cell, done in zip(code, run, strict=True):
        cell.execution_count = done.execution_count
        cell.outputs = [without_paths(output, hidden) for output in done.outputs if not _is_stderr(output)]
    for number, cell in enumerate(text.cells):
        cell.id = f"cell-{number}"
    # MyST-NB takes the highlighter of the code from the language that the kernel has reported.
    for key in ("kernelspec", "language_info"):
        if key in executed.metadata:
            text.metadata[key] = executed.metadata[key]
    text.nbformat, text.nbformat_minor = 4, 5
    nbformat.validate(text)
    return text


def machine_paths(root: Path) -> dict[str, str]:
    """Folders of this machine that no page may show, and what stands for each.

    Parameters
    ----------
    root : Path
        The project's root folder.
    """
    named = {
        root: ".",
        Path(sys.prefix): "[environment]",
        Path(sys.base_prefix): "[python]",
        Path(tempfile.gettempdir()): "[temporary]",
        Path.home(): "~",
    }
    # A root directory or a first-level system folder such as /usr is no secret and names no user.
    shared = {Path(path.anchor) for path in named} | {Path("/usr"), Path("/usr/local")}
    return {str(path): stands for path, stands in named.items() if path not in shared}


def without_paths(value: Any, hidden: Mapping[str, str]) -> Any:
    """Replace folder names in a notebook's output, at any depth; encoded images are left alone.

    Parameters
    ----------
    value
        A string, a list or a mapping as a notebook holds them.
    hidden : mapping
        What stands for each folder name.
    """
    if isinstance(value, str) and hidden:
        # The longest first: the environment lies in the project, and the project in the home folder.
        paths = "|".join(re.escape(path) for path in sorted(hidden, key=len, reverse=True))
        return re.sub(rf"(?<![\w.-])(?:{paths})(?![\w.-])", lambda found: hidden[found[0]], value)
    if isinstance(value, list):
        return [without_paths(item, hidden) for item in value]
    if isinstance(value, Mapping):
        return NotebookNode(
            {key: item if _is_encoded(key) else without_paths(item, hidden) for key, item in value.items()}
        )
    return value


def _tags(cell: NotebookNode) -> list[str]:
    return list(cell.metadata.get("tags", []))


def _stopped(cell: NotebookNode) -> bool:
    return any(output.output_type == "error" for output in cell.outputs)


def _is_stderr(output: NotebookNode) -> bool:
    return bool(output.output_type == "stream" and output.name == "stderr")


def _is_encoded(mime: str) -> bool:
    return mime == "application/pdf" or (mime.startswith("image/") and mime != "image/svg+xml")
