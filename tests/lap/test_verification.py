"""What verifies a lap, provoked on a small oval."""

import pytest

from thesislib.lap import verification
from thesislib.lap.setups import Solved, Start


@pytest.fixture(scope="module")
def results(start: Start):
    cases = verification.neighbours(start, ("P_max",))
    return {name: verification.resolved(**case) for name, case in cases.items()}


def test_the_cases_are_the_halved_mesh_and_two_neighbours_for_each_number(start: Start) -> None:
    cases = verification.neighbours(start, ("mass",), step=0.02)
    assert list(cases) == [verification.HALVED, "more mass", "less mass"]
    assert [cases[name]["changes"]["mass"] for name in ("more mass", "less mass")] == [673.2, 646.8]


def test_a_number_the_car_does_not_have_is_refused(start: Start) -> None:
    with pytest.raises(KeyError, match="weight"):
        verification.neighbours(start, ("weight",))


def test_multipliers_and_differences_agree_on_what_power_is_worth(start: Start, results) -> None:
    found = verification.derivatives(start.lap(), results, ("P_max",))["P_max"]
    assert found.from_multipliers < 0.0  # more power, less time
    # the curvature of T over 1 % of power: 1.1e-3 measured, a tenth of it at a third of the step
    assert found.disagreement < 2e-3


def test_a_wrong_neighbour_shows_in_the_disagreement(start: Start, results) -> None:
    spoiled = {name: dict(result) for name, result in results.items()}
    spoiled["more P_max"]["objective"] += 1e-4
    found = verification.derivatives(start.lap(), spoiled, ("P_max",))["P_max"]
    assert found.disagreement > 2e-3


def test_a_finer_mesh_moves_the_lap_less_than_its_coarseness_would_allow(start: Start, results) -> None:
    halved = results[verification.HALVED]
    assert 0.0 < abs(halved["lap_time"] - start.lap().time) < 5e-3
    assert Solved.of(halved).summary()["error_estimate"] < start.lap().solution.error
    assert 0.0 < halved["change_n"] < 1.0


def test_the_conditions_of_optimality_hold_at_most_points(start: Start) -> None:
    found = {each.equation: each for each in verification.conditions(start.lap(), threshold=1e-3)}
    assert {"costate n", "costate omega", "control delta", "hamiltonian"} <= set(found)
    # the solver has solved stationarity at the collocation points, and only there
    assert found["control F_flz"].at_points > 0.95
    assert all(each.between <= each.at_points + 0.05 for each in found.values() if "control" in each.equation)
