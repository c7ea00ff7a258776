"""What belongs to the machine does not reach a page."""

from pathlib import Path

from nbformat.v4 import new_output

from thesislib.companion.publication import machine_paths, without_paths

HIDDEN = {"/home/ann": "~", "/home/ann/thesis": ".", "/home/ann/thesis/.venv": "[environment]"}


def test_longest_folder_name_is_replaced_first() -> None:
    text = "/home/ann/thesis/.venv/lib/a.py, /home/ann/thesis/data/b.csv, /home/ann/c"
    assert without_paths(text, HIDDEN) == "[environment]/lib/a.py, ./data/b.csv, ~/c"


def test_folder_with_a_longer_name_is_another_folder() -> None:
    for other in ("/home/anna/x", "/home/ann-2/x", "/media/home/ann/x"):
        assert without_paths(other, HIDDEN) == other


def test_nothing_to_hide_changes_nothing() -> None:
    assert without_paths("/home/ann/x", {}) == "/home/ann/x"


def test_names_are_replaced_at_every_depth_of_an_output() -> None:
    output = new_output("display_data", data={"application/json": {"files": ["/home/ann/a", 1, None]}})
    assert without_paths(output, HIDDEN).data["application/json"] == {"files": ["~/a", 1, None]}


def test_encoded_picture_is_left_alone_and_a_drawn_one_is_not() -> None:
    data = {"image/png": "AAAA /home/ann/ AAAA", "image/svg+xml": "<svg><desc>/home/ann/a</desc></svg>"}
    published = without_paths(new_output("display_data", data=data), HIDDEN).data
    assert published["image/png"] == data["image/png"]
    assert published["image/svg+xml"] == "<svg><desc>~/a</desc></svg>"


def test_project_folder_is_hidden_and_folders_that_name_nobody_are_not(tmp_path: Path) -> None:
    hidden = machine_paths(tmp_path)
    assert hidden[str(tmp_path)] == "."
    assert "/" not in hidden
    assert "/usr" not in hidden
