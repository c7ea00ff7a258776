import casadi as ca
import numpy as np
import pytest

from thesislib import ocp
from thesislib.ocp import Control, Equations, Independent, Problem, ProblemError, State
from thesislib.ocp.endpoints import Endpoints
from thesislib.ocp.pointwise import Pointwise


def statement(**changes):
    """A well-posed statement, changed."""
    return Problem(
        **{
            "name": "car",
            "independent": Independent("t", 0.0, 1.0),
            "states": [State("x", "m", (-2, 2)), State("v", "m/s")],
            "controls": [Control("u")],
            "equations": lambda point: Equations(
                {"x": point.v, "v": point.u}, integrands={"effort": point.u**2}
            ),
            "lagrange": "effort",
            **changes,
        }
    )


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"states": []}, "'car' has no state"),
        ({"controls": [Control("x")]}, "name 'x' is used twice in problem 'car'"),
        ({"constants": {"t": 1.0}}, "name 't' is used twice"),
        ({"data": {"u": np.cos}}, "name 'u' is used twice"),
        ({"initial": {"y": 0}}, "no state is named 'y'; known: x, v"),
        ({"terminal": {"vv": 0}}, r"no state is named 'vv'; did you mean 'v'\?"),
        ({"periodic": ["u"]}, "no state is named 'u'"),
        ({"initial": {"x": 3}}, "initial x = 3 is outside its bounds -2 .. 2"),
        ({"terminal": {"x": (-3, 0)}}, r"terminal x = \(-3, 0\) is outside its bounds"),
        (
            {"independent": Independent("t", 0.0, (1.0, 2.0)), "data": {"wind": np.cos}},
            "reads the data wind along a range whose end is free",
        ),
    ],
)
def test_contradiction_in_a_statement_is_refused_at_once(changes, reason):
    with pytest.raises(ProblemError, match=reason):
        statement(**changes)


def test_problem_without_objective_is_refused_before_it_is_solved():
    with pytest.raises(ProblemError, match="'car' has no objective: give lagrange or mayer"):
        ocp.solve(statement(lagrange=None, equations=lambda point: Equations({"x": point.v, "v": point.u})))


@pytest.mark.parametrize(
    ("bounds", "scale", "reason"),
    [
        ((2, 1), None, r"bounds 2 \.\. 1 of x are not an interval"),
        ((np.nan, 1), None, "of x are not an interval"),
        ((0, 1), 0.0, "scale 0 of x must be positive"),
        ((0, 1), -1.0, "scale -1 of x must be positive"),
        ((0, 1), np.inf, "scale inf of x must be positive and finite"),
    ],
)
def test_quantity_without_sense_is_refused(bounds, scale, reason):
    with pytest.raises(ProblemError, match=reason):
        State("x", "m", bounds, scale)


@pytest.mark.parametrize(
    ("equations", "reason"),
    [
        (Equations({"x": 1}, integrands={"effort": 1}), "give no derivative of state 'v'"),
        (Equations({"x": 1, "v": 1}), "give no integrand 'effort'"),
        (
            Equations({"x": 1, "v": 1, "w": 1}, integrands={"effort": 1}),
            "no derivative of state is named 'w'",
        ),
        (
            Equations({"x": 1, "v": 1}, {"powr": 1}, {"effort": 1}),
            "no path expression is named 'powr'; known: none",
        ),
    ],
)
def test_equations_must_give_what_the_statement_names_and_no_more(equations, reason):
    with pytest.raises(ProblemError, match=reason):
        Pointwise(statement(equations=lambda point: equations), compile_code=False)


def test_equations_that_read_an_unknown_name_are_told_the_nearest():
    def equations(point):
        return Equations({"x": point.velocity, "v": point.u}, integrands={"effort": point.u})

    problem = statement(equations=equations, constants={"velocty": 1.0})
    with pytest.raises(ProblemError, match="no quantity is named 'velocity'; did you mean 'velocty'"):
        Pointwise(problem, compile_code=False)


def test_boundary_equations_must_give_the_boundary_conditions():
    problem = statement(
        boundary=[ocp.Boundary("closed")], boundary_equations=lambda ends: {"close": ends.final.x}
    )
    with pytest.raises(ProblemError, match=r"boundary_equations of 'car' give \['close'\], not \['closed'\]"):
        Endpoints(Pointwise(problem, compile_code=False))


def test_scale_is_the_larger_bound_unless_given():
    assert State("x", bounds=(-3, 2)).size == 3
    assert State("x", bounds=(-np.inf, 2)).size == 2
    assert State("x").size == 1
    assert State("x", bounds=(0, 0)).size == 1
    assert State("x", bounds=(-3, 2), scale=0.5).size == 0.5


def test_free_end_is_the_last_parameter():
    problem = statement(independent=Independent("s", 0.0, (1.0, 2.0)), parameters=[ocp.Parameter("mass")])
    assert [parameter.name for parameter in problem.all_parameters] == ["mass", "s_final"]


def test_equations_are_scaled_by_range_and_sizes():
    problem = statement(
        independent=Independent("t", 1.0, 5.0), states=[State("x", "m", (-2, 2)), State("v", scale=10.0)]
    )
    pointwise = Pointwise(problem, compile_code=False)
    outputs = pointwise.evaluate(np.array([[0.3], [0.7], [2.0]]), np.empty(0), np.array([0.5]))
    # range 4; integrand u^2 = 4, x' = v = 7 in units of 2, v' = u = 2 in units of 10
    np.testing.assert_allclose(outputs.ravel(), [4 * 4, 4 * 7 / 2, 4 * 2 / 10])


def test_physics_written_once_serves_numbers_and_symbols():
    seen = []

    def equations(point):
        seen.append(type(point.v))
        return Equations({"x": point.v, "v": point.u}, integrands={"effort": point.u**2})

    Pointwise(statement(equations=equations), compile_code=False)
    assert seen == [ca.SX]
