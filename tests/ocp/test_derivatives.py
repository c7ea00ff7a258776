"""The hand-assembled derivatives against CasADi's own, on a problem with every feature."""

import casadi as ca
import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.pointwise import Pointwise
from thesislib.ocp.programme import Programme
from thesislib.ocp.quadrature import FLIPPED_RADAU, RADAU
from thesislib.ocp.system import System
from thesislib.ocp.transcription import Transcription

MESH = ocp.Mesh(np.array([0.0, 0.2, 0.55, 1.0]), np.array([3, 1, 4]))

# Both sides are exact; they differ by the order of a few hundred roundings.
ROUNDING = 1e-12


def transcribed(
    problem: ocp.Problem, compile_code: bool, mesh: ocp.Mesh = MESH
) -> tuple[Transcription, Programme]:
    pointwise = Pointwise(problem, compile_code)
    transcription = Transcription(pointwise, Endpoints(pointwise), mesh)
    return transcription, transcription.programme()


def differ(a: ca.DM, b: ca.DM) -> float:
    return float(np.abs(np.array(ca.DM(a)) - np.array(ca.DM(b))).max())


def assert_derivatives_are_those_of_automatic_differentiation(
    programme: Programme, plain: Programme, parameters: np.ndarray
) -> None:
    """Compare a programme's derivatives with CasADi's of the expressions of another one."""
    x, p, f, g = (plain.nlp[name] for name in ("x", "p", "f", "g"))
    sigma, multipliers = ca.MX.sym("sigma"), ca.MX.sym("lam", g.numel())
    lagrangian = sigma * f + ca.dot(multipliers, g)
    gradient = ca.Function("gradient", [x, p], [f, ca.gradient(f, x)])
    jacobian = ca.Function("jacobian", [x, p], [g, ca.jacobian(g, x)])
    hessian = ca.Function("hessian", [x, p, sigma, multipliers], [ca.triu(ca.hessian(lagrangian, x)[0])])

    random = np.random.default_rng(7)
    for _ in range(3):
        values = random.uniform(0.2, 1.0, x.numel())
        weights = random.normal(size=g.numel())
        for name, own in (("grad_f", gradient), ("jac_g", jacobian)):
            for got, expected in zip(
                programme.derivatives[name](values, parameters), own(values, parameters), strict=True
            ):
                assert differ(got, expected.T if got.shape != expected.shape else expected) < ROUNDING
        got = programme.derivatives["hess_lag"](values, parameters, 0.7, weights)
        assert differ(got, hessian(values, parameters, 0.7, weights)) < 10 * ROUNDING


@pytest.mark.parametrize("rule", [RADAU, FLIPPED_RADAU], ids=["Radau", "flipped Radau"])
@pytest.mark.parametrize("free_end", [False, True], ids=["fixed end, data", "free end"])
@pytest.mark.parametrize("compile_code", [False, True], ids=["virtual machine", "compiled"])
def test_assembled_derivatives_are_those_of_automatic_differentiation(
    everything, free_end, compile_code, rule
):
    problem = everything(free_end)
    mesh = ocp.Mesh(MESH.boundaries, MESH.orders, rule)
    transcription, programme = transcribed(problem, compile_code, mesh)
    _, plain = transcribed(problem, False, mesh)
    parameters = transcription.parameter_vector(np.full(2, 0.9))
    assert_derivatives_are_those_of_automatic_differentiation(programme, plain, parameters)


@pytest.mark.parametrize("form", ["differential", "integral"])
def test_derivatives_of_joined_phases_are_those_of_automatic_differentiation(everything, form):
    first = ocp.Problem(**{**vars(everything(True)), "name": "first"})
    # both ends are free and may cross: a condition keeps them in order
    later = ocp.Independent("t", (0.5, 3.0), (1.0, 6.0), scale=0.5)
    second = ocp.Problem(**{**vars(everything(True)), "name": "second", "independent": later})
    problem = ocp.Phases(
        "both",
        [first, second],
        [
            *ocp.continuous(first, second),
            ocp.Link(
                "product",
                "m²",
                (0, 1),
                0.5,
                lambda at: at.first.final.x * at.second.final.v * at.first.final.drag,
            ),
        ],
        cost=lambda at: at.first.initial.v * at.second.final.x**2 * at.second.final.t,
    )
    meshes = [MESH, ocp.Mesh.uniform(2, 3, FLIPPED_RADAU)]
    collocated = System.of(problem, False).collocated(meshes, form)
    plain = System.of(problem, False).collocated(meshes, form)
    iterates = System.of(problem, False).started({}, {"first": meshes[0], "second": meshes[1]})
    assert_derivatives_are_those_of_automatic_differentiation(
        collocated.programme, plain.programme, collocated.parameters(iterates)
    )
    x = collocated.pack(iterates)[0]
    multipliers = np.random.default_rng(2).normal(size=len(collocated.programme.rows_lower))
    back = collocated.pack(collocated.unpack(x, np.zeros_like(x), multipliers))
    np.testing.assert_allclose(back[0], x, atol=1e-13)
    np.testing.assert_allclose(back[2], multipliers, atol=1e-11)


