"""Parameters are read without executing them, and refused with one sentence."""

from typing import Any

import pytest

from thesislib.companion.chapters import InputError
from thesislib.companion.parameters import Parameter, changed_values, parameters, split_assignments

CELL = """\
# the car
mass_kg: float = 660.0  # 400 .. 1200, vehicle mass with driver (Table C.1)
laps: int = 1_0  # 1 .. 20, number of laps
offset: float = -5  # -1.5e1 .. +.5, front ride height

track: str = "barce#lona"  # {barce#lona | monza}, centre line to follow
rigid: bool = False  # whether the suspension is locked
"""


def read(project: Any, cell: str) -> tuple[Parameter, ...]:
    project.add("04", "1", parameters=cell)
    return parameters(project.chapter("04"))


def test_a_parameters_cell_is_read_whole(project: Any) -> None:
    mass, laps, offset, track, rigid = read(project, CELL)
    description = "vehicle mass with driver (Table C.1)"
    assert mass == Parameter("mass_kg", "float", 660.0, description, 400.0, 1200.0)
    assert laps == Parameter("laps", "int", 10, "number of laps", 1.0, 20.0)
    assert (offset.default, offset.low, offset.high) == (-5.0, -15.0, 0.5)
    assert isinstance(offset.default, float)
    assert (track.default, track.choices) == ("barce#lona", ("barce#lona", "monza"))
    assert rigid == Parameter("rigid", "bool", False, "whether the suspension is locked")
    assert [each.allowed for each in (mass, track, rigid)] == [
        "400 .. 1200",
        "{barce#lona | monza}",
        "{true | false}",
    ]


def test_a_whole_number_may_have_choices(project: Any) -> None:
    (degree,) = read(project, "degree: int = 8  # {4 | 6 | 8}, degree of V")
    assert degree == Parameter("degree", "int", 8, "degree of V", choices=(4, 6, 8))
    assert degree.allowed == "{4 | 6 | 8}"
    assert changed_values(project.chapter("04"), {"degree": "6"}) == {"degree": 6}
    with pytest.raises(InputError, match=r"degree = 7 is not one of \{4 \| 6 \| 8\} \(degree of V\)\.$"):
        changed_values(project.chapter("04"), {"degree": "7"})
    with pytest.raises(InputError, match=r"degree must be an int, not '6\.0'"):
        changed_values(project.chapter("04"), {"degree": "6.0"})


@pytest.mark.parametrize("choices", ["4 | six", "4 | 4", "4 |", "4.0 | 6"])
def test_choices_of_a_whole_number_are_different_whole_numbers(project: Any, choices: str) -> None:
    with pytest.raises(InputError, match="whose choices are not different whole numbers"):
        read(project, f"degree: int = 4  # {{{choices}}}, degree of V")


def test_reading_does_not_execute(project: Any) -> None:
    with pytest.raises(InputError, match="is not a plain constant"):
        read(project, "mass: float = __import__('os').abort()  # 0 .. 1, mass")


