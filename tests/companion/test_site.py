"""The site publishes checked runs and refuses all others.

The projects here are thrown away; their runs are written down instead of executed, so that a test
of the site needs no kernel. `tests/book` looks at the real pages.
"""

import base64
import json
import platform
import shutil
from dataclasses import asdict
from pathlib import Path

import jupytext
import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_output

from thesislib.companion import currency, site
from thesislib.companion.chapters import chapter
from thesislib.provenance import Usage

REPOSITORY = Path(__file__).resolve().parents[2]

CHAPTER = """\
---
kernelspec:
  name: python3
  display_name: Python 3
thesis:
  chapter: "02"
---

# A falling stone

Its speed follows from [(2.1)](#eq-2-1).

(eq-2-1)=
$$ v = g t \\tag{2.1} $$

```{code-cell} ipython3
:tags: [parameters]

gravity: float = 9.81  # 1 .. 30, m/s2
```

```{code-cell} ipython3
---
mystnb:
  figure:
    name: fig-2-1
    caption: "**Figure 2.1.** Speed against time."
  image:
    alt: Speed grows in proportion to time
---
plot(gravity)
```
"""

# One transparent pixel: what is drawn is no concern of the site.
PIXEL = base64.b64encode(
    base64.b64decode(
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
    )
).decode()


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project of an opening page and one chapter, with a finished run of it."""
    root = tmp_path / "project"
    (root / "book").mkdir(parents=True)
    shutil.copytree(REPOSITORY / "book" / "_static", root / "book" / "_static")
    shutil.copyfile(REPOSITORY / "_config.yml", root / "_config.yml")
    (root / "_toc.yml").write_text("format: jb-book\nroot: intro\nchapters:\n  - file: 02_fall\n")
    (root / "book" / "intro.md").write_text("# About\n\nOne chapter: [](02_fall.md).\n")
    (root / "book" / "02_fall.md").write_text(CHAPTER)
    (root / "data").mkdir()
    (root / "data" / "gravity.csv").write_text("planet,g\nearth,9.81\n")
    (root / "environment-pip.txt").write_text("casadi==3.8.2\n")
    write_run(root)
    return root


def write_run(root: Path, **changes: object) -> None:
    """Leave what the runner leaves after executing chapter 02; `changes` go into the record."""
    read = chapter("02", root)
    used = currency.ingredients(read, Usage(frozenset(), frozenset({"data/gravity.csv"})))
    run = {"status": "finished", "parameters": {}, "changed": False, "from_solution": False}
    record = {"schema": 1, "chapter": "02", "run": {**run, **asdict(used), "hash": used.hash, **changes}}
    read.run_folder.mkdir(parents=True, exist_ok=True)
    (read.run_folder / "record.json").write_text(json.dumps(record))

    notebook = jupytext.reads(read.text, fmt="md:myst")
    notebook.metadata["papermill"] = {"exception": None, "output_path": str(root / "02_fall.ipynb")}
    notebook.metadata["language_info"] = {"name": "python", "pygments_lexer": "ipython3"}
    plot = next(cell for cell in notebook.cells if cell.source.startswith("plot"))
    plot.outputs = [
        new_output("stream", name="stderr", text="a warning that names a file\n"),
        new_output("stream", name="stdout", text=f"read {root}/data/gravity.csv\n"),
        new_output("display_data", data={"image/png": PIXEL, "text/plain": "<Figure>"}),
    ]
    hidden = new_code_cell("collect()", metadata={"tags": ["thesis-bookkeeping", "remove-cell"]})
    hidden.outputs = [new_output("stream", name="stdout", text="bookkeeping\n")]
    notebook.cells.append(hidden)
    write_notebook(root, notebook)


def read_notebook(root: Path) -> nbformat.NotebookNode:
    return nbformat.read(chapter("02", root).executed, as_version=4)


def write_notebook(root: Path, notebook: nbformat.NotebookNode) -> None:
    path = chapter("02", root).executed
    path.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, path)


def assert_refused(root: Path, sentence: str) -> None:
    with pytest.raises(site.SiteError, match=sentence) as caught:
        site.build(root)
    assert len(str(caught.value).splitlines()) == 1
    assert not (root / "_build" / "html").exists()


def test_chapter_without_a_run_is_refused(project: Path) -> None:
    shutil.rmtree(project / "_build")
    assert_refused(project, "Chapter 02 has not been run; run it with: thesis run 02")


def test_chapter_whose_only_run_failed_is_refused(project: Path) -> None:
    shutil.rmtree(project / "_build")
    failed = currency.failure_file(chapter("02", project))
    failed.parent.mkdir(parents=True)
    failed.write_text(json.dumps({"failure": "cell 2 raised ValueError"}))
    assert_refused(project, "last run of chapter 02 failed: cell 2 raised ValueError")


def test_good_run_followed_by_a_failed_one_is_refused(project: Path) -> None:
    failed = currency.failure_file(chapter("02", project))
    failed.parent.mkdir(parents=True)
    failed.write_text(json.dumps({"failure": "cell 2 raised ValueError"}))
    assert_refused(project, "last run of chapter 02 failed: cell 2 raised ValueError")


def test_unfinished_run_is_refused(project: Path) -> None:
    write_run(project, status="running")
    assert_refused(project, "chapter 02 has the status 'running', not 'finished'")


def test_damaged_record_is_refused(project: Path) -> None:
    (chapter("02", project).run_folder / "record.json").write_text('{"schema": 1,')
    assert_refused(project, "record of chapter 02 cannot be read")


def test_run_with_changed_parameters_is_refused(project: Path) -> None:
    write_run(project, changed=True)
    assert_refused(project, "chapter 02 has changed parameters")


def test_run_from_stored_solutions_is_refused(project: Path) -> None:
    write_run(project, from_solution=True)
    assert_refused(
        project, "chapter 02 took its solutions from the store; run it with: thesis run 02 --again"
    )


def test_record_that_does_not_say_whether_parameters_were_changed_is_refused(project: Path) -> None:
    write_run(project, changed=None)
    assert_refused(project, "chapter 02 has changed parameters")


def test_edited_data_file_makes_the_run_refused(project: Path) -> None:
    (project / "data" / "gravity.csv").write_text("planet,g\nearth,9.82\n")
    assert_refused(project, r"data file data/gravity\.csv has changed")


def test_edited_code_cell_makes_the_run_refused(project: Path) -> None:
    (project / "book" / "02_fall.md").write_text(CHAPTER.replace("plot(gravity)", "plot(2 * gravity)"))
    assert_refused(project, "its code cells have changed")


def test_another_python_makes_the_run_refused(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform, "python_version", lambda: "3.12.99")
    assert_refused(project, r"Python has become 3\.12\.99")


def test_record_without_executed_notebook_is_refused(project: Path) -> None:
    chapter("02", project).executed.unlink()
    assert_refused(project, "record and no executed notebook")


def test_executed_notebook_of_other_code_is_refused(project: Path) -> None:
    notebook = read_notebook(project)
    notebook.cells = [cell for cell in notebook.cells if not cell.source.startswith("plot")]
    write_notebook(project, notebook)
    assert_refused(project, r"other code cells than 02_fall\.md")


def test_executed_notebook_that_stopped_at_an_exception_is_refused(project: Path) -> None:
    notebook = read_notebook(project)
    notebook.metadata["papermill"]["exception"] = True
    write_notebook(project, notebook)
    assert_refused(project, "chapter 02 stopped at an exception")


def test_executed_notebook_with_an_error_output_is_refused(project: Path) -> None:
    notebook = read_notebook(project)
    notebook.cells[-2].outputs = [new_output("error", ename="ValueError", evalue="no", traceback=[])]
    write_notebook(project, notebook)
    assert_refused(project, "chapter 02 stopped at an exception")


def test_executed_notebook_with_injected_parameters_is_refused(project: Path) -> None:
    notebook = read_notebook(project)
    injected = new_code_cell("gravity = 1.62", metadata={"tags": ["injected-parameters"]})
    notebook.cells.insert(3, injected)
    write_notebook(project, notebook)
    assert_refused(project, "chapter 02 has changed parameters")


def test_page_that_is_not_in_the_contents_is_refused(project: Path) -> None:
    (project / "book" / "errata.md").write_text("# Errata\n")
    assert_refused(project, r"book/errata\.md is not in _toc\.yml")


def test_contents_that_name_a_page_that_is_not_there_are_refused(project: Path) -> None:
    with (project / "_toc.yml").open("a") as contents:
        contents.write("  - file: 03_suspension\n")
    assert_refused(project, r"_toc\.yml names 03_suspension, and there is no book/03_suspension\.md")


def test_code_on_a_page_that_is_no_chapter_is_refused(project: Path) -> None:
    with (project / "book" / "intro.md").open("a") as intro:
        intro.write("\n```{code-cell} ipython3\nprint(1)\n```\n")
    assert_refused(project, r"book/intro\.md has code cells, but its front matter names no chapter")


def test_all_refusals_are_named_at_once(project: Path) -> None:
    write_run(project, changed=True)
    (project / "book" / "errata.md").write_text("# Errata\n")
    with pytest.raises(site.SiteError) as caught:
        site.build(project)
    assert len(str(caught.value).splitlines()) == 2


def test_refused_run_leaves_the_published_site_as_it_was(project: Path) -> None:
    published = project / "_build" / "html" / "index.html"
    published.parent.mkdir(parents=True)
    published.write_text("yesterday's site")
    write_run(project, changed=True)
    with pytest.raises(site.SiteError):
        site.build(project)
    assert published.read_text() == "yesterday's site"


def test_warning_of_sphinx_is_a_failure_that_leaves_the_published_site(project: Path) -> None:
    published = project / "_build" / "html" / "index.html"
    published.parent.mkdir(parents=True)
    published.write_text("yesterday's site")
    (project / "book" / "intro.md").write_text("# About\n\n[Nowhere](#eq-9-9)\n")
    with pytest.raises(site.SiteError, match="not built without warnings") as caught:
        site.build(project)
    assert "eq-9-9" in str(caught.value)
    assert published.read_text() == "yesterday's site"


def test_site_is_the_run_with_the_prose_of_today(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    prose = CHAPTER.replace("Its speed", "The stone's speed").replace("against time", "over time")
    (project / "book" / "02_fall.md").write_text(prose)
    index = site.build(project)
    assert index == project / "_build" / "html" / "index.html"
    html = (index.parent / "02_fall.html").read_text(encoding="utf-8")
    assert "The stone's speed" in html.replace("’", "'")
    assert "Figure 2.1.</strong> Speed over time" in html
    assert 'alt="Speed grows in proportion to time"' in html
    assert 'href="#eq-2-1"' in html
    assert "(2.1)" in html
    assert "read ./data/gravity.csv" in html

    assert "bookkeeping" not in html
    assert "a warning that names a file" not in html
    assert not any(str(project).encode() in path.read_bytes() for path in index.parent.rglob("*.*"))
    assert (index.parent / "mathjax" / "tex-chtml-full.js").is_file()
    assert 'src="_static/../mathjax/tex-chtml-full.js' in html
    assert not (index.parent / "plotly").exists()

    # The same pages again: nothing is built.
    monkeypatch.setattr(site, "_sphinx", lambda *_: pytest.fail("built a second time"))
    assert site.build(project) == index


def test_plotly_is_copied_for_a_page_that_loads_it(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = read_notebook(project)
    script = '<div id="map"></div><script src="plotly/plotly.min.js"></script>'
    notebook.cells[-2].outputs = [new_output("display_data", data={"text/html": script})]
    write_notebook(project, notebook)

    def only_staged(staged: Path, work: Path) -> Path:
        html = work / "_build" / "html"
        shutil.copytree(staged / "_extra", html)
        return html

    monkeypatch.setattr(site, "_sphinx", only_staged)
    top = site.build(project).parent
    assert (top / "plotly" / "plotly.min.js").stat().st_size > 1e6
    assert sum(path.stat().st_size for path in (top / "mathjax").rglob("*.*")) < 2e6
