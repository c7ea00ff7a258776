"""A chapter's parameters say what the published run has: the values of the data files."""

import numpy as np
import pytest

from thesislib.companion.chapters import chapter
from thesislib.companion.parameters import parameters
from thesislib.suspension import Axle, Metamodel, StiffnessMetamodel, surrogate
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


def test_defaults_of_chapter_3_are_the_springs_of_the_axles_and_the_meshes_of_the_tables():
    defaults = {p.name: p.default for p in parameters(chapter("03"))}
    tables = Metamodel.from_file(), StiffnessMetamodel.from_file()
    for name in ("front", "rear"):
        K_h = 1e3 * defaults[f"heave_{name}_kNpm"]
        assert Axle.from_file(f"{name}_axle").heave_stiffness == K_h == getattr(tables[1], f"nominal_{name}")
        heaviest = -1e3 * defaults[f"heaviest_{name}_kN"]
        assert all(getattr(table, f"heaviest_{name}") == heaviest for table in tables)


@pytest.mark.parametrize("name", ["front", "rear"])
@pytest.mark.parametrize("softest", [True, False])
def test_extremes_of_chapter_3_are_axles_that_can_move(name, softest):
    at = {p.name: p.low if softest else p.high for p in parameters(chapter("03"))}
    heaviest = -1e3 * max(p.high for p in parameters(chapter("03")) if p.name == f"heaviest_{name}_kN")
    axle = Axle.from_file(f"{name}_axle")
    extreme = axle.with_springs(
        heave_stiffness=1e3 * at[f"heave_{name}_kNpm"],
        torsion_stiffness=at["torsion_share"] * axle.torsion_stiffness,
        anti_roll_stiffness=at["anti_roll_share"] * axle.anti_roll_stiffness,
    )
    spread = max(p.high for p in parameters(chapter("03")) if p.name == "stiffness_spread")
    # a solution for every case, or an error that ends this test
    swept = surrogate.sweep(
        extreme, heaviest, points=5, stiffnesses=extreme.heave_stiffness * (1.0 + spread * np.array([-1, 1]))
    )
    assert np.all(np.isfinite(swept.height))
