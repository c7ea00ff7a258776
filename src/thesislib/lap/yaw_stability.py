"""Is the car stable along its lap when nobody steers? Eigenvalues of lateral speed and yaw rate.

At every collocation point the forward speed, the steering, the longitudinal slips and the wheel loads are
frozen. What is left of the equations of motion in time is two equations, (4.10) and (4.12), in the lateral
speed v and the yaw rate omega; their linearisation has two eigenvalues, and a positive real part is a
growth rate: left alone, a small slide grows by e within its inverse.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from thesislib.lap.channels import time_shares
from thesislib.lap.minimum_time import Lap
from thesislib.vehicles import CONTROLS, STATES, RacingCar

Array = NDArray[np.float64]

YAW_STATES: Final = ("v", "omega")
"""The two states that move while the others are frozen."""

# The derivative of an analytic function is Im f(x + ih) / h up to a term of the order of h^2, far below
# rounding; no difference is taken, so nothing cancels.
_STEP = 1e-30


def yaw_rates(
    car: RacingCar, x: Mapping[str, Any], u: Mapping[str, Any], values: Mapping[str, Any] | None = None
) -> NDArray[Any]:
    """Return dv/dt in m/s² and domega/dt in rad/s², shape (2, N), from the car's own equations.

    Parameters
    ----------
    car : RacingCar
        The car.
    x, u : dict of ndarray (N,)
        State (4.25) and control (4.26).
    values : mapping, optional
        Numbers of the car that an adjusted set-up changes.
    """
    q = car.quantities(x, u, 0.0, values=values)  # rates in time do not depend on the road's curvature
    return np.stack([q[f"d{state}_ds"] / q["slowness"] for state in YAW_STATES])


def yaw_jacobian(
    car: RacingCar,
    x: Mapping[str, Array],
    u: Mapping[str, Array],
    values: Mapping[str, Any] | None = None,
) -> Array:
    """Return the derivatives of (dv/dt, domega/dt) by (v, omega), everything else frozen.

    Exact to rounding, by a complex step through the equations that the lap was solved with.

    Parameters
    ----------
    car, x, u, values
        As of `yaw_rates`.

    Returns
    -------
    ndarray (N, 2, 2)
        Rows dv/dt (m/s²) and domega/dt (rad/s²), columns v (m/s) and omega (rad/s).
    """
    columns = []
    for state in YAW_STATES:
        aside = {**x, state: x[state] + 1j * _STEP}
        columns.append(yaw_rates(car, aside, u, values).imag / _STEP)
    return np.stack(columns, axis=-1).transpose(1, 0, 2)


def yaw_eigenvalues(jacobian: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues (N, 2) of `yaw_jacobian` in 1/s, the one of the larger real part first."""
    eigenvalues = np.linalg.eigvals(jacobian).astype(complex)
    order = np.argsort(-eigenvalues.real, axis=1, kind="stable")
    return np.take_along_axis(eigenvalues, order, axis=1)


@dataclass(frozen=True, eq=False)
class YawStability:
    """The eigenvalues along a lap.

    Attributes
    ----------
    s : ndarray (N,)
        Distance of the collocation points, m.
    eigenvalues : ndarray of complex (N, 2)
        1/s, the one of the larger real part first.
    time_shares : ndarray (N,)
        Part of the lap time for which each point stands; they add up to one.
    """

    s: Array
    eigenvalues: NDArray[np.complex128]
    time_shares: Array

    @property
    def growth(self) -> Array:
        """Larger real part (N,) in 1/s: positive where a small slide grows."""
        return np.asarray(self.eigenvalues[:, 0].real)

    @property
    def unstable(self) -> NDArray[np.bool_]:
        """Where (N,) a small slide grows."""
        return self.growth > 0.0

    @property
    def diverging(self) -> NDArray[np.bool_]:
        """Where (N,) it grows without swinging: the spin of a car that oversteers."""
        return self.unstable & (self.eigenvalues[:, 0].imag == 0.0)

    @property
    def unstable_share(self) -> float:
        """Share of the lap time, 0 .. 1, for which a small slide grows."""
        return float(self.time_shares @ self.unstable)

    @property
    def largest_growth(self) -> float:
        """Largest growth rate of the lap, 1/s; negative if the car is stable all the way."""
        return float(self.growth.max())

    @property
    def worst(self) -> float:
        """Distance in m at which the growth rate is largest."""
        return float(self.s[np.argmax(self.growth)])


