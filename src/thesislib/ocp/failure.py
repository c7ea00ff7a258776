"""What a solve says that did not reach what was asked."""

from __future__ import annotations

from thesislib.ocp.mesh import Mesh
from thesislib.ocp.residuals import Residual, residuals, undefined, worst_error
from thesislib.ocp.settings import Settings
from thesislib.ocp.solution import MeshRecord
from thesislib.ocp.system import AnySolution

# Rows of the table that goes with the message.
SHOWN = 8


class SolveError(RuntimeError):
    """A solve that did not reach what was asked; its best iterate goes with it, marked.

    The message is one sentence. The table of the worst residuals and the meshes are notes below it,
    which a traceback shows, and attributes.

    Attributes
    ----------
    solution : Solution or PhasedSolution
        The last iterate, with `converged` False.
    residuals : list of Residual
        The worst violation of every equation and every bound, the largest first.
    history : tuple of MeshRecord
        One entry per mesh.
    """

    def __init__(self, message: str, solution: AnySolution, found: list[Residual] | None = None) -> None:
        super().__init__(message)
        self.solution = solution
        self.residuals = sorted(
            residuals(solution) if found is None else found, key=lambda row: row.scaled, reverse=True
        )
        self.history = solution.history
        self.add_note(self.report())

    def report(self) -> str:
        """Return the worst residuals and the meshes as text, a line each."""
        violated = [row for row in self.residuals if not row.scaled < 1e-12][:SHOWN]
        lines = ["worst residuals:", *(f"  {row}" for row in violated)] if violated else ["no residual"]
        lines.append("meshes:")
        lines += [f"  {count}: {told(record)}" for count, record in enumerate(self.history, start=1)]
        return "\n".join(lines)


def told(record: MeshRecord) -> str:
    """Return what happened on one mesh, on one line."""
    status = "" if finished(record.status) else f", {record.status}"
    change = f"; {record.change}" if record.change else ""
    return (
        f"{record.intervals} intervals, {record.points} points, objective {record.objective:.6f}, error "
        f"{record.error:.1e}, {record.iterations} iterations, {record.seconds:.1f} s{status}{change}"
    )


def failure(
    solution: AnySolution, settings: Settings, finer: list[Mesh]
) -> tuple[str, list[Residual]] | None:
    """Say why a solve cannot go on, with the residuals where they were needed, or return None.

    Parameters
    ----------
    solution : Solution or PhasedSolution
        What the last mesh gave.
    settings : Settings
        The limits.
    finer : list of Mesh
        The next meshes, one for each phase.
    """
    name, last, meshes = solution.problem.name, solution.history[-1], len(solution.history)
    if not finished(solution.status):
        found = residuals(solution)
        worst = max(found, key=lambda row: row.scaled)
        why = (
            f"the time limit of {settings.seconds:g} s"
            if _out_of_time(solution, settings)
            else solution.status
        )
        message = (
            f"{name}: IPOPT stopped with {why} on mesh {meshes} "
            f"({last.intervals} intervals, {last.points} points); "
            f"{undefined(solution) or f'largest residual: {worst}'}"
        )
        return message, found
    if solution.converged:
        return None
    limit = None
    points = sum(mesh.points for mesh in finer)
    if meshes >= settings.meshes:
        limit = f"after {meshes} mesh{'es' if meshes > 1 else ''}"
    elif points > settings.most_points:
        limit = f"and the next mesh would have {points} points, more than {settings.most_points}"
    elif _out_of_time(solution, settings):
        limit = f"at the time limit of {settings.seconds:g} s"
    if limit is None:
        return None
    message = (
        f"{name}: the error estimate {solution.error:.1e} is above the tolerance "
        f"{settings.tolerance:.1e} {limit}; largest error: {worst_error(solution)}"
    )
    return message, residuals(solution)


def finished(status: str) -> bool:
    """Whether IPOPT reached its tolerance."""
    return status == "Solve_Succeeded"


def _out_of_time(solution: AnySolution, settings: Settings) -> bool:
    spent = sum(record.seconds for record in solution.history)
    return solution.status == "Maximum_CpuTime_Exceeded" or spent >= settings.seconds
