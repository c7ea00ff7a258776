"""Wheels on the road: formulas against geometry, and a lap of the oval with wheels at its edges."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib import ocp
from thesislib.lap import figures_edges
from thesislib.lap.continuation import continued_row, is_far
from thesislib.lap.edges import (
    contact_points,
    edge_data,
    in_road_axes,
    lateral_distance,
    refuse_narrow,
    wheels_on_road,
)
from thesislib.lap.setups import Setup, Start
from thesislib.ocp.sensitivity import sensitivity
from thesislib.roads import CentreLine
from thesislib.studies.store import canonical

LOOSE = 2e-2
CAR = {"a": 1.8, "wheelbase": 3.4, "w_f": 0.73, "w_r": 0.7}


def circle(radius: float) -> CentreLine:
    length = 2.0 * np.pi * abs(radius)
    s = np.linspace(0.0, length, 60, endpoint=False)
    width = np.full_like(s, 6.0)
    return CentreLine("circle", s, np.full_like(s, 1 / radius), length, (0.0, 0.0, 0.0), width, width)


@pytest.mark.parametrize("radius", [25.0, -25.0])
def test_on_a_circle_the_formula_is_the_distance_on_the_ground(radius: float) -> None:
    road = circle(radius)
    s, n, xi = np.array([3.0, 40.0, 100.0]), np.array([-3.0, 0.5, 4.0]), np.array([0.3, -0.1, 0.05])
    for wheel, place in wheels_on_road(road, s, n, xi, CAR).items():
        lateral = lateral_distance(n, xi, road.curvature(s), contact_points(CAR)[wheel])
        # the foot is found to a nanometre; positions are integrals to rounding
        np.testing.assert_allclose(lateral, place.lateral, atol=1e-9)


def test_on_a_straight_the_formula_is_the_usual_one_and_on_a_circle_it_misses_by_the_sagitta() -> None:
    ahead, beside = in_road_axes(2.0, 0.1, (1.8, 0.73))
    assert lateral_distance(2.0, 0.1, 0.0, (1.8, 0.73)) == pytest.approx(beside, abs=1e-14)
    C = 1.0 / 30.0
    sagitta = C * ahead**2 / 2 / (1 - C * beside)
    # the next term is (C X)^2 / 4 of it
    assert beside - lateral_distance(2.0, 0.1, C, (1.8, 0.73)) == pytest.approx(sagitta, rel=2e-3)


def test_room_is_counted_to_the_wheels_own_side() -> None:
    road = replace(circle(40.0), station_width_left=np.full(60, 5.0))
    places = wheels_on_road(road, np.array([10.0]), np.array([0.0]), np.array([0.0]), CAR)
    for wheel, place in places.items():
        half = 6.0 if wheel[1] == "r" else 5.0
        assert place.room == pytest.approx(half - abs(place.lateral), abs=1e-12)


def test_widths_are_those_beside_the_axles() -> None:
    road = circle(40.0)
    widths = np.linspace(5.0, 7.0, 60)
    road = replace(road, station_width_right=widths)
    front, rear = (edge_data(road, CAR)[f"width_{wheel}"](np.array([100.0])) for wheel in ("fr", "rr"))
    assert front == pytest.approx(road.widths(101.8)[0])
    assert rear == pytest.approx(road.widths(98.4)[0])


@pytest.mark.parametrize(
    ("margin", "message"),
    [(-0.1, r"wheel_margin_m = -0.1 must be 0 or above"), (5.3, r"12 m of road at s = 0 m are too narrow")],
)
def test_roads_without_room_are_refused(margin: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        refuse_narrow(circle(40.0), CAR, margin)


def test_a_point_beyond_the_centre_of_curvature_is_refused() -> None:
    with pytest.raises(ValueError, match="has no foot on it"):
        wheels_on_road(circle(10.0), np.array([5.0]), np.array([10.5]), np.array([0.0]), CAR)


def test_edges_are_part_of_the_key_of_a_set_up() -> None:
    changed = (Setup(edges="wheels"), Setup(wheel_margin_m=0.1))
    assert all(canonical(one) != canonical(Setup()) for one in changed)
    with pytest.raises(ValueError, match="edges = 'tyres' is not one of centre, wheels"):
        Setup(edges="tyres")


def test_a_lap_with_its_wheels_on_the_road_is_far_from_one_in_a_corridor() -> None:
    assert is_far(Setup(), Setup(edges="wheels"))
    assert not is_far(Setup(edges="wheels"), Setup(edges="wheels", wheel_margin_m=0.1))


@pytest.fixture(scope="module")
def lap(start: Start):
    return continued_row(replace(start.setup, edges="wheels"), start, LOOSE, "wheels")


def test_wheels_stay_on_the_road_and_reach_both_edges(lap) -> None:
    places = wheels_on_road(lap.track, lap.s, lap["n"], lap["xi"], lap.car.values)
    for wheel, place in places.items():
        # the oval's curvature changes within a wheelbase: the circle misses by a millimetre
        assert place.room.min() > -2e-3, wheel
    assert min(place.room.min() for wheel, place in places.items() if wheel[1] == "r") < 0.01
    assert lap.activity("right_edge").any()


def test_a_wider_corridor_makes_a_faster_lap(lap, start: Start) -> None:
    # 6 m of half-width leave the mass centre 5.27 m instead of 4
    assert np.abs(lap["n"]).max() > 4.5
    assert lap.time < start.lap().time - 0.05


def test_price_of_the_margin_is_that_of_a_lap_solved_again(lap) -> None:
    tight = ocp.Settings(optimality=1e-9)
    problem = lap.solution.problem
    objectives = []
    for margin in (0.0, 0.01):
        moved = replace(problem, constants={**problem.constants, "wheel_margin": margin})
        again = ocp.solve(moved, lap.solution, None, tight, tolerance=LOOSE)
        objectives.append(again.objective + again.regularisation)
        if not margin:
            price = sensitivity(again)["wheel_margin"]
    # one-sided over a centimetre of 6 m; constraints that come and go bend it by a per cent
    assert (objectives[1] - objectives[0]) / 0.01 == pytest.approx(price, rel=0.03)
    assert price > 0.0


def test_pictures_show_both_laps_and_refuse_a_part_off_the_lap(lap, start: Start) -> None:
    laps = {"wheels": lap, "centre": start.lap()}
    gained = figures_edges.compared_laps(laps, 4.0).axes[2].lines[0].get_ydata()
    np.testing.assert_allclose(gained[[0, -1]], [0.0, laps["centre"].time - lap.time], atol=1e-12)
    detail = figures_edges.wheel_tracks_on_map(laps, 4.0, from_m=100.0, to_m=250.0)
    assert detail.axes[0].yaxis_inverted()
    with pytest.raises(ValueError, match="must lie within"):
        figures_edges.wheel_tracks_on_map(laps, 4.0, from_m=300.0, to_m=100.0)
