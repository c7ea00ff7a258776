"""How a lap uses its tyres and brakes, in the few numbers that stand in a row of a table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thesislib.lap.channels import WHEEL_NAMES, brake_share, time_shares
from thesislib.lap.minimum_time import Lap
from thesislib.vehicles.tyres import peak_combined_slip


@dataclass(frozen=True)
class TyreUse:
    """Combined slip and brake share of a lap.

    Attributes
    ----------
    peak_slip : float
        Combined slip (B.9) at which a tyre gives its greatest force.
    beyond_peak_front, beyond_peak_rear : float
        Share of the lap time, 0 .. 1, for which a wheel of the axle slips more than that.
    largest_slip : dict of str to float
        Largest combined slip of each wheel, ``fl`` ….
    brake_share_low, brake_share_median, brake_share_high : float
        Front axle's share of the braking force, 0 .. 1: the values that it stays below for 10, 50 and 90 % of
        the braking time.
    """

    peak_slip: float
    beyond_peak_front: float
    beyond_peak_rear: float
    largest_slip: dict[str, float]
    brake_share_low: float
    brake_share_median: float
    brake_share_high: float


def tyre_use(lap: Lap) -> TyreUse:
    """Return the combined slip and the brake share of a lap in numbers.

    Shares are of time, so that they do not depend on where the mesh is fine.

    Raises
    ------
    ValueError
        If the two shape factors differ: the tyre then has no one slip of greatest force; or if the car never
        brakes.
    """
    values = lap.values
    if values["Q_x"] != values["Q_y"]:
        raise ValueError(
            f"The shape factors Q_x = {values['Q_x']:g} and Q_y = {values['Q_y']:g} differ; the friction "
            "peak then lies at another combined slip along than across the wheel."
        )
    peak = peak_combined_slip(values["Q_x"], lap.car.readings.shape_factor)
    shares = time_shares(lap) / lap.time
    beyond = {wheel: lap[f"rho_{wheel}"] > peak for wheel in WHEEL_NAMES}
    fronts = brake_share(lap)
    braking = np.isfinite(fronts)
    if not braking.any():
        raise ValueError(f"The car of {lap.name} never brakes; its brake share means nothing.")
    low, median, high = np.quantile(
        fronts[braking], (0.1, 0.5, 0.9), weights=shares[braking], method="inverted_cdf"
    )
    return TyreUse(
        peak,
        float(shares @ (beyond["fl"] | beyond["fr"])),
        float(shares @ (beyond["rl"] | beyond["rr"])),
        {wheel: float(lap[f"rho_{wheel}"].max()) for wheel in WHEEL_NAMES},
        float(low),
        float(median),
        float(high),
    )
