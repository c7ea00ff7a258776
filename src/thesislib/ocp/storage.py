"""Solutions as files: arrays and one JSON text in an .npz archive, nothing that runs when it is read."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from thesislib.ocp.iterate import Iterate, Multipliers, Scales, rescaled
from thesislib.ocp.mesh import Mesh
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.problem import Problem, ProblemError
from thesislib.ocp.refinement import ErrorEstimate
from thesislib.ocp.solution import MeshRecord, Solution

SCHEMA = 2
MULTIPLIERS = ("costates", "path", "bounds", "left_out", "sums", "boundary", "parameters")
SCALES = ("states", "controls", "parameters", "path", "integrals", "boundary")


def save(solution: Solution, path: Path | str) -> Path:
    """Write a solution, multipliers and history included.

    The file takes its place in one step: an interrupted call leaves the file that was there.

    Parameters
    ----------
    solution : Solution
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
    iterate, scales = solution.iterate, Scales.of(solution.pointwise)
    about = {
        "schema": SCHEMA,
        "problem": solution.problem.name,
        "names": solution.problem.names,
        "objective": solution.objective,
        "regularisation": solution.regularisation,
        "tolerance": solution.tolerance,
        "converged": solution.converged,
        "compiled": solution.compiled,
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
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.stem}.unfinished.npz")
    with unfinished.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, about=np.array(json.dumps(about)), **arrays)
    unfinished.replace(path)
    return path


def load(problem: Problem, path: Path | str, compile_code: bool | None = None) -> Solution:
    """Read a solution back, to look at it or to start from it.

    Parameters
    ----------
    problem : Problem
        The problem it solves, or one of the same names. Where scales differ, values and multipliers
        are carried over; objective, error estimate and history are those of the problem solved.
    path : Path or str
        The file.
    compile_code : bool, optional
        As in `solve`.

    Returns
    -------
    Solution

    Raises
    ------
    ProblemError
        If the file is not a solution, or one of a problem with other names.
    FileNotFoundError
        If there is no such file.
    """
    path = Path(path)
    about, arrays = _read(path)
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
    iterate = Iterate(
        Mesh(arrays["boundaries"], arrays["orders"]),
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
