"""Claims about the axles that a reader can turn."""

import json
import re

from thesislib.suspension.linked import SCRIPT, turnable_axles


def test_turnable_axles_hold_every_joint_and_fetch_nothing(axles):
    scene = turnable_axles(axles["front"], axles["rear"], 3.4)
    joints = next(trace for trace in scene.traces if trace["name"] == "joints")
    assert len(joints["text"]) == len(set(joints["text"])) == 2 * 2 * 12
    page = scene._repr_html_()
    assert SCRIPT in page
    assert not re.search(r"https?://", page)
    json.dumps(scene.traces, allow_nan=False)


def test_same_axles_make_the_same_page(axles):
    pages = {turnable_axles(axles["front"], axles["rear"], 3.4)._repr_html_() for _ in range(2)}
    assert len(pages) == 1
    assert turnable_axles(axles["front"], axles["rear"], 3.3)._repr_html_() not in pages
