"""Solutions as files: arrays and one JSON text in an .npz archive, nothing that runs when it is read."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict
from pathlib import Path
from typing import Any, overload

import numpy as np

from thesislib.ocp.iterate import Iterate, Multipliers, Scales, rescaled
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.phased import PhasedSolution
from thesislib.ocp.phases import Phases
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Problem, ProblemError
from thesislib.ocp.quadrature import FLIPPED_RADAU, RADAU
from thesislib.ocp.refinement import ErrorEstimate
from thesislib.ocp.solution import MeshRecord, Solution
from thesislib.ocp.system import AnySolution, Statement, parts

SCHEMA = 2
MULTIPLIERS = ("costates", "path", "bounds", "left_out", "sums", "boundary", "parameters")
SCALES = ("states", "controls", "parameters", "path", "integrals", "boundary")


def save(solution: AnySolution, path: Path | str) -> Path:
    """Write a solution, multipliers and history included.

    The file takes its place in one step: an interrupted call leaves the file that was there.

    Parameters
    ----------
    solution : Solution or PhasedSolution
        What to keep.
    path : Path or str
        Where; the suffix `.npz` is added where it is missing.

    Returns
    -------
    Path
        The file written.
    """
    path = Path(path)
    path = path if path.suffix == ".npz" else path.with_name(path.name + ".npz")
    about: dict[str, Any] = {"schema": SCHEMA, "phases": []}
    arrays: dict[str, np.ndarray] = {}
    for number, part in enumerate(parts(solution)):
        told, values = _written(part)
        about["phases"].append(told)
        arrays |= {f"{number}_{name}": array for name, array in values.items()}
    if isinstance(solution, PhasedSolution):
        names = [link.name for link in solution.problem.links]
        about["whole"] = {
            "problem": solution.problem.name,
            "links": names,
            "objective": solution.objective,
            "converged": solution.converged,
            "stopped": solution.stopped,
            "history": [asdict(record) for record in solution.history],
        }
        # in units of the objective per unit of the link: the scales need not be kept
        arrays["links"] = np.array([solution.link_multiplier(name) for name in names])
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.stem}.unfinished.npz")
    with unfinished.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, about=np.array(json.dumps(about)), **arrays)
    unfinished.replace(path)
    return path


@overload
def load(problem: Problem, path: Path | str, compile_code: bool | None = None) -> Solution: ...


@overload
def load(problem: Phases, path: Path | str, compile_code: bool | None = None) -> PhasedSolution: ...


def load(problem: Statement, path: Path | str, compile_code: bool | None = None) -> AnySolution:
    """Read a solution back, to look at it or to start from it.

    Parameters
    ----------
    problem : Problem or Phases
        The problem it solves, or one of the same names. Where scales differ, values and multipliers
        are carried over; objective, error estimate and history are those of the problem solved.
    path : Path or str
        The file.
    compile_code : bool, optional
        As in `solve`.

    Returns
    -------
    Solution, or PhasedSolution for Phases

    Raises
    ------
    ProblemError
        If the file is not a solution, or one of a problem with other names.
    FileNotFoundError
        If there is no such file.
    """
    path = Path(path)
    about, arrays = _read(path)
    problems = problem.phases if isinstance(problem, Phases) else (problem,)
    count = len(about["phases"])
    if count != len(problems) or isinstance(problem, Phases) != ("whole" in about):
        whose = about["whole"]["problem"] if "whole" in about else about["phases"][0]["problem"]
        raise ProblemError(
            f"{path} holds a solution of {whose!r}, {count} phase{'s' if count > 1 else ''}; "
            f"{problem.name!r} has {len(problems)}"
        )
    found = []
    for number, (told, ours) in enumerate(zip(about["phases"], problems, strict=True)):
        prefix = f"{number}_"
        mine = {name.removeprefix(prefix): a for name, a in arrays.items() if name.startswith(prefix)}
        found.append(_phase(ours, path, told, mine, compile_code))
    if isinstance(problem, Problem):
        return found[0]
    whole, names = about["whole"], [link.name for link in problem.links]
    if whole["links"] != names:
        raise ProblemError(f"{path} holds a solution with other links than {problem.name!r} has")
    sizes = np.array([link.size for link in problem.links])
    return PhasedSolution(
        problem,
        tuple(found),
        arrays["links"] * sizes / problem.objective_scale,
        whole["objective"],
        tuple(MeshRecord(**record) for record in whole["history"]),
        whole["converged"],
        whole["stopped"],
    )


def _written(solution: Solution) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return what is kept of one phase: what goes into the JSON text, and the arrays."""
    iterate, scales = solution.iterate, Scales.of(solution.pointwise)
    about = {
        "problem": solution.problem.name,
        "names": solution.problem.names,
        "rule": iterate.mesh.rule.name,
        "objective": solution.objective,
        "regularisation": solution.regularisation,
        "tolerance": solution.tolerance,
        "converged": solution.converged,
        "compiled": solution.compiled,
        "stopped": solution.stopped,
        "objective_scale": scales.objective,
        "history": [asdict(record) for record in solution.history],
    }
    arrays = {
        "boundaries": iterate.mesh.boundaries,
        "orders": iterate.mesh.orders,
        "states": iterate.states,
        "controls": iterate.controls,
        "parameters": iterate.parameters,
        "error_by_state": solution.estimate.by_state,
        "error_place": solution.estimate.place,
    }
    arrays |= {f"scale_{name}": getattr(scales, name) for name in SCALES}
    if iterate.multipliers is not None:
        arrays |= {f"multiplier_{name}": getattr(iterate.multipliers, name) for name in MULTIPLIERS}
    return about, arrays


