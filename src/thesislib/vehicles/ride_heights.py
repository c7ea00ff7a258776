"""What a car asks of a suspension: normal tyre loads to ride heights and roll angles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol


class RideHeights(Protocol):
    """Heights in m (positive down) and roll angles in rad of the two axles."""

    @property
    def h_f(self) -> Any: ...
    @property
    def h_r(self) -> Any: ...
    @property
    def phi_f(self) -> Any: ...
    @property
    def phi_r(self) -> Any: ...


class RideHeightModel(Protocol):
    """What the car asks of its suspension: normal loads to ride heights and roll angles."""

    @property
    def values(self) -> Mapping[str, float]:
        """The model's own parameters that may be replaced by symbols, SI."""

    def heights(
        self, F_flz: Any, F_frz: Any, F_rlz: Any, F_rrz: Any, values: Mapping[str, Any]
    ) -> RideHeights:
        """Return the posture for four vertical tyre forces in N (SAE, negative)."""
