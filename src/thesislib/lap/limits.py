"""Limits and constraints of a lap that are no numbers of the car, and what they are worth.

The limits, of the road's width and of the plank, are numbers that a set-up has. The constraints are the two
that tie wheels to each other, (4.19) and (4.20); what is priced is a small difference in place of their zero.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from thesislib.lap.minimum_time import Array, Lap

HALF_WIDTH: Final = "half_width_m"
FRONT_HEIGHT: Final = "front_height_limit_m"

ROLL: Final = "front_roll"
BRAKE: Final = "outer_brake"

# A front wheel that slips less than this does not brake: there (4.20) says that the engine drives neither.
_BRAKING_SLIP = 1e-3

_MOMENT_STEP = 1e-6  # N m

LIMITS: Final = (HALF_WIDTH, FRONT_HEIGHT)
"""Names of the limits, as a set-up has them."""


def limits(lap: Lap) -> dict[str, float]:
    """Return the values of a lap's limits in m by name; a rigid car has no limit of its front height."""
    problem = lap.solution.problem
    found = {HALF_WIDTH: next(state.bounds[1] for state in problem.states if state.name == "n")}
    plank = [path.bounds[1] for path in problem.path if path.name == "ride_height"]
    return {**found, FRONT_HEIGHT: plank[0]} if plank else found


def limit_densities(lap: Lap) -> dict[str, Array]:
    """Return where each limit acts on the minimised objective: densities (N,) in s/m per m of the limit.

    A wider road moves both edges out. Multipliers are positive at upper and negative at lower bounds.
    """
    found = {HALF_WIDTH: -np.abs(lap.solution.bound_multiplier("n"))}
    if FRONT_HEIGHT in limits(lap):
        found[FRONT_HEIGHT] = -lap.solution.path_multiplier("ride_height")
    return found


def limit_prices(lap: Lap) -> dict[str, float]:
    """Return the derivative of the minimised objective by each limit, s/m."""
    return {name: float(lap.solution.weights @ density) for name, density in limit_densities(lap).items()}


def constraint_densities(lap: Lap) -> dict[str, Array]:
    """Return what a difference in place of the zero of (4.19) and (4.20) adds to the minimised objective.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        `ROLL`: a front axle that rolls more than the rear one, in the direction of the roll, s/m per rad; it
        takes more of the lateral load transfer, as with a stiffer front anti-roll bar. `BRAKE`: a front
        wheel that brakes more than the other where it is on the outside of the turn, s/m per N, and zero
        where the front wheels do not brake. Those that the lap's readings have.
    """
    found, equations = {}, lap.car.equations
    if "roll_difference" in equations:
        # the multiplier of c = 0 says that c = d adds -d times it
        found[ROLL] = -np.sign(lap["phi_f"]) * lap.solution.path_multiplier("roll_difference")
    if "brake_difference" in equations:
        braking = np.minimum(lap["kappa_fl"], lap["kappa_fr"]) < -_BRAKING_SLIP
        # in a right-hand turn the left wheel is outside, and its force, when it brakes more, the lower one
        outer = np.sign(lap["a_y"]) * braking
        found[BRAKE] = outer * lap.solution.path_multiplier("brake_difference")
    return found


def roll_per_moment(lap: Lap) -> Array:
    """Return by how much a front anti-roll moment turns the front axle at the lap's loads, rad/(N m), (N,).

    The moment is what a bar adds; the axle's roll angle answers to it as to the same moment of its loads.
    """
    ride = lap.car.ride
    if ride is None or lap.car.readings.suspension != "metamodel":
        raise ValueError("the lap's car has a rigid suspension: no moment rolls its axles")
    half, w_f = 0.5j * _MOMENT_STEP, lap.car.values["w_f"]
    left, right = lap["F_flz"] + half / w_f, lap["F_frz"] - half / w_f
    posture = ride.heights(left, right, lap["F_rlz"], lap["F_rrz"], lap.values)
    # the imaginary part is the derivative, without a difference: the polynomials are analytic
    return np.asarray(np.imag(posture.phi_f) / _MOMENT_STEP)
