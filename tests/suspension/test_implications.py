"""Claims about what the published tables imply, and about the yardsticks they are held to."""

import numpy as np
import pytest

from thesislib.suspension import Metamodel, StiffnessMetamodel, surrogate
from thesislib.suspension.implications import reciprocity, spring_sensitivity
from thesislib.suspension.surrogate import Sweep, fitted
from thesislib.suspension.tyre import loaded_radius

HALF_TRACK = 0.73


def test_no_axle_of_springs_has_the_roll_angles_and_heights_of_table_3_1():
    table = Metamodel.from_file()
    front, rear = reciprocity(table.front, HALF_TRACK), reciprocity(table.rear, HALF_TRACK)
    # by hand: (0.1126 + 2 * 0.08324) / (2 * 2.562e-4) = 545 mm, (0.1119 + 0.189) / (2 * 6.134e-5) = 2453 mm
    assert (front.half_track, rear.half_track) == pytest.approx((0.5447, 2.4527), abs=1e-4)
    assert (front.ratio, rear.ratio) == pytest.approx((1.340, 0.298), abs=1e-3)


def test_mechanism_is_reciprocal_but_for_the_contacts_sideways_motion(reduced, heaviest):
    model = fitted(surrogate.sweep(reduced, heaviest, points=15))
    assert reciprocity(model, HALF_TRACK).ratio == pytest.approx(1.0, abs=0.07)


def springs_in_parallel(other, own):
    """A sweep of an axle whose suspension has the heave rate `other` + `own` K_h per wheel."""
    load, K_h = np.linspace(0.0, -6e3, 7), np.linspace(0.9e6, 1.1e6, 5)
    F_l, F_r, K = np.meshgrid(load, load, K_h, indexing="ij")
    mean = 0.5 * (F_l + F_r)
    height = -mean / (other + own * K) - 0.5 * (loaded_radius(F_l) + loaded_radius(F_r))
    return fitted(Sweep(F_l, F_r, K, height, 0.0 * F_l))


@pytest.mark.parametrize(("other", "own", "ratio"), [(0.0, 1.0, 1.0), (5e5, 0.5, 0.5), (1e6, 1e-9, 0.0)])
def test_springs_sensitivity_is_their_share_of_the_rate(other, own, ratio):
    found = spring_sensitivity(springs_in_parallel(other, own), -3000.0, 1e6)
    # a quadratic in K_h follows 1 / (k + m K_h) over ten per cent to about one per cent
    assert found.ratio == pytest.approx(ratio, abs=0.02)
    assert found.compliance == pytest.approx(1.0 / (other + own * 1e6), rel=0.02)


def test_spring_of_table_3_2_is_stronger_than_one_can_be():
    table = StiffnessMetamodel.from_file()
    front, rear = (
        spring_sensitivity(table.front, -3000.0, 1.0e6),
        spring_sensitivity(table.rear, -4000.0, 0.65e6),
    )
    assert (front.ratio, rear.ratio) == pytest.approx((1.72, 1.29), abs=0.01)
    assert front.change == pytest.approx(1.954e-12, rel=1e-12)  # twice the printed 9.77e-4
