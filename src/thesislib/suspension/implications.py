"""What a table of metamodel coefficients says about the axle behind it.

The coefficients of the published tables are compared with what mechanics allows any axle: with Maxwell
and Betti's reciprocity, with the most that a spring can change an axle's compliance, and with each other.
"""

from __future__ import annotations

from dataclasses import dataclass

from thesislib.suspension.surrogate import AxleMetamodel
from thesislib.suspension.tyre import vertical_stiffness


@dataclass(frozen=True)
class Reciprocity:
    """Maxwell and Betti's relation in the quadratic coefficients of an axle's metamodel.

    If vertical loads act on a conservative axle, the change of the left contact height with the right load
    is that of the right contact height with the left load. With h and phi quadratic in the loads this ties
    the coefficient of F_l^2 in phi to two of h: phi_FF = (h_FlFr - 2 h_FF) / (2 w).

    Attributes
    ----------
    ratio : float
        phi_FF 2 w / (h_FlFr - 2 h_FF): 1 for a conservative axle whose contacts stay in place.
    half_track : float
        w in m that would make the ratio 1.
    """

    ratio: float
    half_track: float


def reciprocity(metamodel: AxleMetamodel, half_track: float) -> Reciprocity:
    """Return how far a metamodel of an axle with half-track `half_track` (m) is from reciprocal."""
    rest = (0,) * (len(metamodel.box) - 2)
    heave = metamodel.coefficient("h", 1, 1, *rest) - 2.0 * metamodel.coefficient("h", 2, 0, *rest)
    roll = metamodel.coefficient("phi", 2, 0, *rest)
    implied = 1e-3 * heave / (2.0 * roll)
    return Reciprocity(half_track / implied, implied)


@dataclass(frozen=True)
class SpringSensitivity:
    """How much a metamodel's heave compliance changes with the heave spring, and how much it may.

    Attributes
    ----------
    compliance : float
        c: how far the axle sinks per load on each wheel beyond the tyres' squash, m/N.
    change : float
        -dc/dK_h of the metamodel, m/N per N/m.
    bound : float
        c / K_h. With c = 1 / (k + m K_h) for a spring of stiffness K_h beside others k >= 0, -dc/dK_h is
        m c^2 = (c / K_h) (m K_h c), and m K_h c <= 1.
    """

    compliance: float
    change: float
    bound: float

    @property
    def ratio(self) -> float:
        """`change` over `bound`: at most 1 for springs."""
        return self.change / self.bound


def spring_sensitivity(metamodel: AxleMetamodel, load: float, K_h: float) -> SpringSensitivity:
    """Return the sensitivity of a metamodel with stiffness at equal loads `load` (N) and `K_h` (N/m)."""
    F, K = 1e-3 * load, 1e-3 * K_h
    single, square, product, mixed = (
        metamodel.coefficient("h", *powers) for powers in ((1, 0, 0), (2, 0, 0), (1, 1, 0), (1, 0, 1))
    )
    sinking = -(2.0 * single + 2.0 * (2.0 * square + product) * F + 2.0 * mixed * K)  # mm/kN
    compliance = 1e-6 * sinking - 1.0 / vertical_stiffness(load)
    return SpringSensitivity(compliance, 2e-9 * mixed, compliance / K_h)
