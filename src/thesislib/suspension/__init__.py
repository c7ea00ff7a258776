"""Suspension models: normal tyre loads to ride heights and roll angles."""

from thesislib.suspension.axle import Axle, GeometryError
from thesislib.suspension.loads import WheelLoads
from thesislib.suspension.metamodel import Metamodel, Posture
from thesislib.suspension.stiffness import StiffnessMetamodel
from thesislib.suspension.surrogate import AxleMetamodel

__all__ = [
    "Axle",
    "AxleMetamodel",
    "GeometryError",
    "Metamodel",
    "Posture",
    "StiffnessMetamodel",
    "WheelLoads",
]
