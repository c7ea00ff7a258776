"""The quasi-static suspension metamodel: normal tyre loads to ride heights and roll angles (section 3.2.1).

Sign of the loads. Table 3.1 gives them in kN without a sign. Its coefficients reproduce the text of the
chapter only with the SAE one, F < 0 for a tyre that carries the car: -22 mm unloaded and +6.7 mm at -6 kN per
wheel in front, a nose at -14 mm when the car stands. In a right-hand turn the left wheels carry more and
the roll angle is negative.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

from numpy.typing import ArrayLike

from thesislib import provenance
from thesislib.polynomials import basis_size, polynomial
from thesislib.suspension.surrogate import AxleMetamodel

_DEGREE = 2
_AXLE_QUANTITIES = {"h_f": "mm", "phi_f": "rad", "h_r": "mm", "phi_r": "rad"}

RearConstant = Literal["printed", "text"]


@dataclass(frozen=True)
class Posture:
    """How the car stands: ride heights in m, positive down (SAE), and roll angles in rad.

    Entries are floats, numpy arrays or casadi expressions, as the loads were.
    """

    h_f: Any
    h_r: Any
    phi_f: Any
    phi_r: Any


@dataclass(frozen=True)
class Metamodel:
    """Quadratic polynomials of the two normal loads of each axle.

    Attributes
    ----------
    name : str
        Name of the coefficient table.
    h_f, phi_f, h_r, phi_r : tuple of float
        Six coefficients each, of 1, F_l, F_r, F_l^2, F_l F_r, F_r^2, loads in kN (SAE, negative); ride
        heights in mm, roll angles in rad.
    heaviest_front, heaviest_rear : float
        Heaviest vertical force of the meshes that were fitted, N; the polynomials are known from zero to it
        and continued beyond.
    """

    name: str
    h_f: tuple[float, ...]
    phi_f: tuple[float, ...]
    h_r: tuple[float, ...]
    phi_r: tuple[float, ...]
    heaviest_front: float = -math.inf
    heaviest_rear: float = -math.inf

    def __post_init__(self) -> None:
        size = basis_size(2, _DEGREE)
        for quantity in _AXLE_QUANTITIES:
            coefficients = getattr(self, quantity)
            if len(coefficients) != size or not all(math.isfinite(one) for one in coefficients):
                raise ValueError(
                    f"{quantity} of the metamodel {self.name} needs {size} finite coefficients, "
                    f"not {coefficients}."
                )

    @classmethod
    def from_file(
        cls, name_or_path: str | Path = "metamodel_table_3_1", *, rear_constant: RearConstant = "printed"
    ) -> Metamodel:
        """Read the coefficients from ``data/suspension`` or from the path of a TOML file.

        Parameters
        ----------
        name_or_path : str or Path
            Table in ``data/suspension`` or TOML file.
        rear_constant : {"printed", "text"}
            Constant of the rear ride height: -89.04 mm as printed in Table 3.1, or -88.04 mm, which the
            heights in the text of chapter 3 imply.

        Raises
        ------
        FileNotFoundError
            If there is no such table.
        ValueError
            If the file lacks a quantity, has another unit or number of coefficients, or the reading of
            the constant is unknown.
        """
        readings = get_args(RearConstant)
        if rear_constant not in readings:
            raise ValueError(f"rear_constant = {rear_constant!r} is not one of {', '.join(readings)}.")
        path, content, tables = read_table(name_or_path)
        numbers: dict[str, Any] = {**tables, **heaviest_loads(content)}
        model = cls(path.stem, **numbers)
        if rear_constant == "printed":
            return model
        if "constant_from_text" not in content["h_r"]:
            raise ValueError(
                f"{path.name}: [h_r] has no constant_from_text, which rear_constant='text' asks for."
            )
        return replace(model, h_r=(float(content["h_r"]["constant_from_text"]), *model.h_r[1:]))

    @property
    def values(self) -> dict[str, float]:
        """Ride heights of the unloaded axles in m: what an adjustment of ride height moves."""
        return {"h_f_unloaded": self.h_f[0] * 1e-3, "h_r_unloaded": self.h_r[0] * 1e-3}

    @property
    def front(self) -> AxleMetamodel:
        """The front axle's polynomials by themselves."""
        box = 2 * ((self.heaviest_front, 0.0),)
        return AxleMetamodel(f"{self.name}, front", _DEGREE, self.h_f, self.phi_f, box)

    @property
    def rear(self) -> AxleMetamodel:
        """The rear axle's polynomials by themselves."""
        box = 2 * ((self.heaviest_rear, 0.0),)
        return AxleMetamodel(f"{self.name}, rear", _DEGREE, self.h_r, self.phi_r, box)

    def time_outside(self, t: ArrayLike, front: ArrayLike, rear: ArrayLike) -> dict[str, float]:
        """Return how long each axle's loads lie outside the mesh that was fitted, in s.

        Parameters
        ----------
        t : array_like, shape (N,)
            Time, s, increasing.
        front, rear : array_like, shape (N, 2)
            Vertical forces of the left and right tyre of the axle, N (SAE).
        """
        return {"front": self.front.time_outside(t, front), "rear": self.rear.time_outside(t, rear)}

    def heights(
        self, F_flz: Any, F_frz: Any, F_rlz: Any, F_rrz: Any, values: Mapping[str, Any] | None = None
    ) -> Posture:
        """Return ride heights and roll angles for four vertical tyre forces.

        Parameters
        ----------
        F_flz, F_frz, F_rlz, F_rrz : float, numpy.ndarray or casadi expression
            Vertical tyre forces in N, SAE: negative when the tyre carries the car.
        values : mapping, optional
            May replace the entries of `values`, for example by casadi symbols; other names are ignored,
            since a car passes all its own.
        """
        given = {**self.values, **(values or {})}
        front = (F_flz * 1e-3, F_frz * 1e-3)
        rear = (F_rlz * 1e-3, F_rrz * 1e-3)
        return Posture(
            h_f=given["h_f_unloaded"] + 1e-3 * polynomial((0.0, *self.h_f[1:]), front, _DEGREE),
            h_r=given["h_r_unloaded"] + 1e-3 * polynomial((0.0, *self.h_r[1:]), rear, _DEGREE),
            phi_f=polynomial(self.phi_f, front, _DEGREE),
            phi_r=polynomial(self.phi_r, rear, _DEGREE),
        )


