"""Newton's method for systems of equations, damped by the affine-invariant test that [35] of the thesis uses.

A step is accepted if it shortens the *correction* that is still to come, not the residual: the test
does not change when equations are multiplied by numbers, and shooting's are of all sizes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from .control_problem import Array, ConvergenceError

Residual = Callable[[Array], Array]
Jacobian = Callable[[Array], Any]


@dataclass(frozen=True)
class Root:
    """A root and how it was reached.

    Attributes
    ----------
    x : numpy.ndarray, shape (N,)
        Where the equations hold.
    iterations : int
        Newton steps.
    corrections : numpy.ndarray, shape (iterations,)
        Largest component of each step, relative to that of the unknowns.
    """

    x: Array
    iterations: int
    corrections: Array


def newton(
    residual: Residual,
    jacobian: Jacobian,
    guess: Array,
    names: Sequence[str],
    *,
    what: str,
    tolerance: float = 1e-10,
    iterations: int = 50,
    least_step: float = 1e-6,
) -> Root:
    """Find a root of `residual` from `guess`.

    Parameters
    ----------
    residual : callable
        Unknowns, shape (N,), to residuals, shape (N,); a trial that is not finite is shortened.
    jacobian : callable
        Unknowns to the Jacobian, dense or sparse, shape (N, N).
    guess : numpy.ndarray, shape (N,)
    names : sequence of str
        Name of each equation.
    what : str
        Name of what is solved; error messages begin with it.
    tolerance : float
        A full step shorter than this part of the unknowns' largest (or of one) ends the search.
    iterations : int
        Most steps.
    least_step : float
        Shortest part of a step that is tried.

    Returns
    -------
    Root

    Raises
    ------
    ConvergenceError
        If the guess has no finite residual, the Jacobian has no inverse, no part of a step is an
        advance, or the steps run out.
    """
    x = np.array(guess, float)
    values = residual(x)
    if not np.all(np.isfinite(values)):
        raise ConvergenceError(f"{what}: {names[_worst(values)]} is not finite at the guess")
    corrections: list[float] = []
    while len(corrections) < iterations:
        solve = _factorised(jacobian(x))
        if solve is None:
            raise ConvergenceError(_stuck(what, names, values, "the Jacobian has no inverse"))
        step = solve(-values)
        corrections.append(_length(step, x))
        share = 1.0
        while share >= least_step:
            trial = x + share * step
            at_trial = residual(trial)
            if np.all(np.isfinite(at_trial)):
                remaining = _length(solve(-at_trial), x)
                if remaining <= max((1 - share / 4) * corrections[-1], tolerance):
                    break
            share /= 2
        else:
            raise ConvergenceError(_stuck(what, names, values, f"no part of step {len(corrections)} helps"))
        x, values = trial, at_trial
        if share == 1.0 and corrections[-1] <= tolerance:
            return Root(x, len(corrections), np.array(corrections))
    raise ConvergenceError(_stuck(what, names, values, f"{iterations} steps were not enough"))


def _length(step: Array, x: Array) -> float:
    return float(np.max(np.abs(step)) / max(1.0, np.max(np.abs(x))))


def _worst(values: Array) -> int:
    size = np.where(np.isfinite(values), np.abs(values), np.inf)
    return int(np.argmax(size))


def _stuck(what: str, names: Sequence[str], values: Array, why: str) -> str:
    worst = _worst(values)
    return f"{what}: {why}; the largest residual is {names[worst]}, {values[worst]:.3g}"


def _factorised(jacobian: Any) -> Callable[[Array], Array] | None:
    """Return the solution by the Jacobian, or None where it has no inverse in double precision."""
    if scipy.sparse.issparse(jacobian):
        try:
            return scipy.sparse.linalg.splu(jacobian.tocsc()).solve
        except RuntimeError:
            return None
    if np.linalg.matrix_rank(jacobian) < len(jacobian):
        return None
    factors = scipy.linalg.lu_factor(jacobian)
    return lambda right: scipy.linalg.lu_solve(factors, right)
