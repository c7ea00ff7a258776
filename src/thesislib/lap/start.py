"""A quasi-steady lap on the centre line, from which the solver starts.

A start that nearly satisfies the equations saves the solver a hundred iterations: from a
slow lap with rolling wheels it has to find the speed profile and the braking points by
Newton steps. Nothing of it is left in the solution.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from thesislib.roads import CentreLine
from thesislib.vehicles.racing_car import RacingCar

Array = NDArray[np.float64]

# Share of the tyres' grip that the start uses: enough to place the braking points, little
# enough that every slip stays well before its peak.
GRIP_SHARE = 0.8
STEP_M = 2.0
SMOOTHING_M = 20.0


def quasi_steady_start(track: CentreLine, car: RacingCar) -> dict[str, Callable[[Array], Array]]:
    """Return a lap on the centre line as functions of the distance.

    A point mass accelerates, brakes and corners within a share of the grip that static and
    aerodynamic loads give; loads, slips and the steering angle follow from the
    accelerations by static balances and the inverse of the tyre's force law.

    Parameters
    ----------
    track : CentreLine
        The road.
    car : RacingCar
        The car.

    Returns
    -------
    dict
        A function of s (m) for each state and control, SI units.
    """
    values = car.values
    s = np.linspace(0.0, track.length, max(8, round(track.length / STEP_M)), endpoint=False)
    curvature = _smoothed(track.curvature(s), s[1])
    u = _speed(values, curvature, s[1])
    a_x = _smoothed(u * _slope(u, s[1]), s[1])
    a_y = u**2 * curvature
    loads = _loads(values, u, a_x, a_y)
    channels = {"n": np.zeros_like(s), "u": u, "omega": u * curvature}
    channels |= {f"F_{wheel}z": -load for wheel, load in loads.items()}
    mass, wheelbase = values["mass"], values["wheelbase"]
    front_share = (wheelbase - values["a"]) / wheelbase
    driving = np.maximum(mass * a_x + _drag(values, u), 0.0)
    braking = np.minimum(mass * a_x + _drag(values, u), 0.0)
    front, rear = loads["fl"] + loads["fr"], loads["rl"] + loads["rr"]
    kappa_front = _slip(values, "x", braking * front / (front + rear), front)
    kappa_rear = _slip(values, "x", driving + braking * rear / (front + rear), rear)
    alpha_front = -_slip(values, "y", mass * a_y * front_share, front)
    alpha_rear = -_slip(values, "y", mass * a_y * (1 - front_share), rear)
    v = u * np.tan(alpha_rear) + channels["omega"] * (wheelbase - values["a"])
    channels |= {"v": v, "xi": -np.arctan(v / u)}
    channels["delta"] = (v + channels["omega"] * values["a"]) / u - alpha_front
    channels |= {"kappa_fl": kappa_front, "kappa_fr": kappa_front}
    channels |= {"kappa_rl": kappa_rear, "kappa_rr": kappa_rear}
    return {name: _periodic(s, track.length, samples) for name, samples in channels.items()}


def _speed(values: dict[str, float], curvature: Array, step: float) -> Array:
    """Return the speed of a point mass that uses a share of its grip, forwards and backwards."""
    mass, gravity = values["mass"], values["gravity"]
    mu = GRIP_SHARE * min(values["mu_x2"], values["mu_y2"])
    lift = 0.5 * values["air_density"] * values["frontal_area"] * _lift(values) / mass
    bend = np.maximum(np.abs(curvature) - mu * lift, 1e-6)
    top = (2 * values["P_max"] / (values["air_density"] * values["frontal_area"] * values["C_D_0"])) ** (
        1 / 3
    )
    limit = np.minimum(np.sqrt(mu * gravity / bend), GRIP_SHARE * top)

    def passed(u: Array, strongest: Callable[[float], float]) -> Array:
        u = u.copy()
        for i in range(2 * len(u)):  # two turns of the lap carry the limits around its start
            here, before = i % len(u), (i - 1) % len(u)
            u[here] = min(u[here], np.sqrt(u[before] ** 2 + 2 * step * strongest(u[before])))
        return u

    def drive(u: float) -> float:
        pulling = values["P_max"] / (mass * u) - float(_drag(values, np.array(u))) / mass
        return max(min(0.5 * mu * (gravity + lift * u**2), pulling), 0.0)

    def brake(u: float) -> float:
        return mu * (gravity + lift * u**2)

    forwards = passed(limit, drive)
    return _smoothed(passed(forwards[::-1], brake)[::-1], step)


def _loads(values: dict[str, float], u: Array, a_x: Array, a_y: Array) -> dict[str, Array]:
    """Return normal loads (N) by static balances; each axle carries its share of the roll moment."""
    mass, wheelbase, h = values["mass"], values["wheelbase"], values["h"]
    lift = 0.5 * values["air_density"] * values["frontal_area"] * u**2 * _lift(values) / 2
    shift = mass * a_x * h / wheelbase
    front = mass * values["gravity"] * (wheelbase - values["a"]) / wheelbase + lift - shift
    rear = mass * values["gravity"] * values["a"] / wheelbase + lift + shift
    across = mass * a_y * h / (front + rear) / (values["w_f"] + values["w_r"])
    # in a right-hand turn, a_y > 0, the left wheels carry more
    share = np.clip(across, -0.45, 0.45)
    return {
        "fl": front * (0.5 + share),
        "fr": front * (0.5 - share),
        "rl": rear * (0.5 + share),
        "rr": rear * (0.5 - share),
    }


def _slip(values: dict[str, float], axis: str, force: Array, load: Array) -> Array:
    """Return the slip at which two tyres under `load` give `force` along one axis, (B.10), (B.11)."""
    mu, Q = values[f"mu_{axis}2"], values[f"Q_{axis}"]
    peak = values["kappa_2" if axis == "x" else "alpha_2"]
    S = np.pi / (2 * np.arctan(Q))
    used = np.clip(force / (mu * load), -GRIP_SHARE, GRIP_SHARE)
    return np.asarray(np.tan(np.arcsin(used) / Q) / S * peak)


def _lift(values: dict[str, float]) -> float:
    """Return the sum of the nominal downforce coefficients of Table 4.1."""
    return values["C_L_front_0"] + values["C_L_rear_0"]


def _drag(values: dict[str, float], u: Array) -> Array:
    """Return the size of the drag (4.24) in N, nominal coefficient."""
    return np.asarray(0.5 * values["air_density"] * values["frontal_area"] * values["C_D_0"] * u**2)


def _slope(values: Array, step: float) -> Array:
    return (np.roll(values, -1) - np.roll(values, 1)) / (2 * step)


def _smoothed(values: Array, step: float) -> Array:
    """Return a periodic running mean over `SMOOTHING_M`."""
    half = max(1, round(0.5 * SMOOTHING_M / step))
    wrapped = np.concatenate((values[-half:], values, values[:half]))
    return np.convolve(wrapped, np.full(2 * half + 1, 1 / (2 * half + 1)), "valid")


def _periodic(s: Array, period: float, samples: Array) -> Callable[[Array], Array]:
    """Return the periodic linear interpolant of samples."""

    def channel(places: Array) -> Array:
        return np.interp(places, s, samples, period=period)

    return channel
