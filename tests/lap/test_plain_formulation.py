"""The lap written down in `casadi.Opti`, which shares no line with the library's transcription."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

from thesislib import ocp
from thesislib.lap.adjustments import BALANCE, bounds_of
from thesislib.lap.rows import HEIGHTS
from thesislib.lap.setups import Setup
from thesislib.lap.start import quasi_steady_start
from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.iterate import guessed, pack
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.transcription import Transcription

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"

# Intervals of 10 to 20 m with three to five points, and one of ten: what refinement makes of a mesh.
MESH = ocp.Mesh(
    np.concatenate((np.linspace(0.0, 0.5, 21), np.linspace(0.5, 1.0, 41)[1:])),
    np.array([*[4] * 19, 10, *[3] * 20, *[5] * 20]),
)


@pytest.fixture(scope="module")
def plain():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module("plain")


@pytest.fixture(scope="module", params=[(), (BALANCE, *HEIGHTS)], ids=["row C", "row N"])
def problem(request, oval):
    return Setup(track=str(oval), free=bounds_of(request.param)).problem("oval")


@pytest.fixture(scope="module")
def quasi_steady(oval):
    setup = Setup(track=str(oval))
    return quasi_steady_start(setup.road(), setup.car())


@pytest.mark.parametrize("order", [3, 7, 10])
def test_points_slopes_and_weights_are_those_of_radau(plain, order):
    points, differentiation, weights = plain.coefficients_of(order)
    support = np.append(points, 1.0)
    for power in range(order + 1):
        # the slope of a polynomial of the support's degree is exact, to the rounding of ten points
        slope = power * points ** max(power - 1, 0)
        assert differentiation @ support**power == pytest.approx(slope, abs=1e-11)
    for power in range(2 * order - 1):
        assert weights @ points**power == pytest.approx(1.0 / (power + 1), abs=1e-13)


def test_both_programmes_are_the_same_functions(plain, problem, quasi_steady):
    pointwise = Pointwise(problem, compile_code=False)
    transcription = Transcription(pointwise, Endpoints(pointwise), MESH)
    random = np.random.default_rng(1)
    free = {q.name: q.size * random.normal() for q in problem.parameters if q.bounds[0] < q.bounds[1]}
    iterate = guessed(pointwise, MESH, {**quasi_steady, **free})
    ours = transcription.programme().derivatives
    values = [pack(iterate, transcription)[0], transcription.parameter_vector(iterate.parameters)]
    written = plain.Plain(problem, MESH)
    chosen = [
        value / next(q.size for q in problem.parameters if q.name == name) for name, value in free.items()
    ]
    f, g = written.programme()(iterate.states[:, :-1], iterate.controls, *([chosen] if chosen else []))
    # the same sums in another order
    assert float(f) == pytest.approx(float(ours["grad_f"](*values)[0]), rel=1e-12)
    rows = np.array(ours["jac_g"](*values)[0]).ravel()
    g = np.array(g).ravel()
    defects = transcription.defect_rows.T.ravel()
    assert g[: len(defects)] == pytest.approx(rows[defects], abs=1e-11)
    path = transcription.path_rows.ravel()
    limits = np.repeat([constraint.bounds[1] / constraint.size for constraint in problem.path], MESH.points)
    slack = (g[len(defects) : len(defects) + len(path)], rows[path])
    # Opti keeps an expression or its distance to the limit
    moved = np.minimum(abs(slack[0] - slack[1]), abs(slack[0] - (slack[1] - limits)))
    assert moved.max() < 1e-11


def test_the_optimum_is_the_same(plain, problem, quasi_steady):
    """The plain programme is solved from the library's start, by CasADi's own derivatives."""
    settings = {"tolerance": 0.9, "optimality": 1e-8, "meshes": 1}
    begun = {**quasi_steady, **{q.name: 0.0 for q in problem.parameters}}
    ours = ocp.solve(problem, begun, MESH, compile_code=False, **settings)
    start = guessed(ours.pointwise, MESH, begun)
    found = plain.with_opti(problem, start, {"tol": 1e-8, "accept_after_max_steps": 6})
    assert found.status == "Solve_Succeeded"
    objective = found.objective * problem.objective_scale
    # two iterations of one programme that end within IPOPT's tolerance of its optimum
    assert objective == pytest.approx(ours.objective + ours.regularisation, rel=1e-8)
    # an optimum is flat: what moves the lap time by 1e-8 moves states by the root of it, at most
    assert found.iterate.states == pytest.approx(ours.iterate.states, abs=1e-4)


def test_a_problem_that_is_no_lap_is_refused(plain):
    line = ocp.Problem(
        "line",
        ocp.Independent("t", 0.0, 1.0),
        [ocp.State("x")],
        lambda at: ocp.Equations({"x": at.u}, integrands={"cost": at.u**2}),
        controls=[ocp.Control("u")],
        lagrange="cost",
        initial={"x": 0.0},
        terminal={"x": 1.0},
    )
    with pytest.raises(ValueError, match="'line' is no lap"):
        plain.Plain(line, ocp.Mesh.uniform(2, 3))
