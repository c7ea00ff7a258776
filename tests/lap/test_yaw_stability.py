"""Eigenvalues of lateral speed and yaw rate along a lap, against differences, simulation and theory."""

import numpy as np
import pytest

from thesislib.lap.setups import Start
from thesislib.lap.yaw_stability import (
    frozen_slide,
    slide_along_lap,
    yaw_eigenvalues,
    yaw_jacobian,
    yaw_rates,
    yaw_stability,
)
from thesislib.vehicles import CONTROLS, STATES


@pytest.fixture(scope="module")
def lap(start: Start):
    return start.lap()


@pytest.fixture(scope="module")
def stability(lap):
    return yaw_stability(lap)


def test_the_jacobian_is_what_differences_of_the_equations_give(lap) -> None:
    x, u = ({name: np.array(lap[name]) for name in names} for names in (STATES, CONTROLS))
    exact = yaw_jacobian(lap.car, x, u)
    for column, (state, step) in enumerate((("v", 1e-4), ("omega", 1e-5))):
        more, less = (yaw_rates(lap.car, {**x, state: x[state] + h}, u) for h in (step, -step))
        difference = ((more - less) / (2.0 * step)).T
        # central differences: 1e-8 of truncation and 1e-9 of cancellation, relative to entries up to 90
        np.testing.assert_allclose(exact[:, :, column], difference, atol=1e-5)


def test_a_car_that_rolls_straight_has_the_eigenvalues_of_the_linear_single_track_car(lap) -> None:
    x = {"n": 0.0, "xi": 0.0, "v": 0.0, "u": 40.0, "omega": 0.0}
    u = dict.fromkeys(CONTROLS, 0.0) | {f"F_{wheel}z": -2000.0 for wheel in ("fl", "fr", "rl", "rr")}
    p = lap.car.values
    # at 2 kN the force grows by mu Q S over alpha_1 for each radian; the slip's rounded corner takes 1e-6 off
    C = 2.0 * 2000.0 * p["mu_y1"] * p["Q_y"] * np.pi / (2.0 * np.arctan(p["Q_y"])) / p["alpha_1"]
    a, b, mass, inertia = p["a"], p["wheelbase"] - p["a"], p["mass"], p["I_z"]
    theory = np.array(
        [
            [-2.0 * C / (mass * 40.0), (b - a) * C / (mass * 40.0) - 40.0],
            [(b - a) * C / (inertia * 40.0), -(a**2 + b**2) * C / (inertia * 40.0)],
        ]
    )
    exact = yaw_jacobian(lap.car, *({k: np.array([v]) for k, v in each.items()} for each in (x, u)))[0]
    np.testing.assert_allclose(exact, theory, rtol=1e-4)
    assert yaw_eigenvalues(exact[None]).real.max() < 0.0


def test_the_shares_of_time_are_of_the_whole_lap(stability, lap) -> None:
    assert stability.time_shares.sum() == pytest.approx(1.0, abs=1e-12)
    assert 0.0 < stability.unstable_share < 1.0
    assert stability.unstable_share == pytest.approx(stability.time_shares[stability.growth > 0.0].sum())
    assert lap.s[np.argmax(stability.growth)] == stability.worst
    assert stability.largest_growth == stability.growth.max() > 0.0


def test_a_small_slide_of_the_frozen_car_grows_at_the_rate_of_the_eigenvalue(lap, stability) -> None:
    here = int(np.argmax(stability.growth))
    x, u = ({name: np.array([lap[name][here]]) for name in names} for names in (STATES, CONTROLS))
    values, vectors = np.linalg.eig(yaw_jacobian(lap.car, x, u)[0])
    assert np.isreal(values).all(), "the worst point of the oval diverges without swinging"
    along = 1e-6 * vectors[:, np.argmax(values)].real
    t, slide = frozen_slide(lap, stability.worst, (along[0], along[1]), 0.3)
    rate = np.log(np.linalg.norm(slide[:, -1]) / np.linalg.norm(slide[:, 0])) / t[-1]
    # the tyres' curvature over a slide that ends below 1e-4 m/s
    assert rate == pytest.approx(stability.largest_growth, rel=1e-3)


def test_without_a_disturbance_the_frozen_car_stays(lap, stability) -> None:
    assert np.abs(frozen_slide(lap, stability.worst, (0.0, 0.0), 0.3)[1]).max() == 0.0


def test_a_gust_in_an_unstable_place_carries_the_car_away_and_in_a_stable_one_it_dies(lap, stability) -> None:
    def slid(s: float) -> float:
        _, departure = slide_along_lap(lap, s, 1e-3, 30.0)
        assert departure["v"][0] == pytest.approx(1e-3, abs=1e-12)
        assert departure["n"][0] == 0.0
        return float(np.hypot(departure["v"][-1], departure["omega"][-1]))

    window = np.linspace(0.0, 30.0, 61)
    means = []
    for s in (places := lap.s[lap.s < lap.period - 30.0]):
        means.append(np.interp(s + window, lap.s, stability.growth).mean())
    assert slid(places[np.argmax(means)]) > 2e-3 > 1e-3 > slid(places[np.argmin(means)])


def test_a_gust_whose_path_leaves_the_lap_is_refused(lap) -> None:
    with pytest.raises(ValueError, match=r"from 690 m to 720 m must lie within the lap"):
        slide_along_lap(lap, 690.0, 1e-3, 30.0)
