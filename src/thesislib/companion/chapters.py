"""The chapters: text notebooks in ``book/``, found by their front matter.

A chapter is a MyST-NB text notebook without outputs whose front matter names its id::

    thesis:
      chapter: "04"
      wall_limit_s: 1500

Pages without that entry are prose and no chapters.
"""

from __future__ import annotations

import difflib
import functools
import re
from dataclasses import dataclass, field
from pathlib import Path

import yaml
from markdown_it import MarkdownIt

from thesislib import provenance

__all__ = ["WALL_LIMIT_S", "Chapter", "CodeCell", "InputError", "chapter", "chapters"]

WALL_LIMIT_S = 600.0
"""Wall-clock limit of a chapter whose front matter names none, s."""

_FRONT_MATTER = re.compile(r"\A---[ \t]*\n(.*?)\n---[ \t]*\n", re.DOTALL)
_CODE_CELL = re.compile(r"\{code-cell\}")
_OPTIONS_BLOCK = re.compile(r"\A---[ \t]*\n(?P<yaml>.*?)\n?---[ \t]*(?:\n|\Z)", re.DOTALL)
_OPTIONS_LINES = re.compile(r"\A(?P<yaml>(?::[\w-]+:.*(?:\n|\Z))+)")
_HEADING = re.compile(r"^# +(.+?)\s*$", re.MULTILINE)


class InputError(ValueError):
    """Input that is refused, with one sentence that says why (exit status 2)."""


@dataclass(frozen=True)
class CodeCell:
    """One code cell of a chapter: its source, without white space at its end, and its tags."""

    source: str
    tags: tuple[str, ...]


@dataclass(frozen=True)
class Chapter:
    """One chapter of the book.

    Attributes
    ----------
    id : str
        ``"01"`` to ``"99"`` for chapters, one capital letter for appendices.
    path : Path
        The text notebook.
    title : str
        Title from the front matter or, without one there, the first heading.
    wall_limit_s : float
        Wall-clock time after which a run of the chapter is stopped and has failed, s.
    text : str
        The text notebook as it was read, so that one run sees one state of it.
    """

    id: str
    path: Path
    title: str
    wall_limit_s: float
    text: str = field(repr=False)

    @property
    def stem(self) -> str:
        """File name without its suffix; the executed notebook has the same."""
        return self.path.stem

    @property
    def root(self) -> Path:
        """The project's root folder."""
        return self.path.parent.parent

    @property
    def run_folder(self) -> Path:
        """Folder of the published run: record, log, one CSV per table and figure series."""
        return self.root / "_build" / "run" / self.id

    @property
    def executed(self) -> Path:
        """The executed notebook of the published run."""
        return self.root / "_build" / "executed" / f"{self.stem}.ipynb"

    @functools.cached_property
    def cells(self) -> tuple[CodeCell, ...]:
        """The code cells, in order.

        Read with the Markdown parser alone: a refusal need not wait for the notebook libraries.
        """
        fences = (token for token in MarkdownIt("commonmark").parse(self.text) if token.type == "fence")
        return tuple(
            _code_cell(token.content, self.path)
            for token in fences
            if token.level == 0 and _CODE_CELL.match(token.info)
        )

    @property
    def code(self) -> tuple[str, ...]:
        """Sources of the code cells, in order."""
        return tuple(cell.source for cell in self.cells)


def chapters(root: Path | None = None) -> list[Chapter]:
    """Return the chapters of a project in the order of their ids, appendices last.

    Parameters
    ----------
    root : Path, optional
        The project's root folder; `thesislib.provenance.project_root` if not given.

    Raises
    ------
    InputError
        If a chapter's front matter is malformed or two chapters have the same id.
    """
    root = root or provenance.project_root()
    found: dict[str, Chapter] = {}
    for path in sorted((root / "book").glob("*.md")):
        read = _read(path)
        if read is None:
            continue
        if read.id in found:
            raise InputError(f"{found[read.id].path.name} and {path.name} both are chapter {read.id!r}.")
        found[read.id] = read
    return sorted(found.values(), key=lambda each: (each.id.isalpha(), each.id))


