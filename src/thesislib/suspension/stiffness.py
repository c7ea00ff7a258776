"""The metamodel with the heave springs' stiffnesses among its inputs, Table 3.2."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from thesislib.suspension.metamodel import Metamodel, Posture, heaviest_loads, read_table
from thesislib.suspension.surrogate import AxleMetamodel

_DEGREE = 2
_MESH = 31


@dataclass(frozen=True)
class StiffnessMetamodel:
    """Quadratic polynomials of the two normal loads of each axle and of its heave stiffness.

    Attributes
    ----------
    name : str
        Name of the coefficient table.
    h_f, phi_f, h_r, phi_r : tuple of float
        Ten coefficients each, of 1, F_l, F_r, K_h, F_l^2, F_l F_r, F_l K_h, F_r^2, F_r K_h, K_h^2; loads in
        kN (SAE, negative), the axle's own stiffness in kN/m, heights in mm, angles in rad.
    nominal_front, nominal_rear : float
        Nominal stiffnesses, N/m.
    heaviest_front, heaviest_rear : float
        Heaviest vertical force of the meshes that were fitted, N.
    """

    name: str
    h_f: tuple[float, ...]
    phi_f: tuple[float, ...]
    h_r: tuple[float, ...]
    phi_r: tuple[float, ...]
    nominal_front: float = 1.0e6
    nominal_rear: float = 0.65e6
    heaviest_front: float = -math.inf
    heaviest_rear: float = -math.inf

    def __post_init__(self) -> None:
        for axle in ("front", "rear"):
            getattr(self, axle)  # refuses a wrong number of coefficients
            if not getattr(self, f"nominal_{axle}") > 0.0:
                raise ValueError(
                    f"nominal_{axle} = {getattr(self, f'nominal_{axle}'):g} N/m of {self.name} must be above "
                    "zero."
                )

    @classmethod
    def from_file(cls, name_or_path: str | Path = "metamodel_table_3_2") -> StiffnessMetamodel:
        """Read the coefficients as printed, from ``data/suspension`` or from the path of a TOML file.

        Raises
        ------
        FileNotFoundError
            If there is no such table.
        ValueError
            If the file lacks a quantity, or has another unit or number of coefficients.
        """
        path, content, tables = read_table(name_or_path)
        mesh = content.get("mesh", {})
        nominal = {
            f"nominal_{axle}": 1e3 * float(mesh[f"{axle}_nominal_kN_per_m"])
            for axle in ("front", "rear")
            if f"{axle}_nominal_kN_per_m" in mesh
        }
        numbers: dict[str, Any] = {**tables, **nominal, **heaviest_loads(content)}
        return cls(path.stem, **numbers)

    @property
    def front(self) -> AxleMetamodel:
        """The front axle's polynomials by themselves; the box of the stiffness is not printed."""
        box = (*2 * ((self.heaviest_front, 0.0),), (0.0, math.inf))
        return AxleMetamodel(f"{self.name}, front", _DEGREE, self.h_f, self.phi_f, box)

    @property
    def rear(self) -> AxleMetamodel:
        """The rear axle's polynomials by themselves; the box of the stiffness is not printed."""
        box = (*2 * ((self.heaviest_rear, 0.0),), (0.0, math.inf))
        return AxleMetamodel(f"{self.name}, rear", _DEGREE, self.h_r, self.phi_r, box)

    def offsets(self, other: Metamodel) -> dict[str, tuple[float, float]]:
        """Compare ride heights at nominal stiffness with those of a metamodel without it.

        Returns
        -------
        dict of str to pair of float
            For ``"front"`` and ``"rear"``: the constant that brings the two tables closest over the mesh of
            loads, and the largest difference that it leaves, m.
        """
        found = {}
        for axle, K_h in (("front", self.nominal_front), ("rear", self.nominal_rear)):
            mine, theirs = getattr(self, axle), getattr(other, axle)
            load = np.linspace(0.0, getattr(self, f"heaviest_{axle}"), _MESH)
            F_l, F_r = np.meshgrid(load, load)
            difference = mine(F_l, F_r, K_h)[0] - theirs(F_l, F_r)[0]
            middle = 0.5 * float(difference.max() + difference.min())
            found[axle] = (middle, float(np.abs(difference - middle).max()))
        return found

    def reconciled(self, other: Metamodel) -> StiffnessMetamodel:
        """Return the table with both ride-height constants moved to those of a table without stiffness.

        At nominal stiffness Table 3.2 stands about 1.3 mm above Table 3.1 everywhere. Laps with the one
        cannot be compared with laps of the other before that constant is gone. It is the constant of
        :meth:`offsets` that is taken away; what it leaves are the fits' own errors.
        """
        shift = self.offsets(other)
        return replace(
            self,
            name=f"{self.name}, reconciled to {other.name}",
            h_f=(self.h_f[0] - 1e3 * shift["front"][0], *self.h_f[1:]),
            h_r=(self.h_r[0] - 1e3 * shift["rear"][0], *self.h_r[1:]),
        )

    @property
    def values(self) -> dict[str, float]:
        """Heights of the unloaded axles at nominal stiffness in m, and the stiffnesses in N/m."""
        return {
            "h_f_unloaded": float(self.front(0.0, 0.0, self.nominal_front)[0]),
            "h_r_unloaded": float(self.rear(0.0, 0.0, self.nominal_rear)[0]),
            "K_h_front": self.nominal_front,
            "K_h_rear": self.nominal_rear,
        }

    def heights(
        self, F_flz: Any, F_frz: Any, F_rlz: Any, F_rrz: Any, values: Mapping[str, Any] | None = None
    ) -> Posture:
        """Return ride heights and roll angles for four vertical tyre forces.

        Parameters
        ----------
        F_flz, F_frz, F_rlz, F_rrz : float, numpy.ndarray or casadi expression
            Vertical tyre forces in N, SAE: negative when the tyre carries the car.
        values : mapping, optional
            May replace the entries of `values`; other names are ignored, since a car passes all its own.
            Moving ``h_f_unloaded`` moves the front axle by as much at every load and stiffness.
        """
        own = self.values
        given = {**own, **(values or {})}
        h_f, phi_f = self.front(F_flz, F_frz, given["K_h_front"])
        h_r, phi_r = self.rear(F_rlz, F_rrz, given["K_h_rear"])
        return Posture(
            h_f=h_f + (given["h_f_unloaded"] - own["h_f_unloaded"]),
            h_r=h_r + (given["h_r_unloaded"] - own["h_r_unloaded"]),
            phi_f=phi_f,
            phi_r=phi_r,
        )


