"""One axle's suspension: where its joints are, how stiff its springs, and whether it can work (section 3.2).

Every number belongs to the left side; the right side is its mirror image in the plane y = 0. Axes are
SAE's (x forward, y right, z down); the origin lies on the car's centre line at the height of the wheel
centres when the car stands at rest. That posture is the design position: rocker angle zero, heave
spring unstressed, and the torsion bar's preload carries the car.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thesislib import provenance

Array = NDArray[np.float64]

GRAVITY = 9.80665
"""Standard gravity, m/s^2."""

MIRROR = np.array([1.0, -1.0, 1.0])
"""Factors that turn a point of the left side into the right side's."""

LINKS = ("upper fore", "upper aft", "lower fore", "lower aft", "track rod", "push rod")
"""Links 1 to 6 of (3.1), in order; link 6 may be a pull rod."""

_LENGTH_TOLERANCE = 1e-6  # m: a length given to the micrometre must be the distance of its points
_SHORTEST_LEVER = 1e-3  # m: a rod that passes closer to the axis it turns is at its dead centre
_POSITIVE = ("torsion_stiffness", "anti_roll_stiffness", "heave_stiffness", "carrier_mass")


class GeometryError(ValueError):
    """A suspension that cannot be built or cannot move; the message says what is wrong with it."""


@dataclass(frozen=True)
class Axle:
    """Hard points and springs of one axle. Lengths in m, forces in N, angles in rad.

    Attributes
    ----------
    name : str
        What error messages call the axle.
    chassis : numpy.ndarray, shape (5, 3)
        P_1 to P_5: inner ends of links 1 to 5.
    carrier : numpy.ndarray, shape (6, 3)
        Q_1 to Q_6: outer ends of links 1 to 6.
    wheel_centre : numpy.ndarray, shape (3,)
        O_W.
    rod_end : numpy.ndarray, shape (3,)
        P_6: where the push rod meets the rocker.
    spring_end : numpy.ndarray, shape (3,)
        P_H: where the heave spring meets the rocker.
    pivot, rocker_axis : numpy.ndarray, shape (3,)
        P_RP and the unit vector n of (3.8).
    torsion_stiffness, torsion_preload : float
        K_t in N m/rad, and the torque in N m at rocker angle zero.
    anti_roll_stiffness : float
        K_arb, N m/rad.
    heave_stiffness, heave_hardening : float
        K_h(dL) = K_h (1 - b dL) of (3.10): K_h in N/m and b in 1/m; with b > 0 the spring hardens when
        it is compressed.
    heave_free_length : float
        L_0, m.
    heave_damping, rocker_damping : float
        Heave damper in N s/m, parallel to the spring, and rotational damper of each rocker in N m s/rad;
        they act in :mod:`thesislib.suspension.dynamics` only.
    carrier_mass : float
        Mass of wheel and carrier, kg, acting at the wheel centre.
    pinion_radius : float
        r of (3.2), m; 0 for an axle that is not steered.
    reference_plane : float
        z of the reference plane from which ride heights count.
    travel : tuple of float
        Least and largest wheel travel (bump positive) that is asked of the linkage.
    link_lengths : numpy.ndarray, shape (6,), optional
        l_1 to l_6; the distances of the points if not given.
    """

    name: str
    chassis: Array
    carrier: Array
    wheel_centre: Array
    rod_end: Array
    spring_end: Array
    pivot: Array
    rocker_axis: Array
    torsion_stiffness: float
    torsion_preload: float
    anti_roll_stiffness: float
    heave_stiffness: float
    heave_hardening: float
    heave_free_length: float
    heave_damping: float
    rocker_damping: float
    carrier_mass: float
    pinion_radius: float
    reference_plane: float
    travel: tuple[float, float]
    link_lengths: Array = field(default_factory=lambda: np.array([]))

    def __post_init__(self) -> None:
        for name, shape in _SHAPES.items():
            value = np.asarray(getattr(self, name), dtype=float)
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise GeometryError(
                    f"{self.name}: {name} needs finite numbers of shape {shape}, not {value.tolist()}."
                )
            object.__setattr__(self, name, value)
        for one in fields(self):
            value = getattr(self, one.name)
            if one.type == "float" and not math.isfinite(value):
                raise GeometryError(f"{self.name}: {one.name} = {value} is not a finite number.")
        _refuse_bad_springs(self)
        _refuse_bad_rocker(self)
        _refuse_bad_links(self)

    @property
    def inner_ends(self) -> Array:
        """P_1 to P_6 at rest, shape (6, 3)."""
        return np.vstack((self.chassis, self.rod_end))

    @classmethod
    def from_file(cls, name_or_path: str | Path) -> Axle:
        """Read an axle from ``data/suspension`` or from the path of a TOML file.

        Raises
        ------
        FileNotFoundError
            If there is no such file.
        GeometryError
            If an entry is missing, unknown or impossible.
        """
        path = Path(name_or_path)
        if path.suffix != ".toml":
            path = provenance.project_root() / "data" / "suspension" / f"{name_or_path}.toml"
        if not path.is_file():
            raise FileNotFoundError(f"There is no axle {name_or_path}: {path} does not exist.")
        with path.open("rb") as stream:
            content = tomllib.load(stream)
        return cls(**_entries(content, path.name))

    def with_springs(self, **changes: float) -> Axle:
        """Return the axle with other springs; the car stands as before, since they are unstressed at rest.

        Parameters
        ----------
        **changes
            Any of ``torsion_stiffness``, ``anti_roll_stiffness`` (N m/rad), ``heave_stiffness`` (N/m).

        Raises
        ------
        GeometryError
            If a stiffness is not above zero.
        TypeError
            If a name is not a spring's.
        """
        unknown = sorted(set(changes) - set(_POSITIVE[:3]))
        if unknown:
            raise TypeError(f"{', '.join(unknown)} is no spring; there are {', '.join(_POSITIVE[:3])}.")
        changed: Axle = replace(self, **changes)  # type: ignore[arg-type]
        return changed


