"""Unconstrained minimisation (2.13): steepest descent (2.17), Newton (2.12) and BFGS (2.18), (2.19)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thesislib.classical.line_search import armijo, wolfe
from thesislib.classical.programme import Array, NotConvergedError, Programme, column

__all__ = [
    "Descent",
    "bfgs",
    "convergence_order",
    "exact_for_quadratics",
    "guarded_newton",
    "newton",
    "steepest_descent",
]


@dataclass(frozen=True)
class Descent:
    """The way to a stationary point.

    Attributes
    ----------
    points : numpy.ndarray, shape (K + 1, n)
        The iterates, from the start to the end.
    gradients : numpy.ndarray, shape (K + 1, n)
        Their gradients.
    """

    points: Array
    gradients: Array

    @property
    def x(self) -> Array:
        """The last iterate, shape (n,)."""
        return self.points[-1]

    @property
    def iterations(self) -> int:
        """Number K of iterations."""
        return len(self.points) - 1

    def errors(self, solution: ArrayLike) -> Array:
        """Return the distance of every iterate from `solution`, shape (K + 1,)."""
        return np.linalg.norm(self.points - np.asarray(solution), axis=1)


class _Step(Protocol):
    def __call__(self, function: Programme, x: Array, gradient: Array, direction: Array) -> float: ...


def _full(function: Programme, x: Array, gradient: Array, direction: Array) -> float:
    return 1.0


def _armijo(function: Programme, x: Array, gradient: Array, direction: Array) -> float:
    return armijo(lambda a: function.value(x + a * direction), function.value(x), float(gradient @ direction))


def _wolfe(function: Programme, x: Array, gradient: Array, direction: Array) -> float:
    return wolfe(
        lambda a: function.value(x + a * direction),
        lambda a: float(function.gradient(x + a * direction) @ direction),
        function.value(x),
        float(gradient @ direction),
    )


def exact_for_quadratics(function: Programme, x: Array, gradient: Array, direction: Array) -> float:
    """Return the step to the lowest point along the direction, if the function is quadratic."""
    return float(-(gradient @ direction) / (direction @ function.hessian(x) @ direction))


def steepest_descent(
    function: Programme,
    start: ArrayLike,
    *,
    tolerance: float = 1e-8,
    most: int = 20_000,
    step: _Step = _armijo,
) -> Descent:
    """Minimise by steps against the gradient (2.17).

    Parameters
    ----------
    function : Programme
        Function of n variables, without constraints.
    start : array_like, shape (n,)
        x_0.
    tolerance : float
        Largest component of the gradient (2.3) at the end. Much below 1e-8 the differences of f that
        Armijo's rule compares are rounding, and the iterations may end without it.
    most : int
        Iterations after which to give up.
    step : callable
        Length of the step; Armijo's rule by default, or :func:`exact_for_quadratics`.

    Raises
    ------
    ValueError
        If the start or the function is not as above.
    NotConvergedError
        If the gradient stays above the tolerance.
    """
    return _descend(function, start, lambda x, gradient: -gradient, step, tolerance, most)


def newton(function: Programme, start: ArrayLike, *, tolerance: float = 1e-8, most: int = 100) -> Descent:
    """Find a stationary point by Newton's iteration (2.12), with full steps.

    It solves (2.3) and knows nothing of f: it may end in a maximum or a saddle point.
    Parameters and errors are those of :func:`steepest_descent`.
    """

    def direction(x: Array, gradient: Array) -> Array:
        return column(np.linalg.solve(function.hessian(x), -gradient))

    return _descend(function, start, direction, _full, tolerance, most)


def guarded_newton(
    function: Programme, start: ArrayLike, *, tolerance: float = 1e-8, most: int = 1000
) -> Descent:
    """Minimise by Newton's direction, made one of descent, and Armijo's step.

    The eigenvalues of the Hessian are replaced by their magnitudes, at least 1e-8 of the largest: D_k in
    (2.13) has to be positive definite. Near a minimum that changes nothing, and the full step is taken.
    Parameters and errors are those of :func:`steepest_descent`.
    """

    def direction(x: Array, gradient: Array) -> Array:
        eigenvalues, vectors = np.linalg.eigh(function.hessian(x))
        magnitudes = np.abs(eigenvalues)
        magnitudes = np.maximum(magnitudes, 1e-8 * magnitudes.max())
        return -vectors @ ((vectors.T @ gradient) / magnitudes)

    return _descend(function, start, direction, _armijo, tolerance, most)


def bfgs(function: Programme, start: ArrayLike, *, tolerance: float = 1e-8, most: int = 1000) -> Descent:
    """Minimise by quasi-Newton steps (2.18), with the Hessian learnt from gradients by (2.19).

    B_0 = I, so the first direction is that of steepest descent. Wolfe's conditions keep B_k positive
    definite. Parameters and errors are those of :func:`steepest_descent`.
    """
    B: Array = np.eye(function.size)
    last: tuple[Array, Array] | None = None

    def direction(x: Array, gradient: Array) -> Array:
        nonlocal B, last
        B = B if last is None else bfgs_update(B, x - last[0], gradient - last[1])
        last = x, gradient
        return column(np.linalg.solve(B, -gradient))

    return _descend(function, start, direction, _wolfe, tolerance, most)


def bfgs_update(B: Array, p: Array, y: Array) -> Array:
    """Return B_{k+1} of (2.19), shape (n, n), from the step p and the gradient's change y, shapes (n,)."""
    Bp = B @ p
    return B - np.outer(Bp, Bp) / (p @ Bp) + np.outer(y, y) / (p @ y)


