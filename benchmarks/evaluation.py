"""What one evaluation of the lap problem costs, and with whose derivatives.

The minimum lap time problem of chapter 4 on a uniform mesh is evaluated at its quasi-steady start, with
multipliers drawn at random, in three ways: the library's own assembly with compiled point functions; the
same on CasADi's virtual machine, which is what a machine without a compiler gets; and the derivatives
that CasADi makes by itself from the expressions of the whole programme. All three stand in one process
and take turns, so that the ratios hold on a machine that does other work.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial

import casadi as ca
import numpy as np
import reporting

from thesislib import ocp
from thesislib.lap.setups import Setup
from thesislib.lap.start import quasi_steady_start
from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.iterate import guessed, pack
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.transcription import Programme, Transcription

PIECES = ("objective and constraints", "gradient of the objective", "Jacobian", "Hessian")
SEED = 4

# The ways agree to rounding. More than this, of the largest entry, and one of them is wrong.
AGREEMENT = 1e-11

Array = np.ndarray
Evaluations = Mapping[str, ca.Function]


def main() -> None:
    parser = reporting.options(__doc__.partition("\n")[0])
    parser.add_argument("--intervals", type=int, default=465, help="intervals of four points (465)")
    parser.add_argument("--repetitions", type=int, default=15, help="of which the median counts (15)")
    options = parser.parse_args()
    mesh = ocp.Mesh.uniform(options.intervals, 4)
    setup = Setup()
    problem = setup.problem("minimum lap time")
    pointwise = Pointwise(problem, compile_code=False)
    transcription = Transcription(pointwise, Endpoints(pointwise), mesh)
    ways, prepared = prepared_ways(problem, mesh)
    iterate = guessed(pointwise, mesh, quasi_steady_start(setup.road(), setup.car()))
    random = np.random.default_rng(SEED)
    arguments = [
        pack(iterate, transcription)[0],
        transcription.parameter_vector(iterate.parameters),
        np.ones(1),
        random.standard_normal(transcription.rows),
    ]
    compare(ways, arguments)
    milliseconds = measured(ways, arguments, options.repetitions)
    heading = (
        f"Lap problem on {mesh.intervals} intervals, {mesh.points} points: "
        f"{transcription.variables} variables, {transcription.rows} constraints"
    )
    text = "\n\n".join((heading, comparison(milliseconds, prepared), reporting.surroundings()))
    reporting.publish("evaluation", text, options.keep)


def prepared_ways(problem: ocp.Problem, mesh: ocp.Mesh) -> tuple[dict[str, Evaluations], dict[str, float]]:
    """Return the evaluations of every way, and the CPU seconds it took to prepare them.

    Compiled code that lies in the cache counts as prepared; the compiler's time is not in the seconds.
    """
    ways: dict[str, Evaluations] = {}
    seconds: dict[str, float] = {}
    for name, compile_code, derivatives in (
        ("compiled C", True, assembled),
        ("virtual machine", False, assembled),
        ("CasADi's own", False, automatic),  # compiled functions have no derivatives of their own
    ):
        begun = time.process_time()
        pointwise = Pointwise(problem, compile_code)
        if compile_code and not pointwise.compiled:
            print("no working C compiler here: the compiled derivatives are left out")
            continue
        ways[name] = derivatives(Transcription(pointwise, Endpoints(pointwise), mesh).programme())
        seconds[name] = time.process_time() - begun
    return ways, seconds


def comparison(milliseconds: Mapping[str, Mapping[str, float]], prepared: Mapping[str, float]) -> str:
    """Return the table of CPU times, and of their ratios to the first way's."""
    reference, *others = milliseconds
    rows = [
        (
            piece,
            *(f"{times[piece]:.2f}" for times in milliseconds.values()),
            *(f"{milliseconds[way][piece] / milliseconds[reference][piece]:.1f}" for way in others),
        )
        for piece in PIECES
    ]
    once = (f"{1e3 * seconds:.0f}" for seconds in prepared.values())
    rows.append(("preparation, once", *once, *("" for _ in others)))
    return reporting.table(("CPU ms", *milliseconds, *(f"{way} : {reference}" for way in others)), rows)


def assembled(programme: Programme) -> Evaluations:
    """Return the evaluations as IPOPT gets them."""
    given = programme.derivatives
    return {
        PIECES[0]: ca.Function("nlp", programme.nlp, ["x", "p"], ["f", "g"]),
        PIECES[1]: given["grad_f"],
        PIECES[2]: given["jac_g"],
        PIECES[3]: given["hess_lag"],
    }


def automatic(programme: Programme) -> Evaluations:
    """Return the evaluations as `casadi.nlpsol` makes them itself if it is given none."""
    nlp = ca.Function("nlp", programme.nlp, ["x", "p"], ["f", "g"])
    return {
        PIECES[0]: nlp,
        PIECES[1]: nlp.factory("grad_f", ["x", "p"], ["f", "grad:f:x"]),
        PIECES[2]: nlp.factory("jac_g", ["x", "p"], ["g", "jac:g:x"]),
        PIECES[3]: nlp.factory(
            "hess_lag",
            ["x", "p", "lam:f", "lam:g"],
            ["triu:hess:gamma:x:x"],
            {"gamma": ["f", "g"]},
        ),
    }


def compare(ways: Mapping[str, Evaluations], arguments: list[Array]) -> None:
    """End the benchmark if two ways disagree: a fast wrong derivative is no result."""
    for piece in PIECES:
        results = [outputs(functions[piece], arguments) for functions in ways.values()]
        for way, result in zip(ways, results, strict=True):
            for reference, other in zip(results[0], result, strict=True):
                size = float(ca.mmax(ca.fabs(reference)))
                difference = float(ca.mmax(ca.fabs(reference - other))) / size
                if not difference <= AGREEMENT:
                    raise SystemExit(f"{piece}: {way} differs by {difference:.1e} of the largest entry")


def outputs(function: ca.Function, arguments: list[Array]) -> list[ca.DM]:
    """Return all outputs of a function of the first of the arguments."""
    return function.call([ca.DM(argument) for argument in arguments[: function.n_in()]])


def measured(
    ways: Mapping[str, Evaluations], arguments: list[Array], repetitions: int
) -> dict[str, dict[str, float]]:
    """Return the median CPU milliseconds of a call, by way and piece; the ways take turns."""
    calls = {
        way: {piece: call(functions[piece], arguments) for piece in PIECES} for way, functions in ways.items()
    }
    times: dict[str, dict[str, list[float]]] = {way: {piece: [] for piece in PIECES} for way in ways}
    for _ in range(repetitions):
        for piece in PIECES:
            for way in ways:
                begun = time.process_time()
                calls[way][piece]()
                times[way][piece].append(1e3 * (time.process_time() - begun))
    return {way: {piece: float(np.median(taken)) for piece, taken in of.items()} for way, of in times.items()}


def call(function: ca.Function, arguments: list[Array]) -> Callable[[], None]:
    """Return a call of a function without the conversion of its arguments and results."""
    buffer, evaluate = function.buffer()
    inputs = [np.ascontiguousarray(argument, dtype=float) for argument in arguments[: function.n_in()]]
    outputs = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
    for i, values in enumerate(inputs):
        buffer.set_arg(i, memoryview(values))
    for i, values in enumerate(outputs):
        buffer.set_res(i, memoryview(values))
    # CasADi keeps bare pointers to the buffer and to the arrays: they have to live as long as the call
    return partial(_evaluated, evaluate, (buffer, inputs, outputs))


def _evaluated(evaluate: Callable[[], None], _: object) -> None:
    evaluate()


if __name__ == "__main__":
    main()
