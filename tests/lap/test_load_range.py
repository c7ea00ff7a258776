"""What lies outside the data, and what it is worth: the adjoint against re-solves on an oval."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib.lap.load_range import RELATIONS, held, held_change, held_lap, held_laps, time_outside
from thesislib.lap.setups import Setup, Start
from thesislib.suspension import Metamodel

LOOSE = 2e-2


@pytest.fixture(scope="module")
def lap(start: Start):
    return start.lap()


def test_the_time_outside_the_mesh_is_what_the_metamodel_counts(lap) -> None:
    found = time_outside(lap)
    pairs = [np.column_stack((lap[f"F_{axle}lz"], lap[f"F_{axle}rz"])) for axle in "fr"]
    counted = lap.car.ride.time_outside(lap.t, *pairs)
    step = np.diff(lap.t).max()  # points that stand half-way to their neighbours count the same but for edges
    assert found.metamodel_front == pytest.approx(counted["front"], abs=2.0 * step)
    assert found.metamodel_rear == pytest.approx(counted["rear"], abs=2.0 * step)


def test_a_wheel_outside_makes_any_wheel_outside(lap) -> None:
    found = time_outside(lap)
    single = [*found.tyre_light.values(), *found.tyre_heavy.values()]
    assert 0.0 < max(single) <= found.any_tyre <= min(lap.time, sum(single)) + 1e-9


def test_within_its_range_a_held_relation_is_the_same(lap) -> None:
    loads = {f"F_{wheel}z": -4000.0 for wheel in ("fl", "fr", "rl", "rr")}
    x = {"n": 0.0, "xi": 0.0, "v": 0.5, "u": 50.0, "omega": 0.3}
    u = {"delta": 0.03, "kappa_fl": 0.0, "kappa_fr": 0.0, "kappa_rl": 0.02, "kappa_rr": 0.02} | loads
    own = lap.car.quantities(x, u, 0.0)
    for relation in RELATIONS:
        other = held(lap.car, relation).quantities(x, u, 0.0)
        for name, value in own.items():
            # 50 N of rounding at an edge 2 kN away is 0.3 N: 1e-4 of what grows with load, 1.6 um of height
            assert other[name] == pytest.approx(value, rel=1e-4, abs=2e-6), (relation, name)


def test_held_tyres_cost_what_the_multipliers_say(start: Start, lap) -> None:
    result = held_lap(start, "tyres", LOOSE)
    change = result["objective"] - lap.solution.objective - lap.solution.regularisation
    predicted = float(lap.solution.weights @ held_change(lap, "tyres"))
    assert predicted > 0.0  # light wheels lose the grip that the line promised them
    # what is left is of second order in a change of 50 ms: 0.8 % of it measured
    assert change == pytest.approx(predicted, rel=0.03)


def test_the_plank_limit_is_part_of_what_held_heights_change(lap) -> None:
    weights = lap.solution.weights
    whole, forces = (held_change(lap, "ride_heights", limits=limits) for limits in (True, False))
    limit = lap.solution.path_multiplier("ride_height")
    other = held(lap.car, "ride_heights").ride.heights(
        *(lap[f"F_{w}z"] for w in ("fl", "fr", "rl", "rr")), {}
    )
    assert weights @ (whole - forces) == pytest.approx(
        weights @ (limit * (other.h_f - lap["h_f"])), abs=1e-12
    )


def test_a_relation_that_is_none_and_a_car_without_a_mesh_are_refused() -> None:
    car = Setup().car()
    with pytest.raises(ValueError, match=r"'springs'.*tyres, ride_heights"):
        held(car, "springs")
    with pytest.raises(ValueError, match="NoneType"):
        held(replace(car, ride=None, readings=replace(car.readings, suspension="rigid")), "ride_heights")
    nameless = replace(Metamodel.from_file(), heaviest_front=-np.inf)
    with pytest.raises(ValueError, match="heaviest_front = -inf"):
        held(replace(car, ride=nameless), "ride_heights")


def test_each_relation_is_a_case_of_a_study(start: Start) -> None:
    cases = held_laps(start, LOOSE)
    assert list(cases) == ["tyres held", "ride_heights held"]
