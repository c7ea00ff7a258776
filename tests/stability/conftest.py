"""A car and its certified regions of degree 2 and 4, made once."""

from types import SimpleNamespace

import numpy as np
import pytest

from thesislib.stability.ascent import Goal, ascend, scaled_window, scaling
from thesislib.stability.bicycle import Bicycle
from thesislib.stability.cases import GOAL_FACTOR
from thesislib.stability.fields import ExactCar
from thesislib.stability.phase_plane import true_region


@pytest.fixture(scope="session")
def car():
    return Bicycle.from_file()


@pytest.fixture(scope="session")
def magic():
    return Bicycle.from_file(tyres="magic")


@pytest.fixture(scope="session")
def truth(car):
    return true_region(car)


@pytest.fixture(scope="session")
def exact(car):
    return ExactCar.at_trim(car)


@pytest.fixture(scope="session")
def found(car, magic, truth, exact):
    to_state = scaling(car.matrix)
    window = scaled_window(truth.speed_window(GOAL_FACTOR), to_state, truth.trim)
    stiff = np.linalg.solve(to_state, magic.jacobian(np.zeros(2)) @ to_state)
    regions = ascend([exact], [2, 4], Goal(window=window), to_state, stiff=stiff)
    return SimpleNamespace(to_state=to_state, regions=regions)
