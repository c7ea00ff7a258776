"""The README: what it shows runs, what it names exists, what it quotes is said."""

import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from thesislib import ocp
from thesislib.__main__ import main
from thesislib.companion.chapters import chapter
from thesislib.companion.checks import misses
from thesislib.companion.parameters import changed_values, split_assignments

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PICTURE = ROOT / "docs" / "chain.svg"
CYCLOID_S = 0.8243386694  # through (2, 2) m: (theta - sin theta)/(1 - cos theta) = 1, T = theta sqrt(r/g)


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def code() -> str:
    """All that the README sets in code: spans and shell blocks, without the shell's comments."""
    spans = re.findall(r"(?<!`)`([^`]+)`(?!`)", re.sub(r"```.*?```", "", README, flags=re.DOTALL))
    lines = [line.partition("#")[0] for block in blocks("bash") for line in block.splitlines()]
    return "\n".join([*spans, *lines])


def thesis_commands() -> list[list[str]]:
    return [line.split() for line in re.findall(r"(?:^|/)thesis (.+)", code(), re.MULTILINE)]


def test_script_is_short_and_finds_the_time_of_the_cycloid(capsys: pytest.CaptureFixture[str]) -> None:
    (script,) = blocks("python")
    assert len(script.splitlines()) < 25
    names: dict[str, object] = {}
    exec(compile(script, "README.md", "exec"), names)
    solution = names["solution"]
    assert isinstance(solution, ocp.Solution)
    # 1e-10: the ten digits that the README prints; the optimality asked for is ten times finer
    assert solution.objective == pytest.approx(CYCLOID_S, abs=1e-10)
    assert capsys.readouterr().out.startswith(f"{CYCLOID_S} s")
    assert f"prints {CYCLOID_S} s" in README
    # T goes as the root of 1/g; the multipliers are as good as the optimality on this mesh
    worth = ocp.sensitivity.sensitivity(solution)["g"]
    assert worth == pytest.approx(-solution.objective / (2 * 9.81), rel=1e-6)
    assert len(solution.costate("v")) == len(solution["v"])


def test_every_target_it_names_is_in_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    named = set(re.findall(r"\bmake ([a-z0-9-]+)", code()))
    targets = set(re.findall(r"^([a-z0-9-]+):.*## ", makefile, re.MULTILINE))
    assert {"book", "test"} <= named <= targets


def test_every_command_it_names_is_there_with_its_options(capsys: pytest.CaptureFixture[str]) -> None:
    commands = thesis_commands()
    assert {command for command, *_ in commands} >= {"list", "run", "accept"}
    for command, *words in commands:
        with pytest.raises(SystemExit) as end:
            main([command, "--help"])
        assert end.value.code == 0, command
        said = capsys.readouterr().out
        for option in (word for word in words if word.startswith("--")):
            assert option in said, f"thesis {command} {option}"


def test_changed_runs_it_proposes_are_accepted() -> None:
    proposed = [split_assignments(words) for command, *words in thesis_commands() if command == "run"]
    changed = [(name, texts) for (name, *_), texts in proposed if texts]
    assert {parameter for _, texts in changed for parameter in texts} == {
        "mass_kg",
        "engine_power_kW",
        "mass_centre_m",
        "row",
        "front_height_mm",
    }
    for name, texts in changed:
        values = changed_values(chapter(name), texts)
        numbers = {parameter: float(text) for parameter, text in texts.items() if parameter != "row"}
        assert values == numbers | ({"row": texts["row"]} if "row" in texts else {})


@pytest.mark.parametrize("wish", ["mas_kg=700", "mass_kg=heavy"])
def test_refusals_it_quotes_are_said(wish: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "04", wish]) == 2
    assert capsys.readouterr().err in "".join(blocks("text"))


def test_misses_it_quotes_are_in_the_words_of_the_check(tmp_path: Path) -> None:
    # drag grows with the square of the speed: one per cent more is out from 10 m/s on
    speeds = [0.5 * i for i in range(201)]
    record, stored = (
        {
            "figures": {"straight-line": {"series": {"drag": _drag(speeds, force, tolerance)}}},
            "values": {"top_speed": {"value": top, "unit": "km/h", **_limit(0.031, tolerance)}},
        }
        for force, top, tolerance in ((8.6492259, 311.438833, False), (8.56359, 312.473521, True))
    )
    said = "".join(f"C {miss}\n" for miss in misses(record, stored, tmp_path))
    assert said == blocks("text")[1]


def _drag(speeds: list[float], force: float, tolerance: bool) -> dict[str, object]:
    ordinate = [force * (u / speeds[-1]) ** 2 for u in speeds]
    entry = {"abscissa": speeds, "ordinate": ordinate, "abscissa_unit": "m/s", "unit": "kN"}
    return entry | _limit(0.00086, tolerance)


def _limit(absolute: float, wanted: bool) -> dict[str, object]:
    if not wanted:
        return {}
    return {"tolerance": {"absolute": absolute, "relative": 0.0, "reason": "As in the README."}}


def test_every_file_and_heading_it_links_exists() -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]*)(?:#([^)]+))?\)", README)
    assert len(links) > 5
    for path, anchor in links:
        assert (ROOT / path).exists(), path
        if anchor:
            headings = re.findall(r"^#+ (.+)", (ROOT / path).read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in [heading.lower().replace(" ", "-") for heading in headings]


def test_every_folder_it_names_exists_or_is_made() -> None:
    named = {span for span in code().split() if re.fullmatch(r"[\w.]+(/[\w.]+)*/", span)}
    assert {"book/", "src/thesislib/", "data/tracks/", "_build/"} <= named
    missing = {name for name in named if not (ROOT / name).is_dir()}
    assert all(name.startswith(("_build/", "data/expected/")) for name in missing), missing


def test_versions_of_python_are_those_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["requires-python"] == ">=3.11,<3.14"
    assert "Python 3.11, 3.12 or 3.13" in README


def test_picture_reads_in_light_and_dark_and_asks_no_server() -> None:
    text = PICTURE.read_text(encoding="utf-8")
    root = ElementTree.fromstring(text)
    space = "{http://www.w3.org/2000/svg}"
    assert root.find(f"{space}title") is not None and root.find(f"{space}desc") is not None
    light, _, dark = text.partition("@media (prefers-color-scheme: dark)")
    for painted in ("sheet", "box", "side", "command", "word", "small", "line"):
        assert f".{painted} {{" in light and f".{painted} {{" in dark, painted
    assert re.findall(r"https?://[^\"]+", text) == ["http://www.w3.org/2000/svg"]
