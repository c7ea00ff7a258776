"""Claims about parameter sets: what they hold and what they refuse."""

import math
import pickle

import pytest

from thesislib.vehicles import ParameterSet

ENTRY = """
[mass]
value = 660.0
unit = "kg"
symbol = "M"
description = "Vehicle mass"
source = "Table C.1"
range = [400.0, 1200.0]
"""


@pytest.fixture
def write_set(tmp_path):
    def write(text):
        path = tmp_path / "set.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_values_are_in_si_whatever_the_source_prints():
    car, tyre = ParameterSet.from_file("racing_car"), ParameterSet.from_file("racing_tyre", "tyres")
    hybrid = ParameterSet.from_file("hybrid_car")
    assert (car["P_max"].value, car["P_max"].unit) == (560e3, "W")
    assert car["h_f_nominal"].value == pytest.approx(-0.014)
    assert tyre["alpha_1"].value == pytest.approx(math.radians(9.0))
    assert tyre["alpha_1"].quoted(tyre["alpha_1"].value) == pytest.approx(9.0, rel=1e-15)
    assert hybrid["E_b_max"].value == 5e6
    assert hybrid["SoC_min"].value == 0.4


def test_every_parameter_of_the_project_is_inside_its_range_and_says_where_it_is_from():
    sets = [ParameterSet.from_file(name) for name in ("racing_car", "racing_car_aerodynamics", "hybrid_car")]
    for one in [*sets, ParameterSet.from_file("racing_tyre", "tyres")]:
        for parameter in one.parameters:
            assert parameter.low <= parameter.value <= parameter.high
            assert parameter.source
            assert parameter.description


def test_replacing_a_value_leaves_the_original_alone():
    car = ParameterSet.from_file("racing_car")
    heavier = car.replace(mass=700, P_max=571e3)
    assert heavier.values["mass"] == 700.0
    assert heavier.values["P_max"] == 571e3
    assert car.values["mass"] == 660.0
    assert list(heavier.values) == list(car.values)


def test_set_survives_pickling_to_another_process():
    car = ParameterSet.from_file("racing_car")
    assert pickle.loads(pickle.dumps(car)) == car


def test_unknown_name_is_refused_with_the_nearest_one():
    with pytest.raises(KeyError, match="racing_car has no parameter maas; did you mean mass"):
        ParameterSet.from_file("racing_car").replace(maas=700.0)
    with pytest.raises(KeyError, match="racing_car has no parameter zzz; known are P_max, mass"):
        ParameterSet.from_file("racing_car").replace(zzz=1.0)


@pytest.mark.parametrize("value", [399.9, 1200.1, math.inf, math.nan])
def test_value_out_of_range_is_refused_with_range_meaning_and_source(value):
    sentence = r"mass = \S+ kg is outside 400 \.\. 1200 kg \(vehicle mass with driver, Table C\.1\)"
    with pytest.raises(ValueError, match=sentence):
        ParameterSet.from_file("racing_car").replace(mass=value)


@pytest.mark.parametrize("value", ["700", None, True])
def test_value_that_is_no_number_is_refused(value):
    with pytest.raises(TypeError, match=r"mass = .* is not a number"):
        ParameterSet.from_file("racing_car").replace(mass=value)


def test_unknown_set_is_answered_with_the_known_ones(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"no parameter set bus.*known are .*racing_car"):
        ParameterSet.from_file("bus")
    with pytest.raises(FileNotFoundError, match=r"no parameter file .*bus\.toml"):
        ParameterSet.from_file(tmp_path / "bus.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('source = "Table C.1"\n', "", r"set\.toml, \[mass\]: source missing"),
        ('symbol = "M"', 'symbol = "M"\ncolour = "red"', r"\[mass\]: unknown key colour"),
        ('unit = "kg"', 'unit = "stone"', r"\[mass\]: unknown unit 'stone'"),
        ("value = 660.0", "value = 60.0", r"\[mass\]: value 60 is outside its own range 400 \.\. 1200"),
        ("value = 660.0", 'value = "660"', r"\[mass\]: value and range must be"),
        ("value = 660.0", "value = nan", r"\[mass\]: value and range must be"),
        ("[400.0, 1200.0]", "[400.0]", r"\[mass\]: value and range must be"),
        ("[mass]", "mass = 3\n[other]", r"\[mass\]: a parameter is a table"),
        ("value = 660.0", "value = ", r"set\.toml is not a TOML file"),
    ],
)
def test_wrong_entry_is_refused_with_file_and_name(write_set, old, new, message):
    assert old in ENTRY
    with pytest.raises(ValueError, match=message):
        ParameterSet.from_file(write_set(ENTRY.replace(old, new)))


def test_two_sets_with_the_same_name_in_them_are_not_joined(write_set):
    one = ParameterSet.from_file(write_set(ENTRY))
    with pytest.raises(ValueError, match="mass is defined twice in the parameter set both"):
        ParameterSet.union("both", [one, one])
