"""A chapter's parameters say what the published run has: the values of the data files."""

import pytest

from thesislib.companion.chapters import chapter
from thesislib.companion.parameters import parameters
from thesislib.suspension import Metamodel
from thesislib.vehicles import RacingCar

# parameter of a chapter: the car's number, and how many of its SI units the parameter's unit is
NUMBERS = {
    "mass_kg": ("mass", 1.0),
    "engine_power_kW": ("P_max", 1e3),
    "power_kw": ("P_max", 1e3),
    "frontal_area_m2": ("frontal_area", 1.0),
    "mass_centre_m": ("a", 1.0),
}


@pytest.mark.parametrize("name", ["04", "C"])
def test_defaults_of_a_chapter_are_the_numbers_of_the_data_files(name):
    values = RacingCar.from_file(ride=Metamodel.from_file()).values
    found = {p.name: p for p in parameters(chapter(name)) if p.name in NUMBERS}
    assert len(found) == 4
    for parameter in found.values():
        number, unit = NUMBERS[parameter.name]
        assert parameter.default * unit == values[number]
        # the extremes of the range are cars that can be built
        for extreme in (parameter.low, parameter.high):
            RacingCar.from_file(ride=Metamodel.from_file(), **{number: extreme * unit})
