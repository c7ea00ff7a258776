"""Vehicle models and their parameter sets."""

from thesislib.vehicles.parameters import Parameter, ParameterSet
from thesislib.vehicles.racing_car import CONTROLS, STATES, RacingCar
from thesislib.vehicles.readings import Readings
from thesislib.vehicles.ride_heights import RideHeightModel, RideHeights

__all__ = [
    "CONTROLS",
    "STATES",
    "Parameter",
    "ParameterSet",
    "RacingCar",
    "Readings",
    "RideHeightModel",
    "RideHeights",
]
