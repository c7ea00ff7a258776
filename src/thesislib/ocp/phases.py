"""Problems of several phases: each with its own equations, linked at the ends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from thesislib.ocp.problem import Ends, Point, Problem, ProblemError, Quantity, unknown

# From the ends of every phase, by its name, to an expression.
AtEnds = Callable[[Point], Any]


@dataclass(frozen=True)
class Link(Quantity):
    """A condition between the ends of phases, kept within its bounds.

    Parameters
    ----------
    expression : callable
        From the `Ends` of every phase, by name of the phase, to the expression:
        `lambda at: at.coast.initial.h - at.boost.final.h`.
    """

    bounds: tuple[float, float] = (0.0, 0.0)
    expression: AtEnds | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.expression is None:
            raise ProblemError(f"link {self.name!r} has no expression")


@dataclass(frozen=True)
class Phases:
    """An optimal control problem of several phases.

    The objective is the sum of those of the phases and of `cost`. Constants of the same name are the
    same number in every phase.

    Parameters
    ----------
    name : str
        What is being solved.
    phases : sequence of Problem
        The phases in order; their names tell them apart.
    links : sequence of Link
        What holds between their ends; see `continuous`.
    cost : callable, optional
        From the `Ends` of every phase, by name, to a further part of the objective.

    Raises
    ------
    ProblemError
        If there is no phase or no objective, two phases share a name, they count their objectives in
        different scales, or constants of one name differ.
    """

    name: str
    phases: Sequence[Problem]
    links: Sequence[Link] = ()
    cost: AtEnds | None = None

    def __post_init__(self) -> None:
        if not self.phases:
            raise ProblemError(f"problem {self.name!r} has no phase")
        for kind, names in (
            ("phases", [phase.name for phase in self.phases]),
            ("links", [link.name for link in self.links]),
        ):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ProblemError(f"two {kind} of {self.name!r} are named {twice[0]!r}")
        if self.cost is None and not any(phase.has_objective for phase in self.phases):
            raise ProblemError(
                f"problem {self.name!r} has no objective: give cost, or lagrange or mayer of a phase"
            )
        scales = sorted({phase.objective_scale for phase in self.phases})
        if len(scales) > 1:
            raise ProblemError(
                f"the phases of {self.name!r} have objective scales {scales[0]:g} and {scales[1]:g}; "
                "one objective has one scale"
            )
        constants: dict[str, float] = {}
        for phase in self.phases:
            for name, value in phase.constants.items():
                if constants.setdefault(name, value) != value:
                    raise ProblemError(
                        f"constant {name} of {self.name!r} is {constants[name]:g} and, "
                        f"in phase {phase.name!r}, {value:g}"
                    )

    @property
    def objective_scale(self) -> float:
        """Size of the objective that the solver takes for one."""
        return self.phases[0].objective_scale

    def phase(self, name: str) -> Problem:
        """Return a phase by name."""
        for phase in self.phases:
            if phase.name == name:
                return phase
        raise ProblemError(unknown("phase", name, [phase.name for phase in self.phases]))

    def with_constants(self, **constants: float) -> Phases:
        """Return the problem with other values of constants, in every phase that has them."""
        known = {name for phase in self.phases for name in phase.constants}
        for name in constants:
            if name not in known:
                raise ProblemError(unknown("constant", name, sorted(known)))
        changed = [
            replace(
                phase,
                constants={name: constants.get(name, value) for name, value in phase.constants.items()},
            )
            for phase in self.phases
        ]
        return replace(self, phases=changed)


def continuous(before: Problem, after: Problem, names: Iterable[str] | None = None) -> list[Link]:
    """Return the links by which a phase begins where another ends.

    Parameters
    ----------
    before, after : Problem
        The phases.
    names : iterable of str, optional
        What goes on without a jump: states, or static parameters of both; by default the states that
        both have, and the independent variable where it is free.

    Returns
    -------
    list of Link

    Raises
    ------
    ProblemError
        If a phase does not have what is named, or has it in another unit.
    """
    if names is None:
        theirs = {state.name for state in after.states}
        names = [state.name for state in before.states if state.name in theirs]
        if before.independent.name == after.independent.name and (
            "final" in before.independent.free or "initial" in after.independent.free
        ):
            names = [*names, before.independent.name]
    return [_continuous(before, after, name) for name in names]


def _continuous(before: Problem, after: Problem, name: str) -> Link:
    units, sizes = [], []
    for phase in (before, after):
        known = {q.name: q for q in (*phase.states, *phase.all_parameters)}
        if name == phase.independent.name:
            ends = [*phase.independent.free.values()]
            known[name] = Quantity(
                name, phase.independent.unit, scale=max((q.size for q in ends), default=1.0)
            )
        if name not in known:
            raise ProblemError(f"phase {phase.name!r}: {unknown('state or parameter', name, known)}")
        units.append(known[name].unit)
        sizes.append(known[name].size)
    if units[0] != units[1]:
        raise ProblemError(
            f"{name} is in {units[0]} in phase {before.name!r} and in {units[1]} in phase {after.name!r}; "
            "link them by an expression that converts"
        )

    def jump(at: Point) -> Any:
        return at[after.name].initial[name] - at[before.name].final[name]

    return Link(f"{name} from {before.name} to {after.name}", units[0], (0.0, 0.0), max(sizes), jump)


def divided(
    problem: Problem, switches: Sequence[float], arcs: Sequence[dict[str, Any]] | None = None
) -> Phases:
    """Return a problem as phases that meet at switches, whose places the optimiser finds.

    Where a control jumps or a constraint becomes active, no polynomial across the place converges fast,
    and no fixed mesh point lies there. As the end of a phase the place is a variable of the programme
    and always a mesh point.

    Parameters
    ----------
    problem : Problem
        One phase, without integral constraints, periodic states, data or parameters.
    switches : sequence of float
        First guesses of the places, increasing inside the range of the independent variable. A place
        may move half the way to its neighbours.
    arcs : sequence of dict, optional
        For every phase what differs in it from `problem`, as keywords of `dataclasses.replace`. An arc
        on a constraint should say that the constraint is active there: the points of a phase do not
        see a violation between them, and a switch would drift to make use of it.

    Returns
    -------
    Phases
        The phases are named "arc 1", "arc 2", …

    Raises
    ------
    ProblemError
        If the switches do not increase inside the range, the number of arcs is not one more than theirs,
        or the problem has what cannot be divided.
    """
    for kind, found in (
        ("integral constraints", problem.integrals),
        ("periodic states", problem.periodic),
        ("data", problem.data),
        ("static parameters", problem.parameters),
        ("boundary conditions", problem.boundary),
    ):
        if found:
            raise ProblemError(f"{problem.name!r} has {kind} and cannot be divided at switches")
    independent = problem.independent
    start, end = _middle(independent.initial), _middle(independent.final)
    places = np.array([start, *switches, end], dtype=float)
    if np.any(np.diff(places) <= 0):
        raise ProblemError(
            f"switches {', '.join(f'{place:g}' for place in switches)} do not increase between "
            f"{start:g} and {end:g} {independent.unit}"
        )
    count = len(switches) + 1
    arcs = arcs if arcs is not None else [{}] * count
    if len(arcs) != count:
        raise ProblemError(f"{len(switches)} switches make {count} arcs, not {len(arcs)}")
    middles = 0.5 * (places[:-1] + places[1:])
    ends: list[Any] = [independent.initial]
    ends += [(float(low), float(high)) for low, high in pairwise(middles)]
    ends.append(independent.final)
    phases = []
    for k, changes in enumerate(arcs):
        phase = replace(
            problem,
            name=f"arc {k + 1}",
            independent=replace(independent, initial=ends[k], final=ends[k + 1]),
            initial=problem.initial if k == 0 else {},
            terminal=problem.terminal if k == count - 1 else {},
            mayer=problem.mayer if k == count - 1 else None,
        )
        phases.append(replace(phase, **changes))
    links = [link for before, after in pairwise(phases) for link in continuous(before, after)]
    return Phases(problem.name, phases, links)


def ends_by_phase(phases: Sequence[Problem], ends: Sequence[Ends]) -> Point:
    """Return the ends of every phase by its name."""
    return Point({phase.name: end for phase, end in zip(phases, ends, strict=True)})


def _middle(value: float | tuple[float, float]) -> float:
    """Return an end of the range, or the middle of where it may be."""
    return 0.5 * (value[0] + value[1]) if isinstance(value, tuple) else float(value)
