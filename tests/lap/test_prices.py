"""What a lap's numbers are worth, on a small oval: from multipliers, and from laps solved again."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib import ocp
from thesislib.lap import verification
from thesislib.lap.adjoint import adjoint_change, adjoint_derivative, grip_density, quantities_with
from thesislib.lap.effects import effects
from thesislib.lap.figures_prices import effect_maps, price_bars, price_traces
from thesislib.lap.limits import BRAKE, HALF_WIDTH, ROLL, constraint_densities, limits, roll_per_moment
from thesislib.lap.minimum_time import minimum_lap_time
from thesislib.lap.prices import AMOUNTS, GRIP, grip_prices, prices
from thesislib.lap.sectors import by_sector, sectors
from thesislib.lap.setups import Setup
from thesislib.lap.shadow_prices import shadow_prices, touches
from thesislib.ocp.sensitivity import constant_density
from thesislib.suspension.metamodel import Metamodel
from thesislib.suspension.stiffness import StiffnessMetamodel

CORNERS = [(1, 5.0, "R"), (2, 175.0, "R"), (3, 350.0, "R"), (4, 525.0, "R")]
STEP = 0.003


@pytest.fixture(scope="module")
def tight(start, tmp_path_factory):
    """The oval's lap, solved until the barrier has left nothing behind."""
    path = str(tmp_path_factory.mktemp("tight") / "oval.npz")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("THESIS_STORE", path + "-store")
        found, read = start.tighten(path, "oval, tight")
        assert not read
    return found


@pytest.fixture(scope="module")
def lap(tight):
    return tight.lap()


@pytest.fixture(scope="module")
def neighbours(tight):
    cases = verification.neighbours(tight, ("h", HALF_WIDTH), step=STEP)
    del cases[verification.HALVED]
    return {name: verification.resolved(**case) for name, case in cases.items()}


@pytest.fixture(scope="module")
def maps(lap):
    found = effects(lap, ["P_max", "h", "grip", HALF_WIDTH, "front_height_limit_m"])
    return {each.amount.name: each for each in found}


def test_tightening_moves_the_lap_by_what_the_barrier_was_worth(start, lap) -> None:
    assert 0.0 < start.lap().time - lap.time < 1e-4
    np.testing.assert_array_equal(start.lap().s, lap.s)


@pytest.mark.parametrize("name", ["mass", "h", "alpha_1", "C_L_rear_h_r2", "wheelbase"])
def test_a_number_changed_in_the_equations_acts_where_its_own_density_says(lap, name) -> None:
    value = lap.car.values[name]
    found = adjoint_derivative(
        lap, lambda more: quantities_with(lap, values={name: value + more}), 1e-5 * abs(value)
    )
    density = constant_density(lap.solution, name)
    # a central difference of 1e-5: its own error and rounding are both near 1e-10
    np.testing.assert_allclose(found, density, atol=1e-7 * np.abs(density).max())


def test_equations_that_did_not_change_cost_nothing(lap) -> None:
    assert np.abs(adjoint_change(lap, quantities_with(lap))).max() == 0.0
    assert np.abs(adjoint_change(lap, {"a_x": lap["a_x"] + 1.0})).max() == 0.0  # which nothing reads


def test_more_grip_everywhere_is_worth_what_the_equations_with_more_grip_say(lap) -> None:
    peaks = ("mu_x1", "mu_x2", "mu_y1", "mu_y2")
    more = {name: 1.01 * lap.car.values[name] for name in peaks}
    # tyre forces are proportional to the four peaks together, and the equations linear in the forces, but for
    # the product of force and slowness, which no peak is in
    changed = adjoint_change(lap, quantities_with(lap, values=more))
    np.testing.assert_allclose(changed, 0.01 * grip_density(lap), atol=1e-12)


def test_prices_cover_the_car_its_tyres_its_map_and_its_limits(lap) -> None:
    found = {price.amount.name: price.seconds for price in prices(lap)}
    assert len(found) == len(AMOUNTS) >= 25
    assert found["mass"] > 0.0 > found["P_max"]
    assert found["air_density"] / 0.01 * 1.2 == pytest.approx(found["frontal_area"] / 0.015 * 1.5, rel=1e-9)


