"""Chapters are found by their front matter, and malformed ones are refused with one sentence."""

from pathlib import Path
from typing import Any

import jupytext
import pytest

from thesislib.companion.chapters import WALL_LIMIT_S, InputError, chapter, chapters

FORMS_OF_CELLS = """\
---
thesis:
  chapter: "03"
title: A title
---

# A heading

```{code-cell} ipython3
plain = 1

still = "plain"
```

```{code-cell} ipython3
:tags: [parameters, hide-input]
:name: cell

mass: float = 1.0  # 0 .. 2, mass
```

```{code-cell} ipython3
---
tags: [remove-input]
mystnb:
  figure:
    caption: |
      Two lines
      of caption.
---
draw()
```

```{code-cell}
```

```python
not_a_cell = True
```

> ```{code-cell} python
> quoted = True
> ```
"""


def write(project: Any, name: str, front: str) -> Path:
    path: Path = project.root / "book" / name
    path.write_text(f"---\n{front}\n---\n\n# Heading\n")
    return path


def test_chapters_come_in_order_with_appendices_last_and_without_prose(project: Any) -> None:
    for id in ("10", "B", "02"):
        project.add(id, "1")
    write(project, "intro.md", "title: Introduction")
    (project.root / "book" / "errata.md").write_text("# No front matter\n")
    assert [each.id for each in chapters(project.root)] == ["02", "10", "B"]


def test_a_chapter_knows_its_places(project: Any) -> None:
    project.add("04", "1", wall_limit_s=1500)
    found = chapter("4")
    assert (found.id, found.stem, found.title) == ("04", "04_small", "Chapter 04")
    assert found.wall_limit_s == 1500.0
    assert found.root == project.root
    assert found.run_folder == project.root / "_build/run/04"
    assert found.executed == project.root / "_build/executed/04_small.ipynb"


def test_wall_limit_and_title_have_defaults(project: Any) -> None:
    write(project, "appendix_c.md", 'thesis: {chapter: "C"}')
    assert chapter("c").wall_limit_s == WALL_LIMIT_S
    assert chapter("c").title == "Heading"


def test_code_cells_are_those_that_the_notebook_has(project: Any) -> None:
    path = project.root / "book" / "03_forms.md"
    path.write_text(FORMS_OF_CELLS)
    found = chapter("03")
    notebook = jupytext.reads(found.text, fmt="md:myst")
    assert list(found.code) == [c.source.rstrip() for c in notebook.cells if c.cell_type == "code"]
    assert [cell.tags for cell in found.cells] == [(), ("parameters", "hide-input"), ("remove-input",), ()]
    assert found.title == "A title"


@pytest.mark.parametrize(
    ("name", "front", "said"),
    [
        ("04_a.md", "thesis: [", "is not YAML"),
        ("04_a.md", "thesis: {wall_limit_s: 5}", "without 'chapter'"),
        ("04_a.md", "thesis: 4", "without 'chapter'"),
        ("04_a.md", "thesis: {chapter: 4}", "two digits or one capital letter in quotes"),
        ("04_a.md", 'thesis: {chapter: "4"}', "two digits or one capital letter"),
        ("04_a.md", 'thesis: {chapter: "05"}', "must start with '05'"),
        ("b.md", 'thesis: {chapter: "B"}', "must start with 'appendix_b'"),
        ("04_a.md", 'thesis: {chapter: "04", wall_limit: 5}', "unknown entries wall_limit"),
        ("04_a.md", 'thesis: {chapter: "04", wall_limit_s: 0}', "wall_limit_s = 0"),
        ("04_a.md", 'thesis: {chapter: "04", wall_limit_s: true}', "wall_limit_s = True"),
        ("04_a.md", 'thesis: {chapter: "04", wall_limit_s: .nan}', "wall_limit_s = nan"),
    ],
)
def test_malformed_front_matter_is_refused(project: Any, name: str, front: str, said: str) -> None:
    write(project, name, front)
    with pytest.raises(InputError) as info:
        chapters(project.root)
    assert said in str(info.value) and name in str(info.value)


def test_one_id_for_two_chapters_is_refused(project: Any) -> None:
    write(project, "04_a.md", 'thesis: {chapter: "04"}')
    write(project, "04_b.md", 'thesis: {chapter: "04"}')
    with pytest.raises(InputError, match=r"04_a\.md and 04_b\.md both are chapter '04'"):
        chapters(project.root)


def test_unknown_chapter_is_refused_with_the_nearest(project: Any) -> None:
    project.add("04", "1")
    with pytest.raises(InputError, match=r"no chapter '05' \(known: 04\); did you mean '04'\?"):
        chapter("05")
    with pytest.raises(InputError, match=r"did you mean '04'\?"):
        chapter("04_smal")
    with pytest.raises(InputError, match=r"\(known: 04\)\.$"):
        chapter("zzz")


def test_options_of_a_cell_that_are_not_yaml_are_refused(project: Any) -> None:
    project.add("04", "---\ntags: [\n---\n1")
    with pytest.raises(InputError, match="options that are not YAML"):
        _ = chapter("04").code