def _phase(
    problem: Problem,
    path: Path,
    about: dict[str, Any],
    arrays: dict[str, np.ndarray],
    compile_code: bool | None,
) -> Solution:
    """Return the solution of one phase from what `_written` has kept."""
    for kind, names in problem.names.items():
        kept = about["names"][kind]
        if kept != names:
            raise ProblemError(
                f"{path} holds a solution of {about['problem']!r} with {kind} {', '.join(kept) or 'none'}; "
                f"{problem.name!r} has {', '.join(names) or 'none'}"
            )
    multipliers = None
    if "multiplier_costates" in arrays:
        multipliers = Multipliers(*(arrays[f"multiplier_{name}"] for name in MULTIPLIERS))
    rule = next(rule for rule in (RADAU, FLIPPED_RADAU) if rule.name == about["rule"])
    iterate = Iterate(
        Mesh(arrays["boundaries"], arrays["orders"], rule),
        arrays["states"],
        arrays["controls"],
        arrays["parameters"],
        multipliers,
    )
    theirs = Scales(**{name: arrays[f"scale_{name}"] for name in SCALES}, objective=about["objective_scale"])
    pointwise = Pointwise(problem, compile_code)
    return Solution(
        pointwise,
        rescaled(iterate, theirs, Scales.of(pointwise)),
        about["objective"],
        about["regularisation"],
        ErrorEstimate(arrays["error_by_state"], arrays["error_place"]),
        about["tolerance"],
        tuple(MeshRecord(**record) for record in about["history"]),
        about["converged"],
        about["compiled"],
        about["stopped"],
    )


def _read(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the JSON text and the arrays of a file."""
    with path.open("rb") as file:
        if not zipfile.is_zipfile(file):
            raise ProblemError(f"{path} is not a stored solution: it is no archive")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        about = json.loads(str(arrays.pop("about")))
    except (zipfile.BadZipFile, ValueError, KeyError) as error:
        raise ProblemError(f"{path} is not a stored solution: {error}") from error
    if about["schema"] != SCHEMA:
        raise ProblemError(f"{path} has schema {about['schema']}; this version reads {SCHEMA}")
    return about, arrays