@pytest.mark.parametrize("axle", ["front", "rear"])
def test_heave_stiffness_is_worth_what_a_lap_with_other_springs_says(tight, lap, axle) -> None:
    found = next(price for price in prices(lap) if price.amount.name == f"K_h_{axle}")
    more = 500.0  # N/m
    stiffer = _with_springs(lap, tight.setup, axle, more).solution
    difference = stiffer.objective + stiffer.regularisation
    difference -= lap.solution.objective + lap.solution.regularisation
    # two hundredths of a millisecond; what bends T over half a step is 0.5 % of it at the rear
    assert found.seconds / found.amount.size * more == pytest.approx(difference, rel=1e-2)


def _with_springs(lap, setup: Setup, axle: str, more: float):
    """Solve the lap with a metamodel whose coefficients Table 3.2 has moved, worked out by hand."""
    base, table = Metamodel.from_file(), StiffnessMetamodel.from_file()
    K = 1e-3 * table.values[f"K_h_{axle}"]  # kN/m, as in the table
    dK = 1e-3 * more
    moved = {}
    for quantity in (f"h_{axle[0]}", f"phi_{axle[0]}"):
        # 1, F_l, F_r, K, F_l^2, F_l F_r, F_l K, F_r^2, F_r K, K^2
        c = getattr(table, quantity)
        change = (c[3] * dK + c[9] * ((K + dK) ** 2 - K**2), c[6] * dK, c[8] * dK, 0.0, 0.0, 0.0)
        moved[quantity] = tuple(np.add(getattr(base, quantity), change))
    car = replace(lap.car, ride=replace(base, **moved))
    settings = replace(verification.NEIGHBOURLY, optimality=1e-10, barrier=1e-9)
    return minimum_lap_time(lap.track, car, tolerance=0.1, guess=lap, settings=settings, units=setup.units())


def test_height_and_road_width_are_worth_what_laps_solved_again_say(lap, neighbours) -> None:
    found = verification.derivatives(lap, neighbours, ("h", HALF_WIDTH), step=STEP)
    # the curvature of T over 0.3 %, and half of a hundred-thousandth of a second that 1e-8 leaves
    assert found["h"].disagreement < 1e-3
    assert found[HALF_WIDTH].disagreement < 1e-3
    assert found[HALF_WIDTH].from_multipliers < 0.0


def test_both_maps_sum_to_the_same_once_the_regulariser_is_accounted_for(lap, maps) -> None:
    for name in ("P_max", "h", "grip", HALF_WIDTH):
        assert maps[name].disagreement < 1e-4, name
    # this lap does not reach the plank limit: it is worth nothing and changes nothing
    assert abs(maps["front_height_limit_m"].price) + abs(maps["front_height_limit_m"].time) < 1e-9
    assert maps["h"].price == pytest.approx(
        next(price.seconds for price in prices(lap) if price.amount.name == "h"), rel=1e-12
    )


def test_time_appears_where_two_laps_solved_again_have_it(lap, maps, neighbours) -> None:
    for name, value in (("h", lap.car.values["h"]), (HALF_WIDTH, limits(lap)[HALF_WIDTH])):
        effect = maps[name]
        expected = effect.amount.size * verification.elapsed_difference(neighbours, name, 2 * STEP * value)
        found = lap.accumulated(effect.appears)
        # where a constraint becomes active or lets go, 0.3 % moves the place along the mesh
        assert np.abs(found - expected).max() < 0.05 * np.abs(expected).max(), name


def test_power_acts_only_where_the_engine_is_at_its_limit(lap, maps) -> None:
    acts = np.abs(maps["P_max"].acts)
    assert acts[~lap.activity("power")].max() < 1e-3 * acts.max()


def test_unknown_number_has_no_map(lap) -> None:
    with pytest.raises(KeyError, match="no parameter masse; did you mean mass"):
        effects(lap, ["masse"])


