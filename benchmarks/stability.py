"""What one sum-of-squares program of chapter 7 costs, stated and solved in three ways.

The program is the test of the gamma step: the largest slack of (7.30) for a certified V of degree 2 to 8,
with the same pruned bases and the same solver, Clarabel. It is stated by the library itself, through cvxpy
and, where pydrake is installed, through Drake's MathematicalProgram. All stand in one process and take
turns; processor time counts, from the polynomials to the solution. The answers have to agree.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence

import cvxpy as cp
import numpy as np
import reporting
from scipy import sparse

from thesislib.stability.bivariate import Polynomial
from thesislib.stability.cases import Setting, regions
from thesislib.stability.fields import Field
from thesislib.stability.gram import products
from thesislib.stability.programs import PHI, Bases, bases, multiplier, rise, slack

try:
    from pydrake.solvers import ClarabelSolver, MathematicalProgram
except ImportError:
    MathematicalProgram = None

DEGREES = [2, 4, 6, 8]
AGREEMENT = 2e-3
"""Largest difference between the slacks found: of the duality gaps that the paths stop at."""

Way = Callable[[Field, Polynomial], float]


def main() -> None:
    parser = reporting.options(__doc__.partition("\n")[0])
    parser.add_argument("--repetitions", type=int, default=7, help="of which the median counts (7)")
    options = parser.parse_args()
    truth, found = regions(Setting(), DEGREES)
    field = found[2].cars[0].field
    ways: dict[str, Way] = {"library": by_library, "cvxpy": by_cvxpy}
    if MathematicalProgram is not None:
        ways["Drake"] = by_drake
    rows = []
    for degree in DEGREES:
        times = measured(ways, field, found[degree].V, options.repetitions)
        own = times["library"]
        rows.append(
            [f"degree {degree}", *(f"{each:.1f}" for each in times.values())]
            + [f"{times[name] / own:.2f}" for name in list(ways)[1:]]
        )
    columns = ["program", *(f"{name}, ms" for name in ways), *(f"{n} / library" for n in list(ways)[1:])]
    missing = "" if MathematicalProgram is not None else "\nDrake: pydrake is not installed\n"
    heading = f"Gamma step at u_0 = {truth.car.u_0:g} m/s, processor time of one program\n"
    table = reporting.table(columns, rows)
    reporting.publish("stability", f"{heading}\n{table}\n{missing}\n{reporting.surroundings()}", options.keep)


def measured(ways: dict[str, Way], field: Field, V: Polynomial, repetitions: int) -> dict[str, float]:
    """Return the median processor time of each way in ms.

    Raises
    ------
    RuntimeError
        If the ways disagree.
    """
    times: dict[str, list[float]] = {name: [] for name in ways}
    slacks: dict[str, float] = {}
    for _ in range(repetitions):
        for name, way in ways.items():
            started = time.process_time()
            slacks[name] = way(field, V)
            times[name].append(1e3 * (time.process_time() - started))
    if max(slacks.values()) - min(slacks.values()) > AGREEMENT:
        raise RuntimeError(f"The ways disagree on the slack of degree {V.degree}: {slacks}.")
    return {name: statistics.median(each) for name, each in times.items()}


def by_library(field: Field, V: Polynomial) -> float:
    """Solve through `thesislib.stability.program`."""
    return multiplier(field, V).margin


def statement(field: Field, V: Polynomial) -> tuple[Bases, Polynomial, Polynomial, Polynomial]:
    """Return bases, and (7.30) without q_2, what multiplies q_2, and the direction of the slack."""
    basis = bases(field, V.degree)
    d = field.floats[2]
    return basis, -rise(field, V) - d * PHI, d * (V - 1.0), slack(basis.falling)


def by_cvxpy(field: Field, V: Polynomial) -> float:
    """Solve through cvxpy, with one matrix equation for all coefficients."""
    basis, known, factor, direction = statement(field, V)
    grams = [cp.Variable((len(block), len(block)), PSD=True) for block in basis.falling]
    q = [cp.Variable((len(block), len(block)), PSD=True) for block in basis.multiplier]
    t = cp.Variable()
    squares = products(basis.falling)
    index = {exponents: row for row, exponents in enumerate(squares)}

    def picks(blocks: Sequence, shift: Polynomial) -> list[sparse.csr_matrix]:
        """Return for each block the matrix from its entries to the coefficients of shift times z'Qz."""
        entries: list[list[tuple[float, int, int]]] = [[] for _ in blocks]
        for (i, j), places in products(blocks).items():
            for (k, m), value in shift.terms():
                row = index[i + k, j + m]
                for block, a, b in places:
                    size = len(blocks[block])
                    entries[block] += [(value, row, a * size + b)]
                    if a != b:
                        entries[block] += [(value, row, b * size + a)]
        built = []
        for block, each in zip(blocks, entries, strict=True):
            value, row, column = zip(*each, strict=True)
            built.append(sparse.csr_matrix((value, (row, column)), (len(index), len(block) ** 2)))
        return built

    one = Polynomial.from_terms({(0, 0): 1.0})
    left = _vector(known, index) - t * _vector(direction, index)
    left = left + sum(
        A @ cp.vec(Q, order="C") for A, Q in zip(picks(basis.multiplier, factor), q, strict=True)
    )
    right = sum(A @ cp.vec(Q, order="C") for A, Q in zip(picks(basis.falling, one), grams, strict=True))
    problem = cp.Problem(cp.Maximize(t), [left == right, t <= 1])
    problem.solve(solver=cp.CLARABEL)
    return float(t.value)


def _vector(p: Polynomial, index: dict[tuple[int, int], int]) -> np.ndarray:
    vector = np.zeros(len(index))
    for exponents, value in p.terms():
        vector[index[exponents]] = value
    return vector


def by_drake(field: Field, V: Polynomial) -> float:
    """Solve through Drake: Gram matrices as symmetric variables, one linear equation a coefficient."""
    basis, known, factor, direction = statement(field, V)
    program = MathematicalProgram()
    grams = [program.NewSymmetricContinuousVariables(len(block)) for block in basis.falling]
    q = [program.NewSymmetricContinuousVariables(len(block)) for block in basis.multiplier]
    for matrix in (*grams, *q):
        program.AddPositiveSemidefiniteConstraint(matrix)
    t = program.NewContinuousVariables(1)[0]
    rows: dict[tuple[int, int], list[tuple[float, object]]] = {e: [] for e in products(basis.falling)}
    for e, places in products(basis.falling).items():
        rows[e] += [(-1.0 if a == b else -2.0, grams[k][a, b]) for k, a, b in places]
    for (i, j), places in products(basis.multiplier).items():
        for (k, m), value in factor.terms():
            rows[i + k, j + m] += [(value * (1 if a == b else 2), q[n][a, b]) for n, a, b in places]
    for e, value in direction.terms():
        rows[e].append((-value, t))
    constant = dict(known.terms())
    for e, entries in rows.items():
        factors, variables = zip(*entries, strict=True)
        bound = -constant.get(e, 0.0)
        program.AddLinearEqualityConstraint(np.array([factors]), np.array([bound]), np.array(variables))
    program.AddBoundingBoxConstraint(-np.inf, 1.0, t)
    program.AddLinearCost(-t)
    result = ClarabelSolver().Solve(program)
    return float(result.GetSolution(t))


if __name__ == "__main__":
    main()
