"""The chapter's settings."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib.companion.chapters import InputError, chapter
from thesislib.companion.parameters import changed_values, parameters
from thesislib.stability.cases import Setting, map_case
from thesislib.stability.phase_plane import true_region
from thesislib.vehicles import ParameterSet

NUMBERS = {"speed_mps": "u_0", "mass_kg": "mass", "inertia_kgm2": "I_z", "mass_centre_m": "a"}


def test_defaults_of_the_chapter_are_table_7_1():
    table = ParameterSet.from_file("bicycle").values
    defaults = {p.name: p.default for p in parameters(chapter("07"))}
    for name, number in NUMBERS.items():
        assert defaults[name] == table[number]
    assert Setting() == Setting(**{number: table[number] for number in NUMBERS.values()})


def test_cars_at_the_ends_of_the_chapter_s_ranges_have_a_region():
    names = NUMBERS | {"front_factor": "front", "rear_factor": "rear"}
    for parameter in parameters(chapter("07")):
        for end in (parameter.low, parameter.high):
            if parameter.name in names:
                true_region(replace(Setting(), **{names[parameter.name]: end}).rational())


def test_moving_the_mass_centre_keeps_the_wheelbase():
    assert Setting(a=1.3).rational().wheelbase == pytest.approx(2.5, abs=1e-12)


def test_a_force_factor_scales_force_and_stiffness_alike():
    weak, full = Setting(rear=0.9).magic().rear, Setting().magic().rear
    alpha = np.linspace(-0.4, 0.4, 9)
    assert np.allclose(weak.force(alpha), 0.9 * full.force(alpha), rtol=1e-14)
    assert weak.slope(0.0) == pytest.approx(0.9 * full.slope(0.0), rel=1e-14)


def test_an_odd_degree_is_refused_before_anything_is_computed():
    with pytest.raises(InputError, match=r"degree = 7 is not one of \{4 \| 6 \| 8\}"):
        changed_values(chapter("07"), {"degree": "7"})


@pytest.mark.parametrize(
    ("delta_deg", "reason"),
    [(2.0, "No level set of the first quadratic V can be certified"), (4.0, "has no stable equilibrium")],
)
def test_a_point_of_a_map_without_a_region_says_why(delta_deg, reason):
    point = map_case(2, 1, u_0=25.0, delta_deg=delta_deg)
    assert point["area"] == 0.0
    assert reason in point["reason"]
