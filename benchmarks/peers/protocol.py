"""What every adapter shares: the statements, what is asked of a package, and the line that it answers with.

An adapter is a script of its package's environment, ``python maptor.py brachistochrone``. It prints one
line of JSON; whatever its package prints goes to standard error. Nothing here needs more than the standard
library, so that it runs beside any version of anything.
"""

from __future__ import annotations

import importlib.util
import json
import os
import platform
import resource
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any

# What every package is asked for.
MESH_TOLERANCE = 1e-6
NLP_TOLERANCE = 1e-8
NLP_ITERATIONS = 2000
INTERVALS = 10
POINTS = 4
LOWEST, HIGHEST = 3, 10
MESHES = 25

STATEMENTS_FILE = Path(__file__).resolve().parents[2] / "src/thesislib/classical/benchmarks/problems.py"


def statements() -> dict[str, Any]:
    """Return the published problems by name, read from the library's file without the library."""
    name = "published_problems"
    spec = importlib.util.spec_from_file_location(name, STATEMENTS_FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return dict(module.STATEMENTS)


@dataclass
class Outcome:
    """What a package found.

    Parameters
    ----------
    objective : float
        The minimum that the package reports.
    points, intervals, meshes : int
        Collocation points and intervals of the last mesh; number of meshes solved.
    error : float, optional
        The package's own estimate of the relative error on the last mesh, if it has one.
    converged : bool
        Whether the package itself says that it has reached what was asked.
    reason : str
        In the package's words, or the adapter's, why not.
    """

    objective: float | None = None
    points: int | None = None
    intervals: int | None = None
    meshes: int | None = None
    error: float | None = None
    converged: bool = False
    reason: str = ""


def answer(package: str, distributions: Sequence[str], solve: Callable[[Any], Outcome]) -> None:
    """Solve the problem that the command line names and print the line of JSON.

    Parameters
    ----------
    package : str
        The package's name in the table.
    distributions : sequence of str
        Distributions whose versions are reported, the package's own first.
    solve : callable
        From a statement to an `Outcome`. An exception is an answer, too.
    """
    statement = statements()[sys.argv[1]]
    line = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    begun, compiling = _user_seconds(resource.RUSAGE_SELF), _user_seconds(resource.RUSAGE_CHILDREN)
    try:
        outcome = solve(statement)
    except Exception as failure:
        traceback.print_exc()
        said = str(failure).strip() or type(failure).__name__
        outcome = Outcome(reason=said.splitlines()[0][:200])
    result = {
        "package": package,
        "problem": statement.name,
        **_finite(asdict(outcome)),
        "cpu_seconds": _user_seconds(resource.RUSAGE_SELF) - begun,
        "compiler_seconds": _user_seconds(resource.RUSAGE_CHILDREN) - compiling,
        "python": platform.python_version(),
        "versions": {name: version(name) for name in distributions},
    }
    if statement.is_maximum and result["objective"] is not None:
        result["objective"] = -result["objective"]
    line.write(json.dumps(result) + "\n")
    line.flush()


def _user_seconds(who: int) -> float:
    return resource.getrusage(who).ru_utime


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values with None for what JSON cannot say."""
    return {
        name: None if isinstance(value, float) and not isfinite(value) else value
        for name, value in values.items()
    }
