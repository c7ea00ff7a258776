"""A solve starts from the solution of a problem that has something less or more."""

import numpy as np
import pytest

from thesislib import ocp


def double_integrator(*, drag=None, boost=None, scale=1.0, unit="m"):
    """From rest to rest over one metre in one second with the least work; drag and boost are optional."""

    def equations(at):
        push = at.F + (at.boost if boost else 0.0)
        slow = at.drag * at.v if drag else 0.0
        return ocp.Equations({"x": at.v, "v": push - slow}, {}, {"work": at.F**2})

    controls = [ocp.Control("F", "N", (-20.0, 20.0), scale)]
    if boost:
        controls.append(ocp.Control("boost", "N", boost, 1.0))
    return ocp.Problem(
        name="double integrator",
        independent=ocp.Independent("t", 0.0, 1.0),
        states=[ocp.State("x", unit, (-5.0, 5.0), scale), ocp.State("v", "m/s", (-5.0, 5.0))],
        controls=controls,
        parameters=[ocp.Parameter("drag", "1/s", drag)] if drag else [],
        equations=equations,
        lagrange="work",
        initial={"x": 0.0, "v": 0.0},
        terminal={"x": 1.0, "v": 0.0},
    )


@pytest.fixture(scope="module")
def plain():
    return ocp.solve(double_integrator(), compile_code=False, tolerance=1e-8)


def test_a_problem_starts_from_the_solution_without_its_parameter(plain):
    bare = ocp.solve(
        double_integrator(drag=(0.0, 0.0)), ocp.Related(plain), compile_code=False, tolerance=1e-8
    )
    # the same programme but for a parameter that is held: nothing is left to iterate on
    assert bare.history[0].iterations <= 3
    assert bare.objective == pytest.approx(12.0, rel=1e-7)  # the work of the parabola of velocity
    free = ocp.solve(
        double_integrator(drag=(-1.0, 3.0)),
        ocp.Related(plain, {"drag": 1.0}),
        compile_code=False,
        tolerance=1e-8,
    )
    # a tail wind helps; the start says where to begin only
    again = ocp.solve(double_integrator(drag=(-1.0, 3.0)), {"drag": 0.5}, compile_code=False, tolerance=1e-8)
    assert free.objective < 12.0
    assert free.objective == pytest.approx(again.objective, rel=1e-7)
    assert free.parameter("drag") == pytest.approx(again.parameter("drag"), abs=1e-4)


def test_multipliers_arrive_in_the_scales_of_the_new_problem(plain):
    other = double_integrator(drag=(0.0, 0.0), scale=7.0)
    solution = ocp.solve(other, ocp.Related(plain), compile_code=False, tolerance=1e-8)
    assert solution.history[0].iterations <= 3
    assert np.allclose(solution.costate("x"), plain.costate("x"), rtol=1e-6)


def test_a_new_control_starts_where_the_values_say(plain):
    solution = ocp.solve(
        double_integrator(boost=(-1.0, 1.0)), ocp.Related(plain, {"boost": 0.0}), compile_code=False
    )
    # boost costs nothing and takes over as much as it may
    assert np.abs(solution["boost"]).max() == pytest.approx(1.0, abs=1e-6)
    assert solution.objective < 12.0 - 1.0


def test_what_is_less_is_left_out(plain):
    more = ocp.solve(double_integrator(drag=(0.0, 0.0)), compile_code=False, tolerance=1e-8)
    back = ocp.solve(double_integrator(), ocp.Related(more), compile_code=False, tolerance=1e-8)
    assert back.history[0].iterations <= 3


def test_other_ranges_and_units_are_refused(plain):
    with pytest.raises(ocp.ProblemError, match=r"x is in m there and in km here"):
        ocp.solve(double_integrator(unit="km"), ocp.Related(plain), compile_code=False)
    short = ocp.Problem(
        name="short",
        independent=ocp.Independent("t", 0.0, 0.5),
        states=plain.problem.states,
        controls=plain.problem.controls,
        equations=plain.problem.equations,
        lagrange="work",
    )
    with pytest.raises(ocp.ProblemError, match=r"cannot start 'short': it runs over"):
        ocp.solve(short, ocp.Related(plain), compile_code=False)
    with pytest.raises(ocp.ProblemError, match=r"the guess names 'thrust'"):
        ocp.solve(double_integrator(), ocp.Related(plain, {"thrust": 1.0}), compile_code=False)
