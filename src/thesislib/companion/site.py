"""The site: a staged copy of the book in which each chapter is its checked run, built as HTML.

The published pages are exactly the runs that the records describe. A run that failed, that is not
current, that had changed parameters or that took its solutions from the store is refused.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import nbformat
import yaml
from nbformat import NotebookNode

from thesislib import provenance
from thesislib.companion import currency, publication, site_assets
from thesislib.companion.chapters import Chapter, chapters

__all__ = ["SiteError", "build", "page", "refusal"]

_CONFIGURATION = ("_config.yml", "_toc.yml")
_CODE_CELL = re.compile(r"^(`{3,}|:{3,})\s*\{code-cell\}", re.MULTILINE)


class SiteError(RuntimeError):
    """The site was not built; each line of the message gives one reason."""


def build(root: Path | None = None) -> Path:
    """Build the site from the last runs of all chapters.

    The site that is already there stays as it is until the new one is whole. If it was built from
    the same pages, it is not built again.

    Parameters
    ----------
    root : Path, optional
        The project's root folder; `thesislib.provenance.project_root` if not given.

    Returns
    -------
    Path
        ``_build/html/index.html``.

    Raises
    ------
    SiteError
        If a chapter's run cannot be published (every such chapter is named), a page is not in its
        place, or Sphinx had anything to warn of.
    """
    root = root or provenance.project_root()
    pages = _pages(root)
    work = root / "_build" / "site"
    staged = work / "src"
    shutil.rmtree(staged, ignore_errors=True)
    _stage(root, pages, staged)

    html = root / "_build" / "html"
    receipt = work / "built-from.txt"
    wanted = _content_hash(staged, root)
    if receipt.is_file() and receipt.read_text(encoding="utf-8") == wanted and html.is_dir():
        return html / "index.html"
    receipt.unlink(missing_ok=True)
    _replace(html, _sphinx(staged, work))
    receipt.write_text(wanted, encoding="utf-8")
    return html / "index.html"


def refusal(chapter: Chapter) -> str | None:
    """Return the sentence saying why the last run of a chapter cannot be published; None if it can.

    Parameters
    ----------
    chapter : Chapter
        The chapter as it is now.
    """
    again = f"run it with: thesis run {chapter.id}"
    try:
        record: dict[str, Any] = json.loads((chapter.run_folder / "record.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        failed = currency.failure(chapter)
        if failed is not None:
            return f"The last run of chapter {chapter.id} failed: {failed}"
        return f"Chapter {chapter.id} has not been run; {again}"
    except json.JSONDecodeError as error:
        return f"The record of chapter {chapter.id} cannot be read ({error}); {again} --again"
    run = record.get("run", {})
    if run.get("changed") is not False:
        return f"The run of chapter {chapter.id} has changed parameters; {again}"
    if run.get("from_solution") is not False:
        return f"The run of chapter {chapter.id} took its solutions from the store; {again} --again"
    return currency.staleness(chapter, record)


def page(chapter: Chapter) -> NotebookNode:
    """Return the page of a chapter: its text with the outputs of its last run.

    Parameters
    ----------
    chapter : Chapter
        The chapter as it is now.

    Raises
    ------
    SiteError
        If the run cannot be published.
    """
    refused = refusal(chapter)
    if refused is not None:
        raise SiteError(refused)
    try:
        executed = nbformat.read(chapter.executed, as_version=4)
    except FileNotFoundError as error:
        raise SiteError(
            f"Chapter {chapter.id} has a record and no executed notebook; "
            f"run it with: thesis run {chapter.id} --again"
        ) from error
    try:
        return publication.page(chapter, executed)
    except publication.PublicationError as error:
        raise SiteError(str(error)) from error


def _pages(root: Path) -> dict[Path, NotebookNode]:
    """Every chapter's page under its text's path; all refusals together if there are any."""
    pages: dict[Path, NotebookNode] = {}
    reasons: list[str] = []
    known = {chapter.path: chapter for chapter in chapters(root)}
    for path, chapter in known.items():
        try:
            pages[path] = page(chapter)
        except SiteError as error:
            reasons.append(str(error))
    listed = _listed(root / "_toc.yml")
    for name in sorted(listed - {path.stem for path in (root / "book").glob("*.md")}):
        reasons.append(f"_toc.yml names {name}, and there is no book/{name}.md.")
    for path in sorted((root / "book").glob("*.md")):
        if path.stem not in listed:
            reasons.append(f"book/{path.name} is not in _toc.yml, so that no reader would find it.")
        if path not in known and _CODE_CELL.search(path.read_text(encoding="utf-8")):
            reasons.append(f"book/{path.name} has code cells, but its front matter names no chapter.")
    if reasons:
        raise SiteError("\n".join(reasons))
    return pages


def _listed(toc: Path) -> set[str]:
    """Names of the pages in the table of contents, at any depth."""

    def files(entry: Any) -> set[str]:
        if isinstance(entry, list):
            return set().union(*(files(item) for item in entry))
        if not isinstance(entry, dict):
            return set()
        own = {str(entry[key]) for key in ("root", "file") if key in entry}
        return own.union(*(files(value) for value in entry.values()))

    return {name.removesuffix(".md") for name in files(yaml.safe_load(toc.read_text(encoding="utf-8")))}


def _stage(root: Path, pages: dict[Path, NotebookNode], staged: Path) -> None:
    """Lay out what Sphinx is to see: the book, with notebooks in the place of the chapters' texts."""
    not_copied = shutil.ignore_patterns(".*", "__pycache__", *(path.name for path in pages))
    shutil.copytree(root / "book", staged, ignore=not_copied)
    for name in _CONFIGURATION:
        shutil.copyfile(root / name, staged / name)
    names = [path.stem for path in pages]
    for prose in staged.glob("*.md"):
        prose.write_text(_relinked(prose.read_text(encoding="utf-8"), names), encoding="utf-8")
    for path, notebook in pages.items():
        for cell in notebook.cells:
            if cell.cell_type == "markdown":
                cell.source = _relinked(cell.source, names)
        nbformat.write(notebook, (staged / path.name).with_suffix(".ipynb"))
    extra = staged / site_assets.EXTRA
    site_assets.copy_mathjax(extra)
    if any(site_assets.PLOTLY in nbformat.writes(notebook) for notebook in pages.values()):
        site_assets.copy_plotly(extra)