def test_sectors_cut_the_lap_where_the_car_is_fastest_and_miss_no_point(lap) -> None:
    parts = sectors(lap, CORNERS)
    assert [part.number for part in parts] == [1, 2, 3, 4]
    assert np.sum([part.holds(lap.s) for part in parts], axis=0).tolist() == [1] * len(lap.s)
    assert by_sector(lap, lap["slowness"], parts).sum() == pytest.approx(lap.time, rel=1e-12)
    assert grip_prices(lap, parts).sum() == pytest.approx(
        next(price.seconds for price in prices(lap) if price.amount is GRIP), rel=1e-12
    )
    with pytest.raises(ValueError, match="needs two; there are 1"):
        sectors(lap, CORNERS[:1])


def test_shadow_prices_integrate_to_the_prices_of_the_table(lap) -> None:
    table = {price.amount.name: price.seconds / price.amount.size for price in prices(lap)}
    found = shadow_prices(lap)
    both = found["left_edge"].total + found["right_edge"].total
    assert both == pytest.approx(-1e3 * 0.1 * table[HALF_WIDTH], rel=1e-12)
    for name in ("power", "ride_height", "roll", "brake"):
        price = found[name]
        assert price.total == pytest.approx(-1e3 * price.size * table[price.priced_as], rel=1e-12), name
        assert 1e-3 * (lap.solution.weights @ price.density) == pytest.approx(price.total, rel=1e-12), name


@pytest.mark.parametrize(
    ("equation", "step", "priced"),
    [("roll_difference", np.deg2rad(0.01), ROLL), ("brake_difference", 5.0, BRAKE)],
)
def test_a_difference_of_two_wheels_is_worth_what_laps_solved_with_it_say(
    lap, tight, equation, step, priced
) -> None:
    """(4.19) and (4.20) with a small number in the place of their zero, all along the lap."""
    problem = tight.setup.problem(equation)
    settings = replace(verification.NEIGHBOURLY, optimality=1e-10, barrier=1e-9)

    def objective(difference: float) -> float:
        path = [
            replace(each, bounds=(difference, difference)) if each.name == equation else each
            for each in problem.path
        ]
        changed = ocp.solve(replace(problem, path=path), lap.solution, None, settings, tolerance=0.1)
        return changed.objective + changed.regularisation

    found = (objective(step) - objective(-step)) / (2.0 * step)
    multiplier = lap.solution.path_multiplier(equation)
    assert found == pytest.approx(-lap.solution.weights @ multiplier, rel=2e-3)
    density = constraint_densities(lap)[priced]
    sign = np.sign(lap["phi_f"]) if priced == ROLL else -np.sign(lap["a_y"])
    there = density != 0.0
    np.testing.assert_allclose((sign * density)[there], -multiplier[there], rtol=1e-12)


def test_touches_hold_what_the_edges_cost(lap) -> None:
    edge = shadow_prices(lap)["left_edge" if shadow_prices(lap)["left_edge"].total > 1.0 else "right_edge"]
    places, saved = touches(lap, edge)
    assert saved.sum() == pytest.approx(edge.total, rel=1e-2)  # shares that are the barrier's are left out
    assert np.all((places >= 0.0) & (places <= lap.period))


def test_anti_roll_moment_turns_the_front_axle_as_a_change_of_loads_does(lap) -> None:
    dF = 1.0  # N from one wheel to the other
    args = (lap["F_flz"] + dF, lap["F_frz"] - dF, lap["F_rlz"], lap["F_rrz"], lap.car.values)
    change = lap.car.ride.heights(*args).phi_f - lap["phi_f"]
    found = roll_per_moment(lap) * 2.0 * dF * lap.car.values["w_f"]
    np.testing.assert_allclose(found, change, rtol=1e-3)  # of a difference of one newton


def test_pictures_show_every_number_that_they_are_given(lap, maps) -> None:
    bars = price_bars(prices(lap), most=12)
    assert len(bars.axes[0].patches) == 12
    drawn = effect_maps(lap, [maps["h"], maps["grip"]], sectors(lap, CORNERS))
    assert [len(axes.patches) for axes in drawn.axes] == [8, 8]
    assert len(price_traces(lap, shadow_prices(lap), CORNERS).axes) == 5
    with pytest.raises(ValueError, match="most = 0"):
        price_bars(prices(lap), most=0)
