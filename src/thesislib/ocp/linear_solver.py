"""QDLDL as the linear solver of IPOPT.

IPOPT loads a linear solver named MA27 from a library that it is told of, and calls four functions of it.
Here that library is a few lines of C, compiled once, that hand every call on to Python.
"""

from __future__ import annotations

import ctypes
import logging
import os
import threading
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Any

import casadi as ca
import numpy as np

from thesislib.ocp import compilation
from thesislib.ocp.ldl import SHIFT, Ldl, routines

logger = logging.getLogger(__name__)

# IPOPT asks for a more accurate solution by a larger pivot tolerance, its three fourths' power, up to a
# largest one. There are no pivots here: that matrix gets factors with a larger shift, and fifteen requests
# later, at the largest tolerance, the matrices are not for factors without pivoting.
LEAST_TOLERANCE, LARGEST_TOLERANCE, RAISED = 1e-300, 1e-4, 10.0

# MA27's calling sequence. The address of its options, an array of the caller's, tells callers apart.
SOURCE = """
typedef void (*analyse_t)(void *, int, int, const int *, const int *, int *);
typedef void (*factorise_t)(void *, const double *, double, int *);
typedef void (*solve_t)(void *, double *);

static analyse_t analyse;
static factorise_t factorise;
static solve_t solve;

void connect_solver(analyse_t a, factorise_t f, solve_t s) { analyse = a; factorise = f; solve = s; }

void ma27id_(int *icntl, double *cntl) { (void)icntl; (void)cntl; }

void ma27ad_(int *n, int *nz, const int *irn, const int *icn, int *iw, int *liw, int *ikeep, int *iw1,
             int *nsteps, int *iflag, int *icntl, double *cntl, int *info, double *ops)
{
    int k;
    (void)iw, (void)liw, (void)ikeep, (void)iw1, (void)iflag, (void)cntl;
    for (k = 0; k < 20; ++k) info[k] = 0;
    info[4] = *nz;
    info[5] = 1;
    *nsteps = 1;
    *ops = 0.0;
    analyse(icntl, *n, *nz, irn, icn, info);
}

void ma27bd_(int *n, int *nz, const int *irn, const int *icn, double *a, int *la, int *iw, int *liw,
             int *ikeep, int *nsteps, int *maxfrt, int *iw1, int *icntl, double *cntl, int *info)
{
    int k;
    (void)n, (void)nz, (void)irn, (void)icn, (void)la, (void)iw, (void)liw, (void)ikeep, (void)nsteps;
    (void)iw1;
    for (k = 0; k < 20; ++k) info[k] = 0;
    *maxfrt = 1;
    factorise(icntl, a, cntl[0], info);
}

void ma27cd_(int *n, double *a, int *la, int *iw, int *liw, double *w, int *maxfrt, double *rhs, int *iw1,
             int *nsteps, int *icntl, double *cntl)
{
    (void)n, (void)a, (void)la, (void)iw, (void)liw, (void)w, (void)maxfrt, (void)iw1, (void)nsteps;
    (void)cntl;
    solve(icntl, rhs);
}
"""
FATAL, SINGULAR, FLAG, NEGATIVE, INFO = -1, -5, 0, 14, 20  # what MA27 says, and where in its 20 numbers

_ADDRESS, _INT = ctypes.c_void_p, ctypes.c_int
_ANALYSE = ctypes.CFUNCTYPE(None, _ADDRESS, _INT, _INT, _ADDRESS, _ADDRESS, _ADDRESS)
_FACTORISE = ctypes.CFUNCTYPE(None, _ADDRESS, _ADDRESS, ctypes.c_double, _ADDRESS)
_SOLVE = ctypes.CFUNCTYPE(None, _ADDRESS, _ADDRESS)

_in_use = threading.Lock()  # the library has one place for the functions that it calls