_SHAPES: dict[str, tuple[int, ...]] = {
    "chassis": (5, 3),
    "carrier": (6, 3),
    "wheel_centre": (3,),
    "rod_end": (3,),
    "spring_end": (3,),
    "pivot": (3,),
    "rocker_axis": (3,),
}

# keys of the file: (section, key), the attribute, and how many SI units one of its units is
_SCALARS = {
    ("rocker", "torsion_stiffness_Nm_per_rad"): ("torsion_stiffness", 1.0),
    ("rocker", "torsion_preload_Nm"): ("torsion_preload", 1.0),
    ("rocker", "anti_roll_stiffness_Nm_per_rad"): ("anti_roll_stiffness", 1.0),
    ("heave_spring", "stiffness_kN_per_m"): ("heave_stiffness", 1e3),
    ("heave_spring", "hardening_per_m"): ("heave_hardening", 1.0),
    ("heave_spring", "free_length_mm"): ("heave_free_length", 1e-3),
    ("heave_spring", "damping_kNs_per_m"): ("heave_damping", 1e3),
    ("rocker", "damping_Nms_per_rad"): ("rocker_damping", 1.0),
    ("wheel", "mass_kg"): ("carrier_mass", 1.0),
    ("steering", "pinion_radius_mm"): ("pinion_radius", 1e-3),
    ("ride_height", "reference_plane_mm"): ("reference_plane", 1e-3),
}
_POINTS = {
    ("wheel", "centre_mm"): ("wheel_centre", 1e-3),
    ("rocker", "rod_end_mm"): ("rod_end", 1e-3),
    ("rocker", "spring_end_mm"): ("spring_end", 1e-3),
    ("rocker", "pivot_mm"): ("pivot", 1e-3),
    ("rocker", "axis"): ("rocker_axis", 1.0),
    ("links", "inner_mm"): ("chassis", 1e-3),
    ("links", "outer_mm"): ("carrier", 1e-3),
    ("links", "length_mm"): ("link_lengths", 1e-3),
    ("wheel", "travel_mm"): ("travel", 1e-3),
}


