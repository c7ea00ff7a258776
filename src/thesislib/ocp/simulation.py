"""Re-integration of a solution by an independent method, with its own controls.

Collocation and its error estimate share one discretisation; an explicit Runge–Kutta method with
step-size control does not. It integrates the same point functions from the solution's states and
tells how far it ends from them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from thesislib.ocp.problem import ProblemError
from thesislib.ocp.quadrature import Array, interpolation_matrix
from thesislib.ocp.solution import Solution


@dataclass(frozen=True, eq=False)
class Simulation:
    """Where a re-integrated solution ends, segment by segment.

    `simulation["v"]` gives the differences of a state.

    Attributes
    ----------
    states : tuple of str
        Names of the states.
    places : ndarray, shape (S + 1,)
        Values of the independent variable that bound the segments.
    differences : ndarray, shape (n_x, S)
        Re-integrated state less the solution's state at the end of every segment, in the state's unit.
    """

    states: tuple[str, ...]
    places: Array
    differences: Array

    def __getitem__(self, name: str) -> Array:
        if name not in self.states:
            raise ProblemError(f"no state is named {name!r}; known: {', '.join(self.states)}")
        return np.asarray(self.differences[self.states.index(name)])

    def largest(self, name: str) -> float:
        """Return the largest magnitude of a state's differences, in the state's unit."""
        return float(np.abs(self[name]).max())


def simulate(
    solution: Solution, segments: int | None = None, method: str = "DOP853", tolerance: float = 1e-10
) -> Simulation:
    """Re-integrate a solution with its own controls and return where it ends.

    The controls are one polynomial per mesh interval, so integration stops and starts at every mesh
    point. All segments advance side by side, their first intervals together, then their second ones,
    and so on: they are one system of equations to the integrator.

    Parameters
    ----------
    solution : Solution
        What to verify.
    segments : int, optional
        Mesh intervals in a segment; integration restarts from the solution's states where one begins.
        By default the whole range is one segment. Unstable dynamics need short ones.
    method : str
        Any method of `scipy.integrate.solve_ivp`.
    tolerance : float
        Relative and absolute tolerance of the scaled states.

    Returns
    -------
    Simulation

    Raises
    ------
    ProblemError
        If a segment would hold no interval, or the integrator gives up, with place and reason.
    """
    mesh, pointwise, iterate = solution.mesh, solution.pointwise, solution.iterate
    length = mesh.intervals if segments is None else segments
    if length < 1:
        raise ProblemError(f"segments = {length}: a segment holds at least one mesh interval")
    begins = np.arange(0, mesh.intervals, length)
    ends = np.minimum(begins + length, mesh.intervals)
    states = iterate.states[:, mesh.first[begins]].copy()
    for step in range(int((ends - begins).max())):
        active = np.flatnonzero(begins + step < ends)
        states[:, active] = _advanced(solution, begins[active] + step, states[:, active], method, tolerance)
    last = mesh.first[ends - 1] + mesh.orders[ends - 1]
    differences = (states - iterate.states[:, last]) * pointwise.state_scale[:, None]
    names = tuple(state.name for state in solution.problem.states)
    return Simulation(names, solution.mesh_points[np.append(begins, mesh.intervals)], differences)


def _advanced(
    solution: Solution, intervals: np.ndarray, states: Array, method: str, tolerance: float
) -> Array:
    """Integrate over one mesh interval each, many at once.

    Parameters
    ----------
    solution : Solution
        Brings controls and equations.
    intervals : ndarray of int, shape (m,)
        The intervals.
    states : ndarray, shape (n_x, m)
        Scaled states at their starts.
    method, tolerance
        As in `simulate`.

    Returns
    -------
    ndarray, shape (n_x, m)
        Scaled states at their ends.
    """
    mesh, pointwise, iterate = solution.mesh, solution.pointwise, solution.iterate
    starts, widths = mesh.boundaries[intervals], mesh.widths[intervals]
    orders = mesh.orders[intervals]
    groups = [(np.flatnonzero(orders == order), mesh.rule.points(int(order))) for order in np.unique(orders)]
    supports = [
        iterate.controls[:, mesh.first[intervals[members]][:, None] + np.arange(len(support))]
        for members, support in groups
    ]
    values = pointwise.values.map(len(intervals))
    controls = np.empty((iterate.controls.shape[0], len(intervals)))

    def slope(share: float, x: Array) -> Array:
        for (members, support), support_values in zip(groups, supports, strict=True):
            basis = interpolation_matrix(support, np.array([2 * share - 1]))[0]
            controls[:, members] = support_values @ basis
        z = np.vstack((x.reshape(states.shape), controls))
        outputs = np.array(values(*pointwise.arguments(z, iterate.parameters, starts + widths * share)))
        return (pointwise.derivatives(outputs) * widths).ravel()

    # the integrator's norm is a mean over all intervals; its root keeps each of them within tolerance
    allowed = max(tolerance / np.sqrt(len(intervals)), 1e-13)
    found = solve_ivp(slope, (0.0, 1.0), states.ravel(), method, rtol=allowed, atol=allowed, t_eval=[1.0])
    if not found.success:
        place = float(solution.mesh_points[intervals[0]])
        independent = solution.problem.independent
        raise ProblemError(
            f"{solution.problem.name}: re-integration from {independent.name} = {place:g} {independent.unit} "
            f"stopped: {found.message}"
        )
    return np.asarray(found.y[:, -1].reshape(states.shape))
