"""The two axles of the car, their solvers, and load cases spread over their meshes."""

import numpy as np
import pytest

from thesislib.suspension import Axle, WheelLoads
from thesislib.suspension.mechanism import Mechanism
from thesislib.suspension.reduced import ReducedAxle

# the car at rest: 660 kg, mass centre 1.8 m behind the front axle of a 3.4 m wheelbase; N per wheel, SAE
AT_REST = {"front": -660 * 9.80665 * 1.6 / 3.4 / 2, "rear": -660 * 9.80665 * 1.8 / 3.4 / 2}
HEAVIEST = {"front": -6000.0, "rear": -8000.0}
NOMINAL = {"front": -14.0e-3, "rear": -74.1e-3}


@pytest.fixture(scope="session", params=["front", "rear"])
def which(request):
    return request.param


@pytest.fixture(scope="session")
def axles():
    return {name: Axle.from_file(f"{name}_axle") for name in ("front", "rear")}


@pytest.fixture(scope="session")
def front(axles):
    return axles["front"]


@pytest.fixture(scope="session")
def axle(axles, which):
    return axles[which]


@pytest.fixture(scope="session")
def mechanism(axle):
    return Mechanism(axle)


@pytest.fixture(scope="session")
def reduced(axle):
    return ReducedAxle(axle)


@pytest.fixture(scope="session")
def at_rest(which):
    return AT_REST[which]


@pytest.fixture(scope="session")
def nominal(which):
    return NOMINAL[which]


@pytest.fixture(scope="session")
def heaviest(which):
    return HEAVIEST[which]


@pytest.fixture(scope="session")
def forces(heaviest):
    return np.random.default_rng(3).uniform(heaviest, -300.0, (2, 40))


@pytest.fixture(scope="session")
def loads(forces):
    return WheelLoads.of(*forces)
