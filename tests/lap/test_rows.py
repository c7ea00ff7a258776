"""What the rows of Table 4.2 are, and from which they start."""

from dataclasses import replace

import pytest

from thesislib.lap.adjustments import MAP_RANGES
from thesislib.lap.continuation import is_far
from thesislib.lap.rows import (
    BASE,
    LETTERS,
    PRINTED_RANGE,
    RAW,
    RECONCILED,
    Row,
    links,
    own_row,
    printed_range,
    raw,
    rows,
    waves,
)
from thesislib.lap.setups import Setup


@pytest.fixture(scope="module")
def every():
    return rows(Setup(values={"mass": 700.0}))


def test_all_letters_of_the_table_are_there_and_their_variants(every):
    assert set(LETTERS) <= set(every)
    variants = {RECONCILED, *(raw(letter) for letter in RAW), *(printed_range(letter) for letter in "GJ")}
    assert set(every) - set(LETTERS) == variants
    assert all(row.setup.values == {"mass": 700.0} for row in every.values())


def test_parents_stand_before_their_children(every):
    known = {BASE}
    for name, row in every.items():
        assert row.parent in known
        known.add(name)


def test_rows_without_a_start_are_named():
    orphan = Row("K", "heights", Setup(), "D")
    with pytest.raises(KeyError, match="rows without a start: K from D"):
        waves({"K": orphan})


def test_the_longest_chain_of_a_row_is_counted(every):
    length = links(every)
    # C, D, K, L, P, P with the printed constants
    assert [length[name] for name in ("C", "D", "K", "L", "P", "P raw")] == [6, 5, 4, 3, 2, 1]
    assert (length["M"], length["H"], length["B"], length["G"]) == (2, 1, 2, 3)


def test_rows_optimise_what_table_4_2_says(every):
    free = {letter: set(every[letter].setup.free) for letter in LETTERS}
    assert free["D"] == {"dh_f", "dh_r"}
    assert free["E"] == {"dK_h_front", "dK_h_rear"}
    assert free["F"] == free["D"] | free["E"]
    assert free["J"] == free["G"] | free["H"] | free["I"]
    assert free["K"] == free["J"] | free["D"]
    assert free["L"] == free["K"] | free["E"]
    assert free["N"] == free["M"] | free["D"] == {"a_off", "dh_f", "dh_r"}
    assert free["O"] == free["M"] | free["J"]
    assert free["P"] == free["L"] | free["M"]
    assert not any(free[letter] for letter in "ABCQ")
    assert every["Q"].setup.continuous_balance == 1.0


def test_rigid_rows_have_no_roll_constraint_and_a_no_angles(every):
    for letter, angles in (("A", False), ("B", True)):
        car = every[letter].setup.car()
        assert "roll_difference" not in car.equations
        assert car.readings.aero_angles is angles


def test_stiffness_is_judged_with_a_metamodel_that_knows_it(every):
    for letter in LETTERS:
        expected = "reconciled" if letter in "EFLP" else "table_3_1"
        assert every[letter].setup.metamodel == expected
        reference = every[every[letter].reference]
        if letter not in "AB":
            assert reference.setup.metamodel == expected
    for letter in RAW:
        assert every[raw(letter)].setup.metamodel == "table_3_2"
        assert every[raw(letter)].reference == raw("C")


def test_the_printed_range_is_a_note(every):
    assert every["G"].setup.ranges == MAP_RANGES
    assert every[printed_range("G")].setup.ranges == PRINTED_RANGE


def test_what_moves_the_car_on_the_road_is_far(every):
    setups = {name: row.setup for name, row in every.items()}
    assert is_far(setups["C"], setups["D"])
    assert not is_far(setups["C"], setups["B"])
    assert is_far(setups["G"], setups[printed_range("G")])
    assert not is_far(setups["D"], setups["K"])
    assert not is_far(setups["C"], setups["M"])
    assert not is_far(setups["C"], replace(setups["C"], metamodel="reconciled"))


BOUNDS = {"dh_f": 0.005, "dh_r": 0.02, "dK_h_front": 1e5, "dK_h_rear": 1e5, "a_off": 0.1, "u_CoP": 0.2}


def test_a_row_of_ones_own_differs_by_its_bounds_only(every):
    own = own_row(every["D"], BOUNDS)
    assert own.parent == "D" and own.reference == "C" and own.letter == "D"
    assert own.setup == replace(every["D"].setup, free={"dh_f": (-0.005, 0.005), "dh_r": (-0.02, 0.02)})
    assert not is_far(every["D"].setup, own.setup)
    assert own_row(every["Q"], BOUNDS).setup.continuous_balance == 0.2
    assert own_row(every["C"], BOUNDS).setup == every["C"].setup


def test_a_row_of_ones_own_on_another_suspension_has_another_reference(every):
    assert own_row(every["D"], BOUNDS, metamodel="table_3_2").reference == raw("C")
    assert own_row(every["F"], BOUNDS).reference == RECONCILED
    wide = own_row(every["D"], BOUNDS, beta_max=0.2)
    assert wide.setup.ranges == replace(MAP_RANGES, beta=0.2)


def test_a_row_that_cannot_be_is_refused(every):
    with pytest.raises(KeyError, match="row H adjusts dC_L_front_delta2, for which no bound is given"):
        own_row(every["H"], BOUNDS)
    with pytest.raises(
        ValueError, match="dK_h_front changes K_h_front, which this car's suspension does not"
    ):
        own_row(every["E"], BOUNDS, metamodel="table_3_1")
    with pytest.raises(ValueError, match=r"beta_max = 3 rad of the aerodynamic map is outside"):
        own_row(every["G"], dict.fromkeys(every["G"].setup.free, 1.0), beta_max=3.0)
