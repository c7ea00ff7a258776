"""The linked figure is small, self-contained, and says what it needs when it cannot draw."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from thesislib.lap import channels
from thesislib.lap.linked import linked_lap


@pytest.fixture(scope="module")
def html(synthetic_lap, corners):
    return linked_lap(synthetic_lap, corners)._repr_html_()


def plotted(html):
    """The data as the page's script reads it."""
    return json.loads(re.search(r"const lap = (\{.*?\});\n", html).group(1))


def test_it_adds_less_than_100_kB_to_a_page(html):
    assert 10_000 < len(html.encode()) < 100_000


def test_its_only_outside_file_is_the_shared_script_beside_the_page(html):
    assert "//" not in re.sub(r"^\s*//.*$|\s// .*$", "", html, flags=re.MULTILINE)
    assert re.findall(r"\.src = \"(.*?)\"", html) == ["plotly/plotly.min.js"]
    assert "src=" not in html


def test_trace_and_map_are_of_the_same_points_of_the_lap(html, synthetic_lap):
    data = plotted(html)
    s = np.array(data["s"])
    assert all(len(data[name]) == len(s) == 700 for name in "stvxy")
    v = np.interp(s, synthetic_lap.s, 3.6 * channels.speed(synthetic_lap), period=synthetic_lap.track.length)
    n = np.interp(s, synthetic_lap.s, synthetic_lap["n"], period=synthetic_lap.track.length)
    x, y = channels.beside(synthetic_lap.track, s, n)
    # rounded to 0.1 m and 0.1 km/h, at a distance that is itself rounded to 0.1 m
    np.testing.assert_allclose(data["v"], v, atol=0.15)
    np.testing.assert_allclose(data["x"], x, atol=0.11)
    np.testing.assert_allclose(data["y"], y, atol=0.11)


def test_elapsed_time_grows_from_nought_to_the_lap_time(html, synthetic_lap):
    t = np.array(plotted(html)["t"])
    assert t[0] == 0.0
    assert np.all(np.diff(t) > 0.0)
    assert synthetic_lap.time - 0.5 < t[-1] < synthetic_lap.time


def test_every_corner_is_numbered_on_both_panels(html, corners):
    numbered = plotted(html)["corners"]
    assert [(corner["number"], corner["s"]) for corner in numbered] == [
        (n, round(s, 1)) for n, s, _ in corners
    ]
    assert all({"x", "y", "row"} <= corner.keys() for corner in numbered)


def test_a_sentence_stands_until_the_script_has_drawn(html):
    before_script = html[: html.index("<script>")]
    assert "need JavaScript" in before_script
    assert "display:none" in before_script[before_script.index("linked-lap-panels") :]


def test_panels_slider_and_group_are_named_for_screen_readers(html, synthetic_lap):
    assert html.count("aria-label=") == 3
    assert f"lap time {synthetic_lap.time:.2f} s" in re.search(
        r'role="group" aria-label="(.*?)"', html
    ).group(1)
    assert re.search(r"<label.*?<input type=\"range\"", html, flags=re.DOTALL)


def test_the_same_lap_gives_the_same_page(synthetic_lap, corners, html):
    assert linked_lap(synthetic_lap, corners)._repr_html_() == html


def test_two_laps_on_one_page_do_not_share_a_name(synthetic_lap, html):
    other = linked_lap(synthetic_lap)._repr_html_()
    name = re.compile(r'<div id="(.*?)"')
    assert name.search(other).group(1) != name.search(html).group(1)


def test_a_plain_terminal_gets_a_sentence(synthetic_lap):
    assert repr(linked_lap(synthetic_lap)).endswith("an interactive figure for a page")


@pytest.mark.parametrize("points", [50, 5000])
def test_too_few_or_too_many_points_are_refused(synthetic_lap, points):
    with pytest.raises(ValueError, match=rf"{points} points is outside 100 \.\. 2000"):
        linked_lap(synthetic_lap, points=points)
