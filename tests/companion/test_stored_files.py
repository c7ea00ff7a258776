"""The stored and printed values of this repository follow the documented layout."""

import json
from pathlib import Path

import jsonschema

from thesislib.companion import chapters, checks, documents, pages
from thesislib.companion.checks import quantities
from thesislib.companion.tolerances import Tolerance

ROOT = Path(__file__).resolve().parents[2]


def test_the_schema_is_one() -> None:
    schema = json.loads((ROOT / "docs/record-schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    assert set(schema["required"]) == {"schema", "chapter", "figures", "tables", "values"}


def test_every_stored_file_belongs_to_a_chapter_and_follows_the_schema() -> None:
    schema = json.loads((ROOT / "docs/record-schema.json").read_text())
    known = {checks.stored_file(chapter): chapter.id for chapter in chapters.chapters(ROOT)}
    for path in (ROOT / "data/expected").glob("*.json"):
        stored = documents.read(path)
        jsonschema.validate(stored, schema)
        assert stored["chapter"] == known[path]


def test_every_stored_tolerance_counts() -> None:
    for path in (ROOT / "data/expected").glob("*.json"):
        for name, entry in quantities(documents.read(path)).items():
            if isinstance(entry, dict) and "tolerance" in entry:
                tolerance = Tolerance.read(entry["tolerance"], checks.numbers(entry))
                assert tolerance.reason.strip().endswith("."), f"{path.name}, {name}: one sentence"


def test_every_printed_value_has_unit_half_digit_and_place() -> None:
    printed = list((ROOT / "data/thesis").glob("*.json"))
    assert printed
    for path in printed:
        assert pages.thesis_values(ROOT, path.stem), path.name
