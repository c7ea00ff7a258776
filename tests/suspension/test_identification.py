"""Claims about the axles behind Table 3.1: that they have its slopes, and what the table cannot tell."""

import numpy as np
import pytest

from thesislib.suspension import Metamodel, WheelLoads, identification, surrogate
from thesislib.suspension.identification import SLOPES, Slopes
from thesislib.suspension.reduced import ReducedAxle

DIGITS = {"front": Slopes(1e-3, 1e-5, 1e-4, 1e-5, 1e-7), "rear": Slopes(1e-4, 1e-5, 1e-4, 1e-5, 1e-8)}
# of the ride-height slopes and of the linear roll slope, relative
WITHIN = {"front": 1e-3, "rear": 2e-3}
# between the mechanism's ride heights and the table's over the whole mesh, m
SURFACE = {"front": 0.15e-3, "rear": 0.1e-3}


@pytest.fixture(scope="module")
def table(which):
    return getattr(Metamodel.from_file(rear_constant="text"), which)


@pytest.fixture(scope="module")
def target(table):
    h = [table.coefficient("h", *powers) for powers in ((1, 0), (2, 0), (1, 1))]
    return Slopes(*h, *(table.coefficient("phi", *powers) for powers in ((1, 0), (2, 0))))


@pytest.fixture(scope="module")
def data(reduced, heaviest):
    return surrogate.sweep(reduced, heaviest)


def test_axle_of_the_file_has_the_slopes_of_table_3_1(data, target, which):
    model = surrogate.fitted(data)
    found = [model.coefficient("h", *powers) for powers in ((1, 0), (2, 0), (1, 1))]
    np.testing.assert_allclose(found, target[:3], rtol=WITHIN[which])
    assert model.coefficient("phi", 1, 0) == pytest.approx(target.phi_F, rel=1e-3)


def test_axle_of_the_file_has_the_ride_heights_of_table_3_1(data, table, which):
    assert surrogate.misfit(table, data).height < SURFACE[which]


def test_slopes_of_a_coarse_mesh_are_those_of_a_fine_one(axle, heaviest):
    coarse, fine = (identification.slopes(axle, heaviest, points) for points in (11, 31))
    np.testing.assert_allclose(coarse, fine, rtol=3e-3)


def test_moved_axle_still_stands_at_its_nominal_height(axle, at_rest, nominal):
    other = identification.moved(axle, {"spring_arm_angle": 0.1, "pivot_z": -0.1}, at_rest, nominal)
    standing = ReducedAxle(other).solve(WheelLoads.of(at_rest, at_rest))
    assert standing.height[0] == pytest.approx(nominal, abs=1e-9)
    np.testing.assert_allclose(standing.travel, 0.0, atol=1e-9)


def test_identification_from_elsewhere_finds_the_slopes_with_other_numbers(
    axle, target, heaviest, at_rest, nominal
):
    free = (
        "torsion_stiffness",
        "anti_roll_stiffness",
        "heave_hardening",
        "spring_arm_length",
        "spring_arm_angle",
    )
    elsewhere = dict(zip(free, (0.15, -0.1, 0.3, 0.06, -0.05), strict=True))
    start = identification.moved(axle, elsewhere, at_rest, nominal)
    found = identification.identify(start, target, free, heaviest=heaviest, load=at_rest, height=nominal)
    np.testing.assert_allclose(found.slopes[:4], target[:4], rtol=1e-3)
    assert abs(found.axle.torsion_stiffness / axle.torsion_stiffness - 1.0) > 0.05


def test_numbers_that_cannot_reach_the_slopes_are_refused(axle, target, heaviest, at_rest, nominal):
    twice = Slopes(*(2.0 * one for one in target))
    with pytest.raises(
        ValueError, match=r"stays .* away .* the free numbers anti_roll_stiffness cannot reach it"
    ):
        identification.identify(
            axle, twice, ("anti_roll_stiffness",), heaviest=heaviest, load=at_rest, height=nominal
        )


def test_table_fixes_four_numbers_of_ten(axle, which, heaviest, at_rest, nominal):
    known = identification.identifiability(
        axle, DIGITS[which], heaviest=heaviest, load=at_rest, height=nominal
    )
    assert known.derivatives.shape == (len(SLOPES), len(identification.FREE))
    assert known.rank == 4
    assert np.all(np.diff(known.singular_values) <= 0.0)


def test_unknown_number_is_refused(axle, at_rest, nominal):
    with pytest.raises(ValueError, match="caster cannot be identified; there are torsion_stiffness"):
        identification.moved(axle, {"caster": 0.1}, at_rest, nominal)