def yaw_stability(lap: Lap) -> YawStability:
    """Return the eigenvalues of lateral speed and yaw rate at every collocation point of a lap."""
    x, u = {name: lap[name] for name in STATES}, {name: lap[name] for name in CONTROLS}
    eigenvalues = yaw_eigenvalues(yaw_jacobian(lap.car, x, u, lap.values))
    return YawStability(np.asarray(lap.s), eigenvalues, time_shares(lap) / lap.time)


def frozen_slide(
    lap: Lap, s: float, disturbance: tuple[float, float], duration: float
) -> tuple[Array, Array]:
    """Simulate a slide of the frozen car from one point of a lap: the nonlinear tyres, nobody steering.

    The lap's own rates at the point are taken off, so that without a disturbance nothing moves.

    Parameters
    ----------
    lap : Lap
        The lap.
    s : float
        Distance in m; the nearest collocation point is taken.
    disturbance : (float, float)
        Sudden change of lateral speed in m/s and of yaw rate in rad/s.
    duration : float
        s.

    Returns
    -------
    t : ndarray (M,)
        s, from zero.
    slide : ndarray (2, M)
        Lateral speed in m/s and yaw rate in rad/s, less the lap's.
    """
    here = int(np.argmin(np.abs(lap.s - s)))
    x, u = ({name: lap[name][here] for name in names} for names in (STATES, CONTROLS))
    p = {name: np.broadcast_to(value, lap.s.shape)[here] for name, value in lap.values.items()}
    rest = yaw_rates(lap.car, x, u, p)

    def rates(_: float, slide: Array) -> Array:
        moved = {name: x[name] + change for name, change in zip(YAW_STATES, slide, strict=True)}
        return np.asarray(yaw_rates(lap.car, {**x, **moved}, u, p) - rest)

    times = np.linspace(0.0, duration, 101)
    found = solve_ivp(rates, (0.0, duration), disturbance, t_eval=times, rtol=1e-9, atol=1e-14)
    return found.t, found.y


def slide_along_lap(
    lap: Lap, s: float, lateral_speed: float, distance_m: float
) -> tuple[Array, dict[str, Array]]:
    """Simulate the whole car past a point of its lap after a sudden lateral speed, hands and feet as planned.

    All five states move, and steering, slips and loads follow the lap's own course over the distance: what
    happens when a gust comes and the driver does not notice.

    Parameters
    ----------
    lap : Lap
        The lap.
    s : float
        Distance in m at which the gust comes.
    lateral_speed : float
        m/s.
    distance_m : float
        How far to simulate, m; the lap's end must not lie on the way.

    Returns
    -------
    s : ndarray (M,)
        Distance, m.
    departure : dict of ndarray (M,)
        By state, how far the car is from the same simulation without the gust, SI.

    Raises
    ------
    ValueError
        If the stretch leaves the lap.
    """
    if not 0.0 <= s < s + distance_m <= lap.period:
        raise ValueError(
            f"A stretch from {s:g} m to {s + distance_m:g} m must lie within the lap, 0 .. {lap.period:g} m."
        )
    places = np.linspace(s, s + distance_m, 201)
    varied = {name: each for name, each in lap.values.items() if np.ndim(each)}
    ends = lap.mesh_points[(lap.mesh_points > s) & (lap.mesh_points < s + distance_m)]

    def slopes(place: float, values: Array) -> Array:
        x = dict(zip(STATES, values, strict=True))
        u = {name: lap.solution.interpolate(name, np.array([place]))[0] for name in CONTROLS}
        p = {**lap.values, **{name: np.interp(place, lap.s, each) for name, each in varied.items()}}
        q = lap.car.quantities(x, u, float(lap.track.curvature(np.array([place]))[0]), values=p)
        return np.array([q[f"d{state}_ds"] for state in STATES])

    def driven(first: Array) -> Array:
        # the controls are polynomials of each mesh interval; a step across their kinks would be refused often
        pieces, value = [], first
        for a, b in zip([s, *ends], [*ends, s + distance_m], strict=True):
            inside = np.append(places[(places >= a) & (places < b)], b)
            found = solve_ivp(slopes, (a, b), value, t_eval=inside, rtol=1e-8, atol=1e-12)
            pieces.append(found.y[:, :-1])
            value = found.y[:, -1]
        return np.column_stack([*pieces, value])

    start = np.array([lap.solution.interpolate(name, np.array([s]))[0] for name in STATES])
    gust = np.array([lateral_speed if name == "v" else 0.0 for name in STATES])
    departure = driven(start + gust) - driven(start)
    return places, dict(zip(STATES, departure, strict=True))
