"""The statement of an optimal control problem: names, units, bounds, equations."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

import numpy as np

UNBOUNDED = (-np.inf, np.inf)
Bounds = tuple[float, float]


class ProblemError(ValueError):
    """The statement of a problem, or a guess for it, contradicts itself."""


@dataclass(frozen=True)
class Quantity:
    """A named number with a unit, bounds and a scale.

    Parameters
    ----------
    name : str
        Name, unique in its problem.
    unit : str
        Unit of the value and of the bounds.
    bounds : (float, float)
        Smallest and largest admissible value; infinite where there is none.
    scale : float, optional
        Size that the solver takes for one. By default the larger magnitude of the bounds,
        or one where they are infinite.

    Raises
    ------
    ProblemError
        If the bounds are crossed or not numbers, or the scale is not positive.
    """

    name: str
    unit: str = "-"
    bounds: Bounds = UNBOUNDED
    scale: float | None = None

    def __post_init__(self) -> None:
        low, high = self.bounds
        if np.isnan(low) or np.isnan(high) or low > high:
            raise ProblemError(f"bounds {low:g} .. {high:g} of {self.name} are not an interval")
        if self.scale is not None and not (np.isfinite(self.scale) and self.scale > 0):
            raise ProblemError(f"scale {self.scale:g} of {self.name} must be positive and finite")

    @property
    def size(self) -> float:
        """The scale in use."""
        if self.scale is not None:
            return self.scale
        finite = [abs(bound) for bound in self.bounds if np.isfinite(bound)]
        return max([*finite, 0.0]) or 1.0


@dataclass(frozen=True)
class State(Quantity):
    """A state, whose derivative the equations give."""


@dataclass(frozen=True)
class Control(Quantity):
    """A control.

    Parameters
    ----------
    rate_weight : float
        Weight ε of the regularisation (2.171) of this control: ε/2 ∫ (dû/dŝ)² dŝ with
        the scaled control û and the independent variable in units of its own scale ŝ.
    """

    rate_weight: float = 0.0


@dataclass(frozen=True)
class Parameter(Quantity):
    """A static parameter that the optimiser chooses."""


@dataclass(frozen=True)
class Path(Quantity):
    """A path constraint (2.141): an expression of the equations kept within its bounds."""


@dataclass(frozen=True)
class Integral(Quantity):
    """An integral constraint (2.154): an integrand of the equations whose integral is bounded."""


@dataclass(frozen=True)
class Boundary(Quantity):
    """A boundary condition (2.142): an expression of the end values kept within its bounds."""


@dataclass(frozen=True)
class Independent:
    """The independent variable and its range.

    Parameters
    ----------
    name : str
        Its name, `"t"` or `"s"`.
    initial, final : float or (float, float)
        Where the problem starts and ends; an interval makes that end free.
    unit : str
        Unit of both.
    scale : float
        Size that the solver takes for one; enters the regularisation only.
    """

    name: str = "t"
    initial: float | Bounds = 0.0
    final: float | Bounds = 1.0
    unit: str = "s"
    scale: float = 1.0

    def __post_init__(self) -> None:
        for end, value in (("initial", self.initial), ("final", self.final)):
            low, high = interval(value)
            if not low <= high:
                raise ProblemError(f"{end} {self.name} = {low:g} .. {high:g} is not an interval")
        if interval(self.initial)[0] >= interval(self.final)[1]:
            raise ProblemError(
                f"{self.name} starts at {self.initial} and ends at {self.final}: no range is left"
            )

    @property
    def is_free(self) -> bool:
        """Whether either end is the optimiser's choice."""
        return bool(self.free)

    @property
    def free(self) -> dict[str, Parameter]:
        """Parameters that stand for the free ends, by `"initial"` and `"final"`, in this order."""
        return {
            end: Parameter(f"{self.name}_{end}", self.unit, value)
            for end, value in (("initial", self.initial), ("final", self.final))
            if isinstance(value, tuple)
        }


@dataclass(frozen=True)
class Equations:
    """What holds at one point: derivatives, path expressions and integrands by name.

    Parameters
    ----------
    derivatives : mapping
        Derivative of every state with respect to the independent variable.
    path : mapping
        Expression of every path constraint.
    integrands : mapping
        Integrand of the Lagrange objective and of every integral constraint.
    """

    derivatives: Mapping[str, Any]
    path: Mapping[str, Any] = field(default_factory=dict)
    integrands: Mapping[str, Any] = field(default_factory=dict)


