"""The minimum lap time problem on a road whose answer another method gives."""

import numpy as np
import pytest
from scipy.optimize import minimize

from thesislib import ocp
from thesislib.lap.minimum_time import SETTINGS, Lap, minimum_lap_time
from thesislib.lap.problem import HALF_WIDTH_M, lap_problem, units_of
from thesislib.lap.start import quasi_steady_start
from thesislib.roads import CentreLine
from thesislib.suspension import Metamodel
from thesislib.vehicles import CONTROLS, STATES, RacingCar

RADIUS_M = 100.0


@pytest.fixture(scope="module")
def circle():
    length = 2 * np.pi * RADIUS_M
    s = np.linspace(0.0, length, 60, endpoint=False)
    width = np.full_like(s, 6.0)
    return CentreLine("circle", s, np.full_like(s, 1 / RADIUS_M), length, (0.0, 0.0, 0.0), width, width)


@pytest.fixture(scope="module")
def car():
    return RacingCar.from_file(ride=Metamodel.from_file())


@pytest.fixture(scope="module")
def lap(circle, car):
    return minimum_lap_time(circle, car, tolerance=1e-6)


def steady_lap_time(circle, car):
    """Fastest steady lap by sequential quadratic programming on one point of the circle."""
    problem = lap_problem(circle, car)
    names = (*STATES, *CONTROLS)
    sizes = np.array([q.size for q in (*problem.states, *problem.controls)])
    start = quasi_steady_start(circle, car)
    here = np.zeros(1)

    def quantities(z):
        values = dict(zip(names, z * sizes, strict=True))
        x = {name: values[name] for name in STATES}
        return car.quantities(x, {name: values[name] for name in CONTROLS}, 1 / RADIUS_M)

    def equations(z):
        q = quantities(z)
        rates = [q[f"d{state.name}_ds"] * 100.0 / state.size for state in problem.states]
        sizes_of = {path.name: path.size for path in problem.path}
        return np.array(rates + [q[name] / sizes_of[name] for name in car.equations])

    def power_left(z):
        return (car.values["P_max"] - quantities(z)["power"]) / 1e5

    z0 = np.array([float(start.get(name, lambda s: np.zeros_like(s))(here)[0]) for name in names]) / sizes
    bounds = [(q.bounds[0] / q.size, q.bounds[1] / q.size) for q in (*problem.states, *problem.controls)]
    found = minimize(
        lambda z: quantities(z)["slowness"] * circle.length,
        z0,
        method="SLSQP",
        bounds=bounds,
        constraints=[{"type": "eq", "fun": equations}, {"type": "ineq", "fun": power_left}],
        options={"maxiter": 500, "ftol": 1e-12},
    )
    assert found.success, found.message
    return found.fun


def test_lap_of_a_circle_is_the_fastest_steady_one(lap, circle, car):
    # both are optima of the same car by different methods; the solver's tolerances leave 1e-6 of the time
    assert lap.time == pytest.approx(steady_lap_time(circle, car), rel=2e-5)


def test_a_circle_is_driven_on_its_inside(lap):
    assert np.all(lap["n"] > HALF_WIDTH_M - 0.02)
    assert lap.activity("right_edge").all()
    assert not lap.activity("left_edge").any()


def test_elapsed_time_ends_at_the_lap_time(lap):
    # the last collocation point lies before the end by less than its interval
    assert np.all(np.diff(lap.t) > 0)
    remaining = (lap.period - lap.s[-1]) * lap["slowness"][-1]
    assert lap.t[-1] + remaining == pytest.approx(lap.time, rel=1e-6)


def test_the_equations_of_the_car_hold_along_the_lap(lap, car):
    units = units_of(car)
    assert np.abs(lap["vertical_balance"]).max() < 1e-6 * units.force
    assert np.abs(lap["pitch_balance"]).max() < 1e-6 * units.moment
    assert np.abs(lap["roll_difference"]).max() < 1e-7


def test_a_lap_starts_the_next_one_and_more_grip_is_faster(lap, circle, car):
    grippier = car.replace(mu_y1=1.05 * car.values["mu_y1"], mu_y2=1.05 * car.values["mu_y2"])
    faster = minimum_lap_time(circle, grippier, tolerance=1e-6, guess=lap, units=units_of(car))
    assert faster.time < 0.99 * lap.time
    assert sum(mesh.iterations for mesh in faster.solution.history) < 100


def test_unknown_channels_and_constraints_are_refused_with_those_there_are(lap):
    with pytest.raises(KeyError, match="no channel 'speed'; known: n, xi"):
        lap["speed"]
    with pytest.raises(KeyError, match="no constraint is named 'plank'; known: power"):
        lap.activity("plank")


def test_an_impossible_lap_says_which_equation_fails_and_where(circle, car):
    # a plank limit under the height at which the car stands cannot be kept
    hurried = ocp.Settings(draft=SETTINGS.draft, iterations=60)
    with pytest.raises(ocp.SolveError, match=r"IPOPT stopped with .* largest residual: .*interval \d+, s = "):
        minimum_lap_time(circle, car, tolerance=1e-4, settings=hurried, front_height_limit_m=-0.03)


def test_scaling_units_are_those_of_the_car(car):
    units = units_of(car)
    assert units.time == pytest.approx(np.sqrt(3.4 / 9.80665))
    assert units.force == pytest.approx(660 * 9.80665)
    assert units.power == pytest.approx(units.force * units.length / units.time)


def test_a_lap_is_what_its_solution_is(lap):
    again = Lap(lap.name, lap.track, lap.car, lap.solution)
    assert again["h_f"] == pytest.approx(lap["h_f"])
