"""Claims about the corners found from the curvature."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib import roads


def test_circuit_has_the_sixteen_corners_of_the_thesis(barcelona):
    found = roads.corners(barcelona)
    assert "".join(corner.direction for corner in found) == "RLRRLLLRRLLRRLRR"
    assert [corner.number for corner in found] == list(range(1, 17))


@pytest.mark.parametrize(("number", "thesis_m"), [(2, 800.0), (10, 3350.0)])
def test_corners_lie_where_the_thesis_has_them(barcelona, number, thesis_m):
    # the start line of the table is good to 15 m
    assert roads.corners(barcelona)[number - 1].s == pytest.approx(thesis_m, abs=15.0)


def test_sharpest_point_lies_inside_its_corner_and_nothing_in_it_is_sharper(barcelona):
    for corner in roads.corners(barcelona):
        assert corner.begin <= corner.s <= corner.end
        inside = np.abs(barcelona.curvature(np.arange(corner.begin, corner.end + 0.5)))
        assert abs(barcelona.curvature(corner.s)) == inside.max()
        assert inside.min() > 0.004
        assert corner.turned > np.radians(10.0)


def test_corner_across_the_start_is_found_once(barcelona):
    shift = 140  # stations: the start comes to lie in the first corner
    s = np.roll(barcelona.s, -shift) - barcelona.s[shift]
    rolled = replace(
        barcelona,
        s=np.where(s < 0.0, s + barcelona.length, s),
        station_curvature=np.roll(barcelona.station_curvature, -shift),
    )
    found, original = roads.corners(rolled), roads.corners(barcelona)
    assert len(found) == len(original)
    across = [corner for corner in found if corner.end > rolled.length]
    assert len(across) == 1
    assert across[0].turned == pytest.approx(original[0].turned, abs=0.06)


def test_higher_threshold_leaves_the_sharp_corners(barcelona):
    sharp = roads.corners(barcelona, threshold=0.025)
    assert {corner.direction for corner in sharp} == {"L", "R"}
    assert 1 < len(sharp) < 16