def chapter(name: str, root: Path | None = None) -> Chapter:
    """Return the chapter with an id.

    Parameters
    ----------
    name : str
        The id as written in the front matter; ``"4"`` and ``"b"`` are understood as well.
    root : Path, optional
        The project's root folder.

    Raises
    ------
    InputError
        If there is no such chapter; the known ones are named.
    """
    known = {each.id: each for each in chapters(root)}
    wanted = name.zfill(2) if name.isdigit() else name.upper()
    if wanted in known:
        return known[wanted]
    names = {each.id: each.id for each in known.values()} | {each.stem: each.id for each in known.values()}
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"; did you mean {names[near[0]]!r}?" if near else "."
    raise InputError(f"There is no chapter {name!r} (known: {', '.join(known) or 'none'}){hint}")


def _read(path: Path) -> Chapter | None:
    """Read a page; None if it is prose."""
    text = path.read_text(encoding="utf-8")
    found = _FRONT_MATTER.match(text)
    if found is None:
        return None
    try:
        front = yaml.safe_load(found.group(1))
    except yaml.YAMLError as error:
        raise InputError(f"The front matter of {path.name} is not YAML: {error}") from error
    entry = front.get("thesis") if isinstance(front, dict) else None
    if entry is None:
        return None
    if not isinstance(entry, dict) or "chapter" not in entry:
        raise InputError(f"The front matter of {path.name} has an entry 'thesis' without 'chapter'.")
    unknown = sorted(set(entry) - {"chapter", "wall_limit_s"})
    if unknown:
        raise InputError(
            f"The front matter of {path.name} has unknown entries {', '.join(unknown)} "
            "below 'thesis' (known: chapter, wall_limit_s)."
        )
    heading = _HEADING.search(text, found.end())
    title = front.get("title") or (heading.group(1) if heading else path.stem)
    return Chapter(_id(entry["chapter"], path), path, str(title), _wall_limit(entry, path), text)


def _code_cell(content: str, path: Path) -> CodeCell:
    """Split a code cell into its options (a YAML block or lines ``:tags: [...]``) and its source."""
    found = _OPTIONS_BLOCK.match(content) or _OPTIONS_LINES.match(content)
    if found is None:
        return CodeCell(content.strip("\n").rstrip(), ())
    options = re.sub(r"^:([\w-]+):", r"\1:", found["yaml"], flags=re.MULTILINE)
    try:
        read = yaml.safe_load(options) or {}
    except yaml.YAMLError as error:
        raise InputError(f"A code cell of {path.name} has options that are not YAML: {error}") from error
    tags = read.get("tags", [])
    if not isinstance(tags, list):
        tags = [tags]
    return CodeCell(content[found.end() :].strip("\n").rstrip(), tuple(str(tag) for tag in tags))


def _id(value: object, path: Path) -> str:
    if not isinstance(value, str) or not re.fullmatch(r"\d\d|[A-Z]", value):
        raise InputError(
            f"{path.name} has the chapter id {value!r}; an id is two digits or one capital letter in quotes."
        )
    named = f"appendix_{value.lower()}" if value.isalpha() else value
    if path.stem != named and not path.stem.startswith(f"{named}_"):
        raise InputError(
            f"{path.name} says it is chapter {value!r}: its file name must start with {named!r}."
        )
    return value


def _wall_limit(entry: dict[str, object], path: Path) -> float:
    limit = entry.get("wall_limit_s", WALL_LIMIT_S)
    if isinstance(limit, bool) or not isinstance(limit, int | float) or not 0 < limit <= 86400:
        raise InputError(
            f"{path.name} has wall_limit_s = {limit!r}; allowed are seconds above 0 and up to 86400."
        )
    return float(limit)
