"""A suspension's metamodel that is not continued beyond the loads it was fitted to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from thesislib.smoothing import smooth_maximum
from thesislib.suspension.metamodel import Metamodel, Posture
from thesislib.suspension.stiffness import StiffnessMetamodel

CORNER: Final = 50.0**2
"""In N²: a held load turns the corner within some 50 N, so that second derivatives exist there."""


@dataclass(frozen=True)
class HeldHeights:
    """A metamodel whose ride heights stay, beyond the heaviest load of a mesh, what they are at its edge.

    Each tyre's load is held by itself. Roll angles go on as the model continues them: they say how the axles
    share the roll moment, (4.19), and an axle whose roll angle stopped growing would share any.

    Attributes
    ----------
    model : Metamodel or StiffnessMetamodel
        The metamodel; its heaviest loads are the edges.

    Raises
    ------
    ValueError
        If the model does not know its heaviest loads.
    """

    model: Metamodel | StiffnessMetamodel

    def __post_init__(self) -> None:
        for axle in ("front", "rear"):
            heaviest = getattr(self.model, f"heaviest_{axle}")
            if not math.isfinite(heaviest):
                raise ValueError(
                    f"heaviest_{axle} = {heaviest} of the metamodel {self.model.name} is no edge; a "
                    "metamodel can be held only where its mesh of loads is known."
                )

    @property
    def values(self) -> dict[str, float]:
        """The model's own parameters."""
        return self.model.values

    def heights(
        self, F_flz: Any, F_frz: Any, F_rlz: Any, F_rrz: Any, values: Mapping[str, Any] | None = None
    ) -> Posture:
        """Return ride heights at the held loads and roll angles at the loads; see `Metamodel.heights`."""
        fronts = [smooth_maximum(load, CORNER, self.model.heaviest_front) for load in (F_flz, F_frz)]
        rears = [smooth_maximum(load, CORNER, self.model.heaviest_rear) for load in (F_rlz, F_rrz)]
        held = self.model.heights(fronts[0], fronts[1], rears[0], rears[1], values)
        free = self.model.heights(F_flz, F_frz, F_rlz, F_rrz, values)
        return Posture(h_f=held.h_f, h_r=held.h_r, phi_f=free.phi_f, phi_r=free.phi_r)