class Point(Mapping[str, Any]):
    """Values at one point, read as attributes or by name."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __getitem__(self, name: str) -> Any:
        if name not in self._values:
            raise ProblemError(unknown("quantity", name, self._values))
        return self._values[name]

    def __iter__(self) -> Any:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)


@dataclass(frozen=True)
class Ends:
    """Values at both ends: states, the independent variable, parameters and constants."""

    initial: Point
    final: Point


@dataclass(frozen=True)
class Problem:
    """An optimal control problem of the form (2.100).

    Parameters
    ----------
    name : str
        What is being solved.
    independent : Independent
        The independent variable and its range.
    states, controls, parameters : sequence
        What the optimiser chooses.
    equations : callable
        From a `Point` (states, controls, parameters, constants, data and the independent
        variable by name) to `Equations`; must accept CasADi symbols.
    lagrange : str, optional
        The integrand to minimise.
    mayer : callable, optional
        From `Ends` to the end cost, added to the integral.
    path, integrals, boundary : sequence
        Constraints; `boundary_equations` gives the expressions of `boundary`.
    boundary_equations : callable, optional
        From `Ends` to a mapping of the boundary conditions' expressions.
    initial, terminal : mapping
        Fixed value, or interval, of a state at either end.
    periodic : sequence of str
        States that end as they began (4.29).
    constants : mapping
        Numbers the equations use by name and that can be changed between solves, and
        with respect to which the optimum can be differentiated, without a new compilation.
    data : mapping
        Functions of the independent variable (ndarray to ndarray) the equations use by name;
        not with a free end, which would move the points between solves.
    objective_scale : float
        Size of the objective that the solver takes for one.

    Raises
    ------
    ProblemError
        If a name is used twice or is unknown, an end value lies outside its bounds, or data are
        read along a range whose end is free.
    """

    name: str
    independent: Independent
    states: Sequence[State]
    equations: Callable[[Point], Equations]
    controls: Sequence[Control] = ()
    parameters: Sequence[Parameter] = ()
    lagrange: str | None = None
    mayer: Callable[[Ends], Any] | None = None
    path: Sequence[Path] = ()
    integrals: Sequence[Integral] = ()
    boundary: Sequence[Boundary] = ()
    boundary_equations: Callable[[Ends], Mapping[str, Any]] | None = None
    initial: Mapping[str, float | Bounds] = field(default_factory=dict)
    terminal: Mapping[str, float | Bounds] = field(default_factory=dict)
    periodic: Sequence[str] = ()
    constants: Mapping[str, float] = field(default_factory=dict)
    data: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)
    objective_scale: float = 1.0

    def __post_init__(self) -> None:
        if not self.states:
            raise ProblemError(f"problem {self.name!r} has no state")
        if self.data and self.independent.is_free:
            raise ProblemError(
                f"problem {self.name!r} reads the data {', '.join(self.data)} along a range whose end is "
                "free: data are sampled before the solve, where the points are known"
            )
        names = [q.name for q in (*self.states, *self.controls, *self.all_parameters)]
        names += [*self.constants, *self.data, self.independent.name]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ProblemError(f"name {twice[0]!r} is used twice in problem {self.name!r}")
        states = {state.name: state for state in self.states}
        for where in (self.initial, self.terminal, self.periodic):
            for name in where:
                if name not in states:
                    raise ProblemError(unknown("state", name, states))
        for end, values in (("initial", self.initial), ("terminal", self.terminal)):
            for name, value in values.items():
                low, high = interval(value)
                bounds = states[name].bounds
                if low < bounds[0] or high > bounds[1]:
                    raise ProblemError(
                        f"{end} {name} = {value} is outside its bounds {bounds[0]:g} .. {bounds[1]:g}"
                    )

    @property
    def all_parameters(self) -> tuple[Parameter, ...]:
        """Static parameters, and last the free ends of the independent variable."""
        return (*self.parameters, *self.independent.free.values())

    @property
    def conditions(self) -> tuple[Boundary, ...]:
        """Boundary conditions, and where both ends are free and could cross, that they do not, last."""
        free = self.independent.free
        if len(free) < 2 or free["initial"].bounds[1] <= free["final"].bounds[0]:
            return tuple(self.boundary)
        name, unit = f"length of the range of {self.independent.name}", self.independent.unit
        return (*self.boundary, Boundary(name, unit, (0.0, np.inf), free["final"].size))

    @property
    def has_objective(self) -> bool:
        """Whether there is anything to minimise; a phase of several may leave that to the others."""
        return self.lagrange is not None or self.mayer is not None

    @property
    def names(self) -> dict[str, list[str]]:
        """Names of all that has values or multipliers; problems that share them share solutions."""
        groups: dict[str, Sequence[Quantity]] = {
            "states": self.states,
            "controls": self.controls,
            "parameters": self.all_parameters,
            "path constraints": self.path,
            "integral constraints": self.integrals,
            "boundary conditions": self.conditions,
        }
        return {kind: [quantity.name for quantity in group] for kind, group in groups.items()}

    @property
    def units(self) -> dict[str, str]:
        """Units of all that has values, by name."""
        return {q.name: q.unit for q in (*self.states, *self.controls, *self.all_parameters)}

    def check(self, equations: Equations) -> None:
        """Refuse equations that do not give exactly what the problem names.

        Raises
        ------
        ProblemError
            Naming the first missing or superfluous expression.
        """
        integrands = [integral.name for integral in self.integrals]
        if self.lagrange is not None and self.lagrange not in integrands:
            integrands.append(self.lagrange)
        for kind, given, wanted in (
            ("derivative of state", equations.derivatives, [state.name for state in self.states]),
            ("path expression", equations.path, [constraint.name for constraint in self.path]),
            ("integrand", equations.integrands, integrands),
        ):
            for name in wanted:
                if name not in given:
                    raise ProblemError(f"the equations of {self.name!r} give no {kind} {name!r}")
            for name, value in given.items():
                if name not in wanted:
                    raise ProblemError(unknown(kind, name, wanted))
                if (
                    np.size(value) != 1
                    if isinstance(value, np.ndarray | list | tuple)
                    else _numel(value) != 1
                ):
                    raise ProblemError(
                        f"the equations of {self.name!r}: {kind} {name!r} is not one number or expression"
                    )


def _numel(value: Any) -> int:
    """Return how many elements an expression has; a plain number has one."""
    return int(value.numel()) if hasattr(value, "numel") else 1


def interval(value: float | Bounds) -> Bounds:
    """Return a fixed value as a closed interval of no width, an interval as it is."""
    if isinstance(value, tuple):
        return value
    return (float(value), float(value))


def unknown(kind: str, name: str, known: Iterable[str]) -> str:
    """Say that a name is unknown, with the nearest one or all of them."""
    known = list(known)
    near = get_close_matches(name, known, n=1)
    if near:
        return f"no {kind} is named {name!r}; did you mean {near[0]!r}?"
    return f"no {kind} is named {name!r}; known: {', '.join(known) or 'none'}"
