"""The built site: nothing fetched, nothing of this machine, nothing that failed.

These tests look at `_build/html` as `make test` has just built it. Without it they fail.
"""

import re
import tempfile
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
HTML = ROOT / "_build" / "html"

pytestmark = pytest.mark.book

# Names under which a page could ask a server for something. Links to read are the reader's own choice.
FETCHED = {
    ("script", "src"),
    ("link", "href"),
    ("img", "src"),
    ("img", "srcset"),
    ("iframe", "src"),
    ("source", "src"),
    ("video", "src"),
    ("audio", "src"),
    ("embed", "src"),
    ("object", "data"),
    ("use", "href"),
}
SERVER = re.compile(r"^\s*(https?:)?//", re.IGNORECASE)


class Element(NamedTuple):
    tag: str
    attributes: dict[str, str | None]


class Elements(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[Element] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append(Element(tag, dict(attrs)))


@cache
def text(page: Path) -> str:
    return page.read_text(encoding="utf-8")


@cache
def elements(page: Path) -> list[Element]:
    parser = Elements()
    parser.feed(text(page))
    return parser.found


def pages() -> list[Path]:
    found = sorted(HTML.glob("*.html"))
    assert found, f"{HTML} has no pages: `make test` builds them before it tests them."
    return found


def chapters() -> list[str]:
    contents = yaml.safe_load((ROOT / "_toc.yml").read_text(encoding="utf-8"))
    return [contents["root"], *(entry["file"] for entry in contents["chapters"])]


def test_every_page_of_the_contents_is_there() -> None:
    missing = {f"{name}.html" for name in chapters()} - {page.name for page in pages()}
    assert not missing


def test_no_page_fetches_anything_from_a_server() -> None:
    fetched = [
        f"{page.name}: <{tag} {name}={value}>"
        for page in pages()
        for tag, attributes in elements(page)
        for name, value in attributes.items()
        if (tag, name) in FETCHED and value and SERVER.match(value)
    ]
    assert not fetched


def test_no_style_sheet_fetches_anything_from_a_server() -> None:
    sheets = sorted(HTML.rglob("*.css"))
    assert sheets
    asked = re.compile(r"""url\(\s*['"]?\s*(?:https?:)?//|@import\s+['"](?:https?:)?//""", re.IGNORECASE)
    assert not [sheet.name for sheet in sheets if asked.search(sheet.read_text(encoding="utf-8"))]


def test_every_local_file_that_a_page_loads_is_there() -> None:
    missing = []
    for page in pages():
        for tag, attributes in elements(page):
            for name, value in attributes.items():
                local = (tag, name) in FETCHED and value and not re.match(r"[a-z]+:|//|#", value)
                if local and not (page.parent / re.split(r"[?#]", str(value))[0]).is_file():
                    missing.append(f"{page.name}: <{tag} {name}={value}>")
    assert not missing


def test_every_picture_says_in_words_what_it_shows() -> None:
    silent = [
        f"{page.name}: {attributes.get('src')}"
        for page in pages()
        for tag, attributes in elements(page)
        # Without a text of its own, docutils writes the picture's address in its place.
        if tag == "img" and (attributes.get("alt") or "") in ("", attributes.get("src"))
    ]
    assert not silent


def test_no_page_shows_a_failed_run() -> None:
    words = ("An Exception was encountered", "Traceback (most recent call last)", "papermill-error")
    assert not [f"{page.name}: {word}" for page in pages() for word in words if word in text(page)]


def test_no_page_shows_standard_error_or_bookkeeping() -> None:
    words = ('class="output stderr', "thesis-bookkeeping", "injected-parameters")
    assert not [f"{page.name}: {word}" for page in pages() for word in words if word in text(page)]


def test_no_published_file_names_a_folder_of_this_machine() -> None:
    private = [str(path) for path in (ROOT, Path.home(), Path(tempfile.gettempdir())) if len(path.parts) > 1]
    named = re.compile("|".join(rf"(?<![\w.-]){re.escape(path)}(?![\w.-])" for path in private))
    written = [*pages(), HTML / "searchindex.js", *sorted((HTML / "_sources").rglob("*.*"))]
    assert not [f"{file.name}: {found[0]}" for file in written if (found := named.search(text(file)))]


def test_no_equation_has_its_number_where_mathjax_refuses_it() -> None:
    split = re.compile(r"\\begin\{split\}(?:(?!\\end\{split\}).)*\\tag", re.DOTALL)
    assert not [page.name for page in pages() if split.search(text(page))]


def test_sphinx_counts_nothing_beside_the_numbers_of_the_thesis() -> None:
    counted = ('class="caption-number"', 'class="section-number"', 'class="eqno"')
    assert not [f"{page.name}: {word}" for page in pages() for word in counted if word in text(page)]


def test_mathematics_is_rendered_by_the_script_beside_the_pages() -> None:
    with_mathematics = [page for page in pages() if 'class="math notranslate' in text(page)]
    assert with_mathematics
    for page in with_mathematics:
        sources = [attributes.get("src") or "" for tag, attributes in elements(page) if tag == "script"]
        assert any("/mathjax/tex-chtml-full.js" in source for source in sources), page.name


def test_plotly_lies_beside_the_pages_that_ask_for_it_and_others_do_not_load_it() -> None:
    script = "plotly/plotly.min.js"
    asking = [page for page in pages() if script in text(page)]
    assert [page for page in pages() if "Plotly." in text(page)] == asking
    assert (HTML / script).is_file() == bool(asking)


def test_search_index_knows_every_page() -> None:
    index = text(HTML / "searchindex.js")
    assert not [name for name in chapters() if f'"{name}"' not in index]