@dataclass(frozen=True)
class StiffenedMetamodel:
    """A metamodel without stiffness, moved by what Table 3.2 says that a change of stiffness adds.

    At nominal stiffness it is the metamodel itself. It is for small changes: where the two tables differ at
    nominal stiffness, their slopes by the loads differ as well.

    Attributes
    ----------
    base : Metamodel
        Ride heights and roll angles at nominal stiffness.
    table : StiffnessMetamodel
        What stiffness adds to them.
    """

    base: Metamodel
    table: StiffnessMetamodel

    @property
    def values(self) -> dict[str, float]:
        """Heights of the unloaded axles in m as the base has them, and the stiffnesses in N/m."""
        return {**self.table.values, **self.base.values}

    def heights(
        self, F_flz: Any, F_frz: Any, F_rlz: Any, F_rrz: Any, values: Mapping[str, Any] | None = None
    ) -> Posture:
        """Return ride heights and roll angles for four vertical tyre forces, as `StiffnessMetamodel`."""
        given = {**self.values, **(values or {})}
        base = self.base.heights(F_flz, F_frz, F_rlz, F_rrz, given)
        nominal = self.table.values
        stiffness = {name: given[name] for name in ("K_h_front", "K_h_rear")}
        before, after = (
            self.table.heights(F_flz, F_frz, F_rlz, F_rrz, {**nominal, **change})
            for change in ({}, stiffness)
        )
        return Posture(
            h_f=base.h_f + (after.h_f - before.h_f),
            h_r=base.h_r + (after.h_r - before.h_r),
            phi_f=base.phi_f + (after.phi_f - before.phi_f),
            phi_r=base.phi_r + (after.phi_r - before.phi_r),
        )
