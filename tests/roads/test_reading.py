"""Every way in which a road file is refused, with file, row and reason."""

import shutil

import pytest

from thesislib import provenance, roads


def edited(lines, row, column, value):
    """Return ``lines`` with one cell of a 1-based row of the file replaced."""
    cells = lines[row - 1].split(",")
    cells[column] = value
    return [*lines[: row - 1], ",".join(cells), *lines[row:]]


def test_circle_is_accepted(circle_lines, write_road):
    road = roads.load(write_road(circle_lines))
    assert road.name == "circle"
    assert road.closure().turns == 1


def test_unknown_name_is_answered_with_the_known_ones():
    with pytest.raises(FileNotFoundError, match=r"no road monza; known are .*barcelona"):
        roads.load("monza")
    assert "barcelona" in roads.names()


def test_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"no road file .*nowhere\.csv"):
        roads.load(tmp_path / "nowhere.csv")


def test_file_of_the_project_may_be_given_by_its_path(tmp_path, barcelona):
    copy = tmp_path / "copy.csv"
    shutil.copy(provenance.project_root() / "data" / "tracks" / "barcelona.csv", copy)
    assert roads.load(str(copy)).curvature(700.0) == barcelona.curvature(700.0)


@pytest.mark.parametrize(
    ("row", "column", "value", "reason"),
    [
        (9, 1, "nan", "row 9: curvature_1pm = nan is not finite"),
        (9, 1, "inf", "row 9: curvature_1pm = inf is not finite"),
        (12, 4, "east", "row 12: x_m = 'east' is not a number"),
        (12, 4, "", "row 12: x_m = '' is not a number"),
        (20, 0, "10.0", r"row 20: s_m = 10 does not exceed the 204\.\d+ before it"),
        (6, 0, "1.0", "row 6: s_m starts at 1, not at 0"),
        (45, 0, "700.0", r"row 45: s_m = 700 is not below period_m = 628\.319"),
        (30, 2, "-1.0", "row 30: w_right_m = -1 is not a positive width"),
        (30, 3, "0.0", "row 30: w_left_m = 0 is not a positive width"),
        (25, 4, "-13.0", r"row 25: the integrated curvature is .* m .* away from x_m, y_m, theta_rad"),
        (25, 6, "2.99", r"row 25: the integrated curvature is .* 0\.00\d+ rad away from x_m"),
        (8, 1, "0.0101", r"row \d+: the integrated curvature is .* away from x_m"),
    ],
)
def test_wrong_cell_is_refused_with_its_row_and_reason(circle_lines, write_road, row, column, value, reason):
    with pytest.raises(roads.RoadFileError, match=rf"^road\.csv, {reason}"):
        roads.load(write_road(edited(circle_lines, row, column, value)))


def test_period_that_disagrees_with_closure_by_two_centimetres_is_refused(circle_lines, write_road):
    longer = [line.replace("628.318531", "628.338531") for line in circle_lines]
    assert longer != circle_lines
    with pytest.raises(roads.RoadFileError, match=r"row 45: with period_m = 628\.339 the lap ends 0\.02"):
        roads.load(write_road(longer))


def test_open_road_is_refused(circle_lines, write_road):
    half = [*circle_lines[:25]]
    half[1] = "# period_m: 314.159265"
    with pytest.raises(roads.RoadFileError, match=r"row 25: .* the lap ends 200 m"):
        roads.load(write_road(half))


def test_missing_column_is_named(circle_lines, write_road):
    without = [line.replace("curvature_1pm", "kappa") for line in circle_lines]
    with pytest.raises(roads.RoadFileError, match=r"road\.csv, row 5: missing column curvature_1pm\."):
        roads.load(write_road(without))


def test_row_with_too_few_values_is_refused(circle_lines, write_road):
    short = [*circle_lines[:10], "1.0,2.0", *circle_lines[11:]]
    with pytest.raises(roads.RoadFileError, match="row 11: 2 values under 7 columns"):
        roads.load(write_road(short))


@pytest.mark.parametrize("key", ["period_m", "source", "licence"])
def test_head_without_a_required_line_is_refused(circle_lines, write_road, key):
    without = [line for line in circle_lines if not line.startswith(f"# {key}:")]
    with pytest.raises(roads.RoadFileError, match=f"head: the line '# {key}: …' is missing"):
        roads.load(write_road(without))


@pytest.mark.parametrize("period", ["long", "-5", "inf", "nan"])
def test_period_that_is_no_length_is_refused(circle_lines, write_road, period):
    lines = [f"# period_m: {period}" if line.startswith("# period_m") else line for line in circle_lines]
    with pytest.raises(
        roads.RoadFileError, match=r"head: period_m = '?\S+'? is not a (number|positive length)"
    ):
        roads.load(write_road(lines))


def test_file_without_stations_is_refused(circle_lines, write_road):
    with pytest.raises(roads.RoadFileError, match="0 stations"):
        roads.load(write_road(circle_lines[:5]))
