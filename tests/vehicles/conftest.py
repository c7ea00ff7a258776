"""The racing car in a cornering state, and what its tests need to move between numbers and symbols."""

import numpy as np
import pytest

from thesislib.suspension import Metamodel
from thesislib.vehicles import RacingCar, Readings

# right-hand turn under power: the left wheels carry more
STATE = {"n": 1.2, "xi": 0.03, "v": -0.7, "u": 48.0, "omega": 0.55}
CONTROL = {
    "delta": 0.06,
    "kappa_fl": -0.004,
    "kappa_fr": -0.011,
    "kappa_rl": 0.03,
    "kappa_rr": 0.045,
    "F_flz": -4300.0,
    "F_frz": -2100.0,
    "F_rlz": -5200.0,
    "F_rrz": -2600.0,
}
CURVATURE = 0.011

MIRRORED_STATE = {"n": -1.2, "xi": -0.03, "v": 0.7, "u": 48.0, "omega": -0.55}
MIRRORED_CONTROL = {
    "delta": -0.06,
    "kappa_fl": -0.011,
    "kappa_fr": -0.004,
    "kappa_rl": 0.045,
    "kappa_rr": 0.03,
    "F_flz": -2100.0,
    "F_frz": -4300.0,
    "F_rlz": -2600.0,
    "F_rrz": -5200.0,
}

READINGS = {
    "as printed": Readings(),
    "drag at the mass centre": Readings(drag_moment="mass_centre"),
    "power at the hubs": Readings(power_law="hub"),
    "peak at one": Readings(shape_factor="peak_at_one"),
    "fixed brake ratio": Readings(brake="free", fixed_brake_ratio=0.6),
    "tyre held within its data": Readings(tyre_load_range="held"),
    "rigid without angles": Readings(suspension="rigid", aero_angles=False),
}


@pytest.fixture(scope="session")
def ride() -> Metamodel:
    return Metamodel.from_file()


@pytest.fixture(scope="session")
def car(ride) -> RacingCar:
    return RacingCar.from_file("racing_car", ride=ride)


@pytest.fixture(params=list(READINGS))
def car_of_any_reading(request, ride) -> RacingCar:
    return RacingCar.from_file("racing_car", ride=ride, readings=READINGS[request.param])


@pytest.fixture
def here():
    """State, control and curvature of a right-hand turn."""
    return dict(STATE), dict(CONTROL), CURVATURE


@pytest.fixture
def mirrored():
    """The same turn to the left."""
    return dict(MIRRORED_STATE), dict(MIRRORED_CONTROL), -CURVATURE


@pytest.fixture
def many_points():
    """Two hundred states and controls around the turn, as arrays."""
    random = np.random.default_rng(7)

    def spread(centre):
        return {name: value * random.uniform(0.5, 1.5, size=200) for name, value in centre.items()}

    return spread(STATE), spread(CONTROL), CURVATURE * random.uniform(-1.0, 1.0, size=200)
