"""What acts on the two wheels of an axle, and how the car then stands on them (figure 3.8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WheelLoads:
    """Tyre forces, tyre moments and steer of an axle, for any number of cases at once.

    Attributes
    ----------
    left, right : numpy.ndarray, shape (N, 3)
        Tyre force at the contact point in chassis axes, N; z is negative when the tyre carries.
    left_moment, right_moment : numpy.ndarray, shape (N, 3)
        Tyre moment M_T, N m.
    steer : numpy.ndarray, shape (N,)
        Angle of the steering pinion, rad.
    shape : tuple of int
        Shape of the arrays the loads were made from; results can be given it back.
    """

    left: Array
    right: Array
    left_moment: Array
    right_moment: Array
    steer: Array
    shape: tuple[int, ...]

    @classmethod
    def of(
        cls,
        F_l: ArrayLike,
        F_r: ArrayLike,
        *,
        left: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
        right: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
        left_moment: tuple[ArrayLike, ArrayLike, ArrayLike] = (0.0, 0.0, 0.0),
        right_moment: tuple[ArrayLike, ArrayLike, ArrayLike] = (0.0, 0.0, 0.0),
        steer: ArrayLike = 0.0,
    ) -> WheelLoads:
        """Return loads from vertical forces and, if wanted, what section 3.2.1 neglects.

        Parameters
        ----------
        F_l, F_r : array_like
            Vertical tyre forces, N, SAE: at most 0.
        left, right : pair of array_like
            Longitudinal and lateral tyre force, N.
        left_moment, right_moment : triple of array_like
            Tyre moment, N m.
        steer : array_like
            Angle of the steering pinion, rad.

        Raises
        ------
        ValueError
            If a number is not finite or a vertical force pulls the wheel to the road.
        """
        given = (F_l, F_r, *left, *right, *left_moment, *right_moment, steer)
        every = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in given))
        shape = every[0].shape
        flat = [np.ravel(one) for one in every]
        if not all(np.all(np.isfinite(one)) for one in flat):
            raise ValueError("A wheel load or the steer angle is not a finite number.")
        highest = max(flat[0].max(initial=0.0), flat[1].max(initial=0.0))
        if highest > 0.0:
            raise ValueError(
                f"A vertical tyre force of {highest:g} N pulls the wheel to the road; SAE forces of a tyre "
                "that carries are at most 0."
            )
        return cls(
            np.column_stack((flat[2], flat[3], flat[0])),
            np.column_stack((flat[4], flat[5], flat[1])),
            np.column_stack(flat[6:9]),
            np.column_stack(flat[9:12]),
            flat[12],
            shape,
        )

    @property
    def vertical_only(self) -> bool:
        """Whether nothing but vertical forces act, as in the metamodels."""
        others = (self.left[:, :2], self.right[:, :2], self.left_moment, self.right_moment)
        return not any(np.any(one) for one in others)

    def __len__(self) -> int:
        return len(self.steer)


@dataclass(frozen=True)
class Stance:
    """How an axle stands: contact points in chassis axes, and what follows from them.

    Attributes
    ----------
    contact_left, contact_right : numpy.ndarray, shape (N, 3)
        Contact points Q_GC, m.
    height : numpy.ndarray, shape (N,)
        Ride height in m, positive down: minus the height of the reference plane above the road, on the
        centre line.
    roll : numpy.ndarray, shape (N,)
        Roll angle in rad, positive with the right side down.
    """

    contact_left: Array
    contact_right: Array
    height: Array
    roll: Array


def stance(contact_left: Array, contact_right: Array, reference_plane: float) -> Stance:
    """Return ride height and roll angle of the car on two contact points, figure 3.8.

    The road is the line through both points. In road axes the reference plane, at z = `reference_plane`
    in the chassis, lies at the height where the chassis's centre line meets it.
    """
    across = contact_right - contact_left
    slope = across[..., 2] / across[..., 1]
    road = contact_left[..., 2] - slope * contact_left[..., 1]
    roll = -np.arctan(slope)
    return Stance(contact_left, contact_right, (reference_plane - road) * np.cos(roll), roll)