def _relinked(text: str, chapter_names: list[str]) -> str:
    """Let links to the chapters' texts, ``[lap](04_lap.md)``, lead to the notebooks in their place."""
    names = "|".join(re.escape(name) for name in chapter_names)
    return re.sub(rf"\]\(({names})\.md(?=[)#])", r"](\1.ipynb", text) if names else text


def _content_hash(staged: Path, root: Path) -> str:
    """Hash of all that the built pages depend on: the staged files, the locked environment, the build."""
    digest = hashlib.sha256((root / provenance.LOCK).read_bytes())
    for build_step in (Path(__file__), Path(__file__).with_name("tagged_equations.py")):
        digest.update(build_step.read_bytes())
    for path in sorted(path for path in staged.rglob("*") if path.is_file()):
        content = hashlib.sha256(path.read_bytes()).hexdigest()
        digest.update(f"\n{path.relative_to(staged).as_posix()} {content}".encode())
    return digest.hexdigest()


def _sphinx(staged: Path, work: Path) -> Path:
    """Build the staged book afresh and return the folder of the pages.

    Afresh, because Sphinx keeps what it has read: a second call would not repeat the warnings of a
    page that the first one read, and a build that had failed would pass.
    """
    shutil.rmtree(work / "_build", ignore_errors=True)
    command = [str(Path(sysconfig.get_path("scripts"), "jupyter-book")), "build"]
    command += ["-q", "-W", "-n", "--keep-going", str(staged), "--path-output", str(work)]
    done = subprocess.run(
        command,
        env={**os.environ, "NO_COLOR": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        check=False,
    )
    # Sphinx's own warnings set the exit status; those of its configuration are only printed.
    if done.returncode != 0 or "Warning:" in done.stdout:
        raise SiteError(f"The pages were not built without warnings:\n{done.stdout.strip()}")
    return work / "_build" / "html"


def _replace(old: Path, new: Path) -> None:
    """Put the folder `new` in the place of `old`, which is whole until the last moment."""
    retired = new.with_name("retired")
    shutil.rmtree(retired, ignore_errors=True)
    if old.exists():
        old.rename(retired)
    new.rename(old)
    shutil.rmtree(retired, ignore_errors=True)