def test_a_chapter_without_a_parameters_cell_has_none(project: Any) -> None:
    assert read(project, "") == ()


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        ("mass = 1.0  # 0 .. 2, mass", "is not 'name: type = value'"),
        ("mass: float  # 0 .. 2, mass", "is not 'name: type = value'"),
        ("mass: complex = 1.0  # 0 .. 2, mass", "is not 'name: type = value'"),
        ("mass: float | None = 1.0  # 0 .. 2, mass", "is not 'name: type = value'"),
        ("mass: float = (\n1.0)  # 0 .. 2, mass", "is not 'name: type = value'"),
        ("import os", "is not 'name: type = value'"),
        ("mass: float = ", "is not Python: invalid syntax, line 1"),
        ("mass: float = 1.0", "comment is not 'low .. high, description'"),
        ("mass: float = 1.0  # the mass", "comment is not 'low .. high, description'"),
        ("mass: float = 1.0  # 0 .. 2", "comment is not 'low .. high, description'"),
        ("mass: float = 1.0  # 2 .. 0, mass", "range is empty"),
        ("mass: float = 3.0  # 0 .. 2, mass", "mass = 3 is outside 0 .. 2"),
        ("mass: float = True  # 0 .. 2, mass", "not of the type float"),
        ("mass: float = '1'  # 0 .. 2, mass", "not of the type float"),
        ("mass: int = 1.0  # 0 .. 2, mass", "not of the type int"),
        ("mass: int = True  # 0 .. 2, mass", "not of the type int"),
        ("track: str = 'a'  # a, track", "comment is not '{choice | choice}, description'"),
        ("track: str = 'a'  # {a | }, track", "comment is not '{choice | choice}, description'"),
        ("track: str = 'a'  # {a | a}, track", "comment is not '{choice | choice}, description'"),
        ("track: str = 'c'  # {a | b}, track", "track = c is not one of {a | b}"),
        ("rigid: bool = False", "does not describe it"),
        ("rigid: bool = 0  # rigid", "not of the type bool"),
        ("a: bool = True  # a\na: bool = False  # b", "has the parameter 'a' twice"),
    ],
)
def test_a_malformed_parameters_cell_is_refused(project: Any, cell: str, said: str) -> None:
    with pytest.raises(InputError) as info:
        read(project, cell)
    assert said in str(info.value)
    assert "04_small.md" in str(info.value)


def test_two_parameters_cells_are_refused(project: Any) -> None:
    project.add("04", ":tags: [parameters]\n\nb: bool = True  # b", parameters="a: bool = True  # a")
    with pytest.raises(InputError, match="has 2 cells tagged 'parameters'"):
        parameters(project.chapter("04"))


def test_texts_become_values_of_their_type(project: Any) -> None:
    read(project, CELL)
    texts = {"mass_kg": "7e2", "laps": "3", "track": "monza", "rigid": "True", "offset": "0.5"}
    values = changed_values(project.chapter("04"), texts)
    assert values == {"mass_kg": 700.0, "laps": 3, "track": "monza", "rigid": True, "offset": 0.5}
    assert [type(value) for value in values.values()] == [float, int, str, bool, float]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("mas_kg", "700", "Chapter 04 has no parameter 'mas_kg'; did you mean 'mass_kg'?"),
        ("zzz", "1", "has no parameter 'zzz'; it has mass_kg, laps, offset, track, rigid."),
        ("mass_kg", "heavy", "mass_kg must be a float, not 'heavy' (vehicle mass with driver (Table C.1))."),
        ("mass_kg", "", "mass_kg must be a float, not ''"),
        ("mass_kg", "1300", "mass_kg = 1300 is outside 400 .. 1200 (vehicle mass"),
        ("mass_kg", "nan", "mass_kg = nan is not a finite number"),
        ("mass_kg", "inf", "mass_kg = inf is not a finite number"),
        ("mass_kg", "-1e999", "mass_kg = -inf is not a finite number"),
        ("laps", "2.0", "laps must be an int, not '2.0'"),
        ("laps", "0", "laps = 0 is outside 1 .. 20"),
        ("track", "monsa", "track = monsa is not one of {barce#lona | monza}"),
        ("track", "monsa", "did you mean 'monza'?"),
        ("rigid", "yes", "rigid must be a bool (true or false), not 'yes'."),
        ("rigid", "1", "rigid must be a bool (true or false), not '1'."),
    ],
)
def test_a_wrong_value_is_refused(project: Any, name: str, text: str, said: str) -> None:
    read(project, CELL)
    with pytest.raises(InputError) as info:
        changed_values(project.chapter("04"), {name: text})
    assert said in str(info.value)


def test_words_and_assignments_are_told_apart() -> None:
    assert split_assignments(["04", "a=1", "05", "b=x=y"]) == (["04", "05"], {"a": "1", "b": "x=y"})
    with pytest.raises(InputError, match="a is given twice: '1' and '2'"):
        split_assignments(["a=1", "a=2"])