def destinations(
    method: Callable[..., Descent],
    function: Programme,
    starts: ArrayLike,
    stationary: ArrayLike,
) -> NDArray[np.int64]:
    """Return which stationary point a method ends in from each of many starts.

    Parameters
    ----------
    method : callable
        One of the methods of this module.
    function : Programme
        Function of n variables.
    starts : array_like, shape (S, n)
        Where the method begins.
    stationary : array_like, shape (P, n)
        The stationary points.

    Returns
    -------
    numpy.ndarray of int, shape (S,)
        Index of the point within 1e-3 of the end; -1 if there is none, or the method did not converge
        to a gradient of 1e-5.
    """
    points = np.asarray(stationary, dtype=np.float64)
    found = np.full(len(np.asarray(starts)), -1)
    for i, start in enumerate(np.asarray(starts)):
        try:
            end = method(function, start, tolerance=1e-5).x
        except NotConvergedError:
            continue
        distances = np.linalg.norm(points - end, axis=1)
        if distances.min() < 1e-3:
            found[i] = int(distances.argmin())
    return found


def convergence_order(errors: ArrayLike) -> float:
    """Return the exponent q of e_{k+1} = C e_k^q that fits successive errors best.

    Parameters
    ----------
    errors : array_like, shape (K,) or (K, M)
        Successive positive errors above the level of rounding, of one run or of M runs (columns).

    Raises
    ------
    ValueError
        If there are less than two pairs of successive errors, or one is not positive.
    """
    logarithms = np.log(_positive(errors))
    before, after = logarithms[:-1].ravel(), logarithms[1:].ravel()
    if before.size < 2:
        raise ValueError(f"{before.size} pairs of successive errors do not define an order; it takes two")
    return float(np.polyfit(before, after, 1)[0])


def _positive(errors: ArrayLike) -> Array:
    values = np.asarray(errors, dtype=np.float64)
    if not np.all(values > 0.0):
        raise ValueError(f"the error {values.min():g} is not positive; leave out what is below rounding")
    return values


def _descend(
    function: Programme,
    start: ArrayLike,
    direction: Callable[[Array, Array], Array],
    step: _Step,
    tolerance: float,
    most: int,
) -> Descent:
    """Iterate (2.13) until no component of the gradient is larger than the tolerance."""
    if function.equality_count or function.inequality_count:
        raise ValueError(f"{function.name} has constraints; descent is for functions without")
    x = function.start(start)
    points, gradients = [x], [function.gradient(x)]
    while np.abs(gradients[-1]).max() > tolerance:
        if len(points) > most:
            raise _stopped(function, points[-1], gradients[-1], tolerance, f"stopped after {most} iterations")
        try:
            ahead = direction(points[-1], gradients[-1])
            alpha = step(function, points[-1], gradients[-1], ahead)
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            raise _stopped(function, points[-1], gradients[-1], tolerance, str(error)) from error
        x = points[-1] + alpha * ahead
        points.append(x)
        gradients.append(function.gradient(x))
        if not np.all(np.isfinite(gradients[-1])):
            raise _stopped(function, x, gradients[-1], tolerance, "the gradient is not finite")
    return Descent(np.array(points), np.array(gradients))


def _stopped(
    function: Programme, x: Array, gradient: Array, tolerance: float, what: str
) -> NotConvergedError:
    return function.not_converged(x, np.empty(0), np.empty(0), tolerance, f"{what} at x = {x}")
