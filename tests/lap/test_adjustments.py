"""What the adjustments of Table 4.2 do to the numbers of the car, and what they leave alone."""

import math
from dataclasses import replace

import numpy as np
import pytest

from thesislib.lap.adjustments import ADJUSTMENTS, MAP_RANGES, MapRanges, adjusted, bounds_of, parameters
from thesislib.lap.setups import Setup


@pytest.fixture(scope="module")
def values():
    return Setup(metamodel="table_3_2").car().values


def test_nothing_moves_without_offsets(values):
    assert adjusted(values, {}) == values
    assert adjusted(values, dict.fromkeys(ADJUSTMENTS, 0.0)) == values


def test_the_balance_moves_downforce_and_makes_none(values):
    moved = adjusted(values, {"a_off": 0.2, "u_CoP": np.array([-0.1, 0.3])})
    total = moved["C_L_front_0"] + moved["C_L_rear_0"]
    assert np.allclose(total, values["C_L_front_0"] + values["C_L_rear_0"], atol=1e-15)
    assert np.allclose(moved["C_L_rear_0"] - values["C_L_rear_0"], [0.1, 0.5])  # rearwards is positive


@pytest.mark.parametrize("axle", ["front", "rear"])
def test_the_area_under_the_aerodynamic_map_stays(values, axle):
    """(4.30) by quadrature of its integral, which the closed form did not come from."""
    change = {"beta2": -3.0, "delta2": 0.12, "phi2": 15.0}
    moved = adjusted(values, {f"dC_L_{axle}_{angle}": value for angle, value in change.items()})
    x, w = np.polynomial.legendre.leggauss(3)  # exact for the squares of angles
    beta, delta, phi = (
        half * x[place]
        for half, place in zip(
            (MAP_RANGES.beta, MAP_RANGES.delta, MAP_RANGES.phi),
            np.ix_(range(3), range(3), range(3)),
            strict=True,
        )
    )
    weight = w[:, None, None] * w[:, None] * w
    difference = moved[f"C_L_{axle}_0"] - values[f"C_L_{axle}_0"]
    difference = (
        difference + change["beta2"] * beta**2 + change["delta2"] * delta**2 + change["phi2"] * phi**2
    )
    assert abs((weight * difference).sum()) < 1e-14
    other = {"front": "rear", "rear": "front"}[axle]
    assert moved[f"C_L_{other}_0"] == values[f"C_L_{other}_0"]


def test_the_weights_are_those_of_the_printed_ranges():
    """0.025994, 0.022846 and 0.00040616 follow from the printed 16°, 15° and 2°."""
    printed = MapRanges(beta=4.0 * math.pi / 45.0)
    assert printed.price("beta2") == pytest.approx(0.025994, abs=5e-7)
    assert printed.price("delta2") == pytest.approx(0.022846, abs=5e-7)
    assert printed.price("phi2") == pytest.approx(0.00040616, abs=5e-9)


def test_bounds_are_those_of_table_4_2():
    bounds = bounds_of(["dh_f", "dh_r", "dC_L_rear_phi2", "dK_h_front"])
    assert bounds == {
        "dh_f": (-0.010, 0.010),
        "dh_r": (-0.030, 0.030),
        "dC_L_rear_phi2": (-20.0, 20.0),
        "dK_h_front": (-500e3, 500e3),
    }


def test_what_is_not_free_is_held_at_zero(values):
    listed = parameters(bounds_of(["a_off"]), values)
    assert {each.name for each in listed} == set(ADJUSTMENTS)
    assert {each.name for each in listed if each.bounds != (0.0, 0.0)} == {"a_off"}
    plain = parameters(bounds_of(["a_off"]), Setup().car().values)
    assert {each.name for each in plain} == set(ADJUSTMENTS) - {"dK_h_front", "dK_h_rear"}


def test_what_the_car_does_not_have_is_refused():
    with pytest.raises(KeyError, match=r"Table 4.2 has no parameter dh_rr; did you mean dh_r"):
        bounds_of(["dh_rr"])
    with pytest.raises(
        ValueError, match=r"dK_h_front changes K_h_front, which this car's suspension does not"
    ):
        Setup(free=bounds_of(["dK_h_front"])).problem("E")
    with pytest.raises(ValueError, match=r"bounds 0\.001 \.\. 0\.01 m of dh_f do not contain zero"):
        Setup(free={"dh_f": (0.001, 0.01)}).problem("D")
    with pytest.raises(ValueError, match=r"beta_max = 0 rad of the aerodynamic map is outside 0 .. π/2"):
        MapRanges(beta=0.0)
    with pytest.raises(ValueError, match=r"continuous_balance = -1, a bound on \|u_CoP\|, is negative"):
        Setup(continuous_balance=-1.0).problem("Q")
    with pytest.raises(
        ValueError, match=r"metamodel = 'table_3_3' is not one of table_3_1, table_3_2, reconciled"
    ):
        Setup(metamodel="table_3_3")


def test_reconciled_suspension_stands_where_that_of_table_3_1_does():
    loads = (-3000.0, -3000.0, -3500.0, -3500.0)
    printed, reconciled, raw = (
        Setup(metamodel=name).car().ride.heights(*loads) for name in ("table_3_1", "reconciled", "table_3_2")
    )
    # the constant between the tables is 1.3 mm in front, what their fits leave at any load 0.6 mm at most
    assert abs(reconciled.h_f - printed.h_f) < 0.6e-3
    assert raw.h_f - reconciled.h_f == pytest.approx(-1.3e-3, abs=0.1e-3)


def test_a_continuous_balance_is_one_more_control():
    plain, balanced = Setup().problem("C"), replace(Setup(), continuous_balance=0.5).problem("Q")
    assert [each.name for each in balanced.controls] == [*(each.name for each in plain.controls), "u_CoP"]
    assert balanced.controls[-1].bounds == (-0.5, 0.5)
    assert not plain.parameters and not balanced.parameters
