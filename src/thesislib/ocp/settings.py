"""How a problem is solved, and what a caller hears on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

from thesislib.ocp.problem import ProblemError, unknown


@dataclass(frozen=True)
class Progress:
    """Where a solve is, after an iteration of IPOPT.

    Attributes
    ----------
    problem : str
        What is being solved.
    mesh : int
        The mesh, counted from 1.
    intervals, points : int
        Its size.
    iteration : int
        Iterations on this mesh.
    objective : float
        The minimised objective, regulariser included.
    violation : float
        Largest violation of a constraint, as the solver sees it.
    """

    problem: str
    mesh: int
    intervals: int
    points: int
    iteration: int
    objective: float
    violation: float


@dataclass(frozen=True)
class Settings:
    """How a problem is solved.

    Parameters
    ----------
    tolerance : float
        Largest relative state error (2.162).
    optimality : float
        IPOPT's tolerance on the scaled programme, of the solution that is returned.
    draft : float, optional
        IPOPT's tolerance on every mesh before that: meshes that will be refined need no
        more, and a barrier parameter that has not vanished makes the next start easier. The
        last mesh is then solved once more. By default the same as `optimality`.
    aim : float
        Refinement aims at this part of the tolerance: the decay that (2.163) counts on is too
        hopeful where controls have kinks, and a mesh more costs more than a few points.
    reduction : float
        Where the error is below this part of the tolerance, points are taken away and neighbouring
        intervals merged, once a mesh is refined elsewhere. What was ever refined stays. Zero: never.
    meshes : int
        Largest number of meshes.
    lowest, highest : int
        N_min and N_max of (2.163) and (2.164).
    most_points : int
        Refinement stops before a mesh of more collocation points than this.
    iterations : int
        Largest number of IPOPT iterations on one mesh.
    seconds : float
        User CPU seconds after which the whole solve gives up.
    barrier : float
        Initial barrier parameter of a warm start.
    form : {"differential", "integral"}
        Collocation by (2.147) or by (2.149): the same solutions from other equations.
    linear_solver : {"auto", "mumps", "ldl"}
        What solves IPOPT's linear systems: MUMPS, which pivots; or QDLDL, which does not and takes half
        the time on a large programme. "auto" is QDLDL for large programmes where it is to be had. Where
        IPOPT gets stuck with QDLDL it is called again with MUMPS.
    ipopt : mapping
        Further options of IPOPT by name, without the prefix.
    log_file : str, optional
        Where IPOPT writes its iterations.
    progress : callable, optional
        Called with a `Progress` after every iteration; a true answer stops the solve.
    """

    tolerance: float = 1e-6
    optimality: float = 1e-8
    draft: float | None = None
    aim: float = 0.5
    reduction: float = 1e-3
    meshes: int = 20
    lowest: int = 3
    highest: int = 10
    most_points: int = 30_000
    iterations: int = 1000
    seconds: float = 1e9
    barrier: float = 1e-6
    form: Literal["differential", "integral"] = "differential"
    linear_solver: Literal["auto", "mumps", "ldl"] = "auto"
    ipopt: Mapping[str, Any] = field(default_factory=dict)
    log_file: str | None = None
    progress: Callable[[Progress], bool | None] | None = None

    def __post_init__(self) -> None:
        for name, low, high in (
            ("tolerance", 0.0, 1.0),
            ("optimality", 0.0, 1.0),
            ("draft", 0.0, 1.0),
            ("barrier", 0.0, 1.0),
        ):
            value = getattr(self, name)
            if value is not None and not low < value < high:
                raise ProblemError(f"{name} = {value:g} is outside {low:g} .. {high:g}")
        for name, least in (("meshes", 1), ("lowest", 1), ("highest", self.lowest), ("most_points", 1)):
            if getattr(self, name) < least:
                raise ProblemError(f"{name} = {getattr(self, name)} must be at least {least}")
        if not 0 < self.aim <= 1:
            raise ProblemError(f"aim = {self.aim:g} is outside 0 .. 1")
        if not 0 <= self.reduction < 1:
            raise ProblemError(f"reduction = {self.reduction:g} is outside 0 .. 1")
        if self.linear_solver not in ("auto", "mumps", "ldl"):
            raise ProblemError(f"linear_solver = {self.linear_solver!r} is not one of auto, mumps, ldl")
        if not self.seconds > 0:
            raise ProblemError(f"seconds = {self.seconds:g} must be positive")

    def with_changes(self, **changes: Any) -> Settings:
        """Return the settings with single ones changed.

        Raises
        ------
        ProblemError
            If no setting has that name, or a value is out of range.
        """
        known = [setting.name for setting in fields(self)]
        for name in changes:
            if name not in known:
                raise ProblemError(unknown("setting", name, known))
        return replace(self, **changes)