def read_table(
    name_or_path: str | Path,
) -> tuple[Path, dict[str, Any], dict[str, tuple[float, ...]]]:
    """Read a table of metamodel coefficients: its path, all of it, and the coefficients by quantity.

    Raises
    ------
    FileNotFoundError
        If there is no such table.
    ValueError
        If a quantity is missing or has another unit.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        path = provenance.project_root() / "data" / "suspension" / f"{name_or_path}.toml"
    if not path.is_file():
        raise FileNotFoundError(f"There is no metamodel {name_or_path}: {path} does not exist.")
    with path.open("rb") as stream:
        content = tomllib.load(stream)
    tables = {}
    for quantity, unit in _AXLE_QUANTITIES.items():
        table = content.get(quantity)
        if not isinstance(table, Mapping) or table.get("unit") != unit or "coefficients" not in table:
            raise ValueError(f"{path.name}: [{quantity}] must have unit = {unit!r} and coefficients.")
        tables[quantity] = tuple(float(one) for one in table["coefficients"])
    return path, content, tables


def heaviest_loads(content: Mapping[str, Any]) -> dict[str, float]:
    """Return the heaviest loads of the fitted meshes in N, if the table says them."""
    mesh = content.get("mesh", {})
    return {
        f"heaviest_{axle}": 1e3 * float(mesh[f"{axle}_kN"])
        for axle in ("front", "rear")
        if f"{axle}_kN" in mesh
    }