class LinearSolver:
    """QDLDL in the place of IPOPT's linear solver, as a context, for one call of IPOPT.

    Parameters
    ----------
    library : Path
        The compiled `SOURCE`.
    multipliers : int
        Number of rows of the programme's constraints.

    Attributes
    ----------
    factorisations : int
        How many matrices were factorised.
    doubts : int
        How often IPOPT asked for more accuracy.
    failed : bool
        Whether IPOPT kept asking for more accuracy than there is without pivoting.
    """

    def __init__(self, library: Path, multipliers: int) -> None:
        self.library, self.multipliers = library, multipliers
        self.factorisations, self.doubts, self.failed = 0, 0, False
        self.caught: BaseException | None = None
        self.factors: dict[int, Ldl] = {}
        self.tolerances: dict[int, float] = {}
        self.connected = (_ANALYSE(self._analyse), _FACTORISE(self._factorise), _SOLVE(self._solve))

    @property
    def options(self) -> dict[str, Any]:
        """What IPOPT is told."""
        return {
            "ipopt.linear_solver": "ma27",
            "ipopt.hsllib": str(self.library),
            "ipopt.linear_system_scaling": "none",
            "ipopt.ma27_pivtol": LEAST_TOLERANCE,
            "ipopt.ma27_pivtolmax": LARGEST_TOLERANCE,
        }

    def __enter__(self) -> LinearSolver:
        _in_use.acquire()
        ctypes.CDLL(str(self.library)).connect_solver(*self.connected)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.factors.clear()
        _in_use.release()
        if self.caught is not None:  # raised where nobody could catch it
            raise self.caught

    def _analyse(self, key: int, n: int, nz: int, rows: int, columns: int, info: int) -> None:
        def work() -> None:
            library = routines()
            assert library is not None
            places = [_ints(at, nz).astype(np.int64) - 1 for at in (rows, columns)]
            self.factors[key] = Ldl(library, n, places[0], places[1], self.multipliers)
            self.tolerances[key] = LEAST_TOLERANCE

        self._guarded(work, info)

    def _factorise(self, key: int, values: int, tolerance: float, info: int) -> None:
        def work() -> None:
            factors, doubted = self.factors[key], tolerance > self.tolerances[key]
            self.tolerances[key] = tolerance
            self.factorisations += 1
            self.doubts += doubted
            self.failed |= tolerance >= LARGEST_TOLERANCE
            shift = SHIFT * (RAISED if doubted else 1.0)
            negative = factors.factorise(_doubles(values, factors.count), shift)
            answer = _ints(info, INFO)
            if self.failed:
                answer[FLAG] = FATAL
            elif negative is None:
                answer[FLAG] = SINGULAR
            else:
                answer[NEGATIVE] = negative

        self._guarded(work, info)

    def _solve(self, key: int, right: int) -> None:
        def work() -> None:
            factors = self.factors[key]
            values = _doubles(right, factors.size)
            values[:] = factors.solve(values)

        self._guarded(work)

    def _guarded(self, work: Callable[[], None], info: int | None = None) -> None:
        """Do the work, unless something went wrong before; keep what it raises and tell IPOPT to end."""
        if self.caught is None:
            try:
                return work()
            except BaseException as error:
                self.caught = error
        if info is not None:
            _ints(info, INFO)[FLAG] = FATAL


def linear_solver(multipliers: int) -> LinearSolver | None:
    """Return QDLDL for one call of IPOPT, or None where it is not to be had or in use.

    It needs a C compiler whose use the environment variable `THESIS_COMPILE` does not forbid, QDLDL's
    functions in its package's module, and an IPOPT that loads linear solvers.
    """
    if os.environ.get("THESIS_COMPILE", "1") == "0" or _in_use.locked():
        return None
    library = _tried()
    return None if library is None else LinearSolver(library, multipliers)


@lru_cache(maxsize=1)
def _tried() -> Path | None:
    """Return the library, once IPOPT has solved a small programme with it."""
    library = compilation.library("solver", SOURCE) if routines() is not None else None
    if library is None:
        return None
    x = ca.SX.sym("x", 2)
    nlp = {"x": x, "f": ca.sumsqr(x - 1), "g": x[0] + x[1]}
    try:
        with LinearSolver(library, 1) as solver:
            quiet: dict[str, Any] = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False}
            trial = ca.nlpsol("trial", "ipopt", nlp, quiet | solver.options)
            found = trial(x0=0.0, lbg=1.0, ubg=1.0)
            done = trial.stats()["success"] and solver.factorisations > 0
        return library if done and abs(float(found["f"]) - 0.5) < 1e-6 else None
    except RuntimeError as error:
        logger.info("IPOPT cannot use QDLDL: %s", error)
        return None


def _ints(address: int, count: int) -> np.ndarray:
    return np.ctypeslib.as_array((ctypes.c_int * count).from_address(address))


def _doubles(address: int, count: int) -> np.ndarray:
    return np.ctypeslib.as_array((ctypes.c_double * count).from_address(address))
