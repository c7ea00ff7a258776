"""What a change of the equations along a lap is worth, to first order, from the lap's multipliers alone.

At an optimum the variables' own answer to a small change cancels: the minimised objective changes by
∫ (δS + λ·δf + μ·δc) ds, where δS, δf and δc are what the change does to slowness, derivatives and path
constraints with states and controls held. λ are the costates and μ the multipliers of the constraints.

The objective is what the solver minimises: lap time and regulariser (2.171).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from thesislib.lap.minimum_time import Array, Lap
from thesislib.ocp.sensitivity import constant_density
from thesislib.vehicles import CONTROLS, STATES, RacingCar

# Path constraints that the problem states by another of the car's quantities than their own name.
_STATED_BY = {"ride_height": "h_f"}

FRICTION_PEAKS = ("mu_x1", "mu_x2", "mu_y1", "mu_y2")
"""Numbers to which all tyre forces are proportional together."""


def quantities_with(
    lap: Lap, car: RacingCar | None = None, values: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return the car's quantities at a lap's points, states and controls, with other equations.

    Parameters
    ----------
    lap : Lap
        The lap.
    car : RacingCar, optional
        Another car, for example with another ride-height model; by default the lap's.
    values : mapping, optional
        Numbers of the car that change, SI, before what the optimiser has adjusted: floats, or arrays (N,)
        where they change along the lap.

    Returns
    -------
    dict
        As `RacingCar.quantities`.

    Raises
    ------
    KeyError
        If the car has no such number.
    """
    x = {name: lap.solution[name] for name in STATES}
    u = {name: lap.solution[name] for name in CONTROLS}
    car = car or lap.car
    numbers = lap.adjusted({**car.values, **(values or {})})
    return car.quantities(x, u, lap.track.curvature(lap.s), values=numbers)


def adjoint_change(lap: Lap, changed: Mapping[str, Any]) -> Array:
    """Return what a change of the equations adds to the minimised objective, as a density along the lap.

    It is linear in `changed`, so that for a derivative the difference of two calls may be taken: see
    `adjoint_derivative`. A change so large that the lap would answer to it is worth less than this says.

    Parameters
    ----------
    lap : Lap
        A lap with its multipliers.
    changed : mapping
        Quantities at the lap's points under the changed equations, as of `quantities_with`; what the problem
        does not read is ignored, and what is missing has not changed.

    Returns
    -------
    ndarray, shape (N,)
        s/m; its integral is `lap.solution.weights @ density`.

    Raises
    ------
    ocp.ProblemError
        If the lap has no multipliers.
    """
    solution = lap.solution
    costs = {"slowness": np.ones(lap.s.shape)}
    costs |= {f"d{state}_ds": solution.costate(state) for state in STATES}
    for constraint in solution.problem.path:
        quantity = _STATED_BY.get(constraint.name, constraint.name)
        costs[quantity] = solution.path_multiplier(constraint.name)
    density = np.zeros(lap.s.shape)
    for quantity, cost in costs.items():
        if quantity in changed:
            density += cost * (np.asarray(changed[quantity]) - lap[quantity])
    return density


def adjoint_derivative(lap: Lap, changed: Callable[[float], Mapping[str, Any]], step: float) -> Array:
    """Return the derivative of the minimised objective by the size of a change, as a density along the lap.

    Parameters
    ----------
    lap : Lap
        A lap with its multipliers.
    changed : callable
        From the size of the change to the quantities under it, as `adjoint_change` takes them.
    step : float
        Size at which the central difference of the quantities is taken; positive.

    Returns
    -------
    ndarray, shape (N,)
        s/m per unit of the size.
    """
    if not step > 0.0:
        raise ValueError(f"step = {step:g}, over which a change is differenced, must be positive.")
    difference = adjoint_change(lap, changed(step)) - adjoint_change(lap, changed(-step))
    return np.asarray(difference / (2.0 * step))


def grip_density(lap: Lap) -> Array:
    """Return what more grip of all four tyres is worth, as a density along the lap, s/m per unit of grip.

    A hundredth more grip between two places changes the minimised objective by a hundredth of the density's
    integral between them.
    """
    peaks = [lap.car.values[name] * constant_density(lap.solution, name) for name in FRICTION_PEAKS]
    return np.asarray(np.sum(peaks, axis=0))