def _entries(content: Mapping[str, Any], file: str) -> dict[str, Any]:
    found: dict[str, Any] = {"name": content.get("name", file)}
    for (section, key), (attribute, unit) in {**_SCALARS, **_POINTS}.items():
        if key not in content.get(section, {}):
            raise GeometryError(f"{file}: [{section}] has no {key}.")
        value = content[section][key]
        found[attribute] = unit * (float(value) if (section, key) in _SCALARS else np.asarray(value, float))
    found["travel"] = tuple(found["travel"].tolist())
    known = {**_SCALARS, **_POINTS}
    for section, entries in content.items():
        for key in entries if isinstance(entries, Mapping) else ():
            if (section, key) not in known:
                raise GeometryError(f"{file}: [{section}] has an unknown entry {key}.")
    return found


def _refuse_bad_springs(axle: Axle) -> None:
    for name in _POSITIVE:
        if not getattr(axle, name) > 0.0:
            raise GeometryError(f"{axle.name}: {name} = {getattr(axle, name):g} must be above zero.")
    for name in ("pinion_radius", "heave_damping", "rocker_damping"):
        if getattr(axle, name) < 0.0:
            raise GeometryError(f"{axle.name}: {name} = {getattr(axle, name):g} is below zero.")
    low, high = axle.travel
    if not low < 0.0 < high:
        raise GeometryError(f"{axle.name}: travel {low:g} .. {high:g} m must hold the design position, zero.")


def _refuse_bad_rocker(axle: Axle) -> None:
    norm = float(np.linalg.norm(axle.rocker_axis))
    if abs(norm - 1.0) > 1e-9:
        raise GeometryError(f"{axle.name}: rocker_axis has length {norm:.9g} and must be a unit vector.")
    rod = axle.carrier[5] - axle.rod_end
    other_end = axle.spring_end * MIRROR
    for what, arm, along in (
        ("push rod", axle.rod_end - axle.pivot, rod),
        ("heave spring", axle.spring_end - axle.pivot, other_end - axle.spring_end),
    ):
        length = float(np.linalg.norm(along))
        lever = abs(float(np.cross(arm, along) @ axle.rocker_axis)) / max(length, 1e-12)
        if lever < _SHORTEST_LEVER:
            raise GeometryError(
                f"{axle.name}: the {what} passes {1e3 * lever:.2g} mm from the rocker's axis and cannot turn "
                "it; at least 1 mm is needed."
            )


def _refuse_bad_links(axle: Axle) -> None:
    if not np.all(axle.carrier[:, 1] < 0.0) or not axle.wheel_centre[1] < 0.0:
        raise GeometryError(f"{axle.name}: carrier points and wheel centre of the left side need y < 0.")
    apart = np.linalg.norm(axle.inner_ends - axle.carrier, axis=1)
    given = np.asarray(axle.link_lengths, dtype=float)
    if given.size == 0:
        object.__setattr__(axle, "link_lengths", apart)
    elif given.shape != (6,) or not np.all(np.abs(given - apart) <= _LENGTH_TOLERANCE):
        worst = int(np.argmax(np.abs(given - apart))) if given.shape == (6,) else 0
        stated = f"{1e3 * given[worst]:.3f}" if given.shape == (6,) else str(given.tolist())
        raise GeometryError(
            f"{axle.name}: the {LINKS[worst]} is {stated} mm long, but its ends are "
            f"{1e3 * apart[worst]:.3f} mm apart."
        )
    for first, which in ((0, "upper"), (2, "lower")):
        arms = axle.chassis[first : first + 2] - axle.carrier[first : first + 2]
        area = float(np.linalg.norm(np.cross(arms[0], arms[1])))
        if area < 1e-3 * float(np.prod(np.linalg.norm(arms, axis=1))):
            raise GeometryError(f"{axle.name}: the two arms of the {which} wishbone are aligned.")
    smallest = np.linalg.svd(_wrenches(axle), compute_uv=False)[-1]
    if smallest < 1e-3:
        raise GeometryError(
            f"{axle.name}: the six links do not hold the wheel carrier: their directions and moments are "
            f"dependent (smallest singular value {smallest:.1e})."
        )


def _wrenches(axle: Axle) -> Array:
    """Return direction and moment, per 0.3 m, of every link about the wheel centre: rows of shape (6, 6)."""
    along = axle.inner_ends - axle.carrier
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    moments = np.cross(axle.carrier - axle.wheel_centre, along) / 0.3
    rows: Array = np.hstack((along, moments))
    return rows
