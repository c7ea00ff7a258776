"""Roads: centre lines, their files and corners, and smoother or rougher variants of them."""

from thesislib.roads.centreline import CentreLine, Closure
from thesislib.roads.corners import Corner, corners
from thesislib.roads.reading import RoadFileError, load, names
from thesislib.roads.smoothing import offsets, smoothed

__all__ = [
    "CentreLine",
    "Closure",
    "Corner",
    "RoadFileError",
    "corners",
    "load",
    "names",
    "offsets",
    "smoothed",
]