def test_hessian_is_upper_triangular(everything):
    _, programme = transcribed(everything(), False)
    assert programme.derivatives["hess_lag"].sparsity_out(0).is_triu()


def test_jacobian_of_an_integral_constraint_has_no_row_as_long_as_the_mesh(everything):
    transcription, programme = transcribed(everything(), False)
    rows = np.array(programme.derivatives["jac_g"].sparsity_out(1).get_triplet()[0])
    entries = np.bincount(rows, minlength=transcription.rows)
    unknowns = len(everything().states) + len(everything().controls)
    for row, interval in zip(transcription.sum_rows[0], range(MESH.intervals), strict=True):
        assert entries[row] <= MESH.orders[interval] * unknowns + 3


def test_compiled_point_functions_equal_the_virtual_machine(everything):
    problem = everything()
    plain, compiled = Pointwise(problem, False), Pointwise(problem, True)
    assert compiled.compiled and not plain.compiled
    random = np.random.default_rng(3)
    fractions = random.uniform(size=50)
    parameters = np.array([0.6])
    arguments = plain.arguments(random.uniform(0.2, 1.0, (4, 50)), parameters, fractions)
    weights = random.normal(size=(plain.layout.outputs, 50))
    for name, extra in (("values", []), ("jacobian", []), ("hessian", [weights]), ("gradients", [weights])):
        ours = getattr(compiled, name).map(50)(*arguments, *extra)
        theirs = getattr(plain, name).map(50)(*arguments, *extra)
        assert differ(ours, theirs) < 1e-12, name


def test_regulariser_of_a_linear_control_is_its_slope_squared(everything):
    transcription, _ = transcribed(everything(), False)
    x = np.zeros(transcription.variables)
    x[transcription.point_index[2]] = 0.4 * MESH.collocation
    # eps/2 (du/ds)^2 over the collocated range, s in units of 0.5 of a range of 2: four units long
    collocated = MESH.collocation[-1] * 4
    assert 0.5 * x @ (transcription.penalty @ x) == pytest.approx(0.5 * 3e-3 * 0.1**2 * collocated, rel=1e-12)


def test_rate_of_a_fully_periodic_problem_wraps_around(following):
    problem = ocp.Problem(
        **{
            **vars(following()),
            "controls": [ocp.Control("u", rate_weight=1.0)],
        }
    )
    pointwise = Pointwise(problem, False)
    transcription = Transcription(pointwise, Endpoints(pointwise), MESH)
    first, last = transcription.point_index[1, 0], transcription.point_index[1, -1]
    assert transcription.penalty[first, last] == pytest.approx(-1 / (1 - MESH.collocation[-1]))


def test_point_functions_give_the_derivatives_by_constants_and_data(everything):
    problem = everything()
    pointwise = Pointwise(problem, False)
    random = np.random.default_rng(5)
    z, weights = random.uniform(0.2, 1.0, (4, 1)), random.normal(size=(pointwise.layout.outputs, 1))
    arguments = pointwise.arguments(z, np.array([0.6]), np.array([0.3]))
    got = np.array(pointwise.gradients(*arguments, weights)).ravel()
    step = 1e-6
    for position, block in ((0, 2), (1, 2), (2, 3)):
        moved = []
        for sign in (1, -1):
            changed = [np.array(argument, dtype=float) for argument in arguments]
            changed[block][position if block == 2 else 0] += sign * step
            moved.append(float(weights.ravel() @ np.array(pointwise.values(*changed)).ravel()))
        # central differences with this step are good to 1e-10 of values of order one
        assert got[position] == pytest.approx((moved[0] - moved[1]) / (2 * step), abs=1e-8)
