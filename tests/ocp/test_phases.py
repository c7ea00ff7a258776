"""Problems of several phases against answers that do not come from this package."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib import ocp
from thesislib.classical.goddard import ALTITUDE, GUESS_OF_PHASES, rocket_in_phases
from thesislib.ocp import Equations, Independent, Link, Mesh, Phases, Problem, ProblemError, State, continuous


@pytest.fixture(scope="module")
def flown() -> ocp.PhasedSolution:
    return ocp.solve(
        rocket_in_phases(), GUESS_OF_PHASES, Mesh.uniform(4, 6), tolerance=1e-8, optimality=1e-10
    )


def test_rocket_with_a_singular_arc_rises_as_high_as_published(flown):
    # eleven digits: with the switches at ends of phases every phase is smooth
    assert -flown.objective == pytest.approx(ALTITUDE, rel=2e-11)
    assert flown.converged and flown.error < 1e-8


def test_costates_go_on_where_phases_are_linked(flown):
    # in the coast the mass lies on its bound all along, and the bound shares its price as it likes
    for before, after, states in (("boost", "arc", "hvm"), ("arc", "coast", "hv")):
        for state in states:
            last = flown[before].costate_at_ends(state)[1]
            first = flown[after].costate_at_ends(state)[0]
            # at the first point of an interval a Radau method's costate is an order less accurate
            assert first == pytest.approx(last, rel=2e-5, abs=1e-9)
            # the multiplier of the link is the costate there
            name = f"{state} from {before} to {after}"
            assert abs(flown.link_multiplier(name)) == pytest.approx(abs(last), rel=1e-5, abs=1e-9)


def test_states_and_time_do_not_jump_between_phases(flown):
    for before, after in (("boost", "arc"), ("arc", "coast")):
        assert flown[before].nodes[-1] == pytest.approx(flown[after].nodes[0], abs=1e-12)
        for state in flown.phases[0].problem.states:
            jump = flown[before].at_nodes(state.name)[-1] - flown[after].at_nodes(state.name)[0]
            assert abs(jump) < 1e-12 * state.size


def test_hamiltonian_is_the_same_in_all_phases_and_zero_for_a_free_end(flown):
    # nothing depends on time and the end is free: H = 0, against the weight of its largest term
    for part in flown.phases:
        first, last = ocp.transversality.hamiltonian_at_ends(part)
        size = np.abs(part.costate("h") * part["v"]).max()
        assert abs(first) < 1e-6 * size and abs(last) < 1e-6 * size


def test_phases_follow_their_equations_when_integrated_again(flown):
    for part in flown.phases:
        assert part.simulate().largest("h") < 1e-4


def test_values_of_all_phases_come_in_order(flown):
    places, heights = flown.along("h")
    assert np.all(np.diff(places) >= 0) and heights[-1] == pytest.approx(ALTITUDE, rel=1e-9)
    assert len(heights) == sum(part.mesh.points + 1 for part in flown.phases)


def test_solution_of_phases_starts_another_one(flown):
    again = ocp.solve(rocket_in_phases(), flown, tolerance=1e-8, optimality=1e-10)
    assert again.history[0].iterations < 0.7 * flown.history[0].iterations
    assert again.objective == pytest.approx(flown.objective, rel=1e-12)


def test_solution_of_phases_is_kept_and_read_back(flown, tmp_path):
    path = ocp.storage.save(flown, tmp_path / "rocket")
    back = ocp.storage.load(rocket_in_phases(), path)
    assert back.summary() == flown.summary() and back.stopped == flown.stopped
    np.testing.assert_allclose(back.links, flown.links, rtol=1e-14)
    np.testing.assert_array_equal(back["arc"]["v"], flown["arc"]["v"])
    with pytest.raises(ProblemError, match="3 phases; 'boost' has 1"):
        ocp.storage.load(rocket_in_phases().phases[0], path)


def sprint(force: float = 2.0, weight: float = 1.0) -> Phases:
    """Speed up in one phase and slow down in the next, 1 m in the least time plus effort."""

    def half(name, start, end, **changes):
        return Problem(
            name,
            Independent("t", start, end),
            [State("x", "m", (-1, 2)), State("v", "m/s", (-3, 3))],
            lambda at: Equations({"x": at.v, "v": at.force * at.u}, {}, {"effort": at.weight * at.u**2}),
            controls=[ocp.Control("u", "-", (-5, 5), rate_weight=1e-4)],
            lagrange="effort",
            constants={"force": force, "weight": weight},
            **changes,
        )

    go = half("go", 0.0, (0.2, 2.0), initial={"x": 0.0, "v": 0.0})
    stop = half("stop", (0.2, 2.0), (0.5, 4.0), terminal={"x": 1.0, "v": 0.0})
    return Phases(
        "sprint", [go, stop],
        [*continuous(go, stop), Link("half way", "m", (0.4, 0.4), expression=lambda at: at.go.final.x)],
        cost=lambda at: at.stop.final.t + 0.1 * at.go.final.force * at.go.final.v,
    )  # fmt: skip


TIGHT = {"tolerance": 0.5, "optimality": 1e-11}


@pytest.fixture(scope="module")
def sprinted() -> ocp.PhasedSolution:
    return ocp.solve(sprint(), mesh=Mesh.uniform(3, 5), **TIGHT)


@pytest.mark.parametrize("name", ["force", "weight"])
def test_sensitivities_through_phases_agree_with_central_differences(sprinted, name):
    value, step = {"force": 2.0, "weight": 1.0}[name], 1e-4
    up, down = (ocp.solve(sprint(**{name: value + sign * step}), sprinted, **TIGHT) for sign in (1, -1))
    found = ocp.sensitivity.derivative(sprinted, name)
    total = (up.objective + up.regularisation - down.objective - down.regularisation) / (2 * step)
    assert ocp.sensitivity.sensitivity(sprinted)[name] == pytest.approx(total, rel=1e-6)
    assert found.objective + found.regularisation == pytest.approx(total, rel=1e-6)
    for phase in ("go", "stop"):
        for quantity in ("x", "v", "u", "t_final"):
            expected = (up[phase][quantity] - down[phase][quantity]) / (2 * step)
            np.testing.assert_allclose(found.of(phase)[quantity], expected, atol=1e-5, err_msg=quantity)


def test_constant_of_all_phases_is_changed_in_all_of_them():
    changed = sprint().with_constants(force=3.0)
    assert [phase.constants["force"] for phase in changed.phases] == [3.0, 3.0]
    with pytest.raises(ProblemError, match="no constant is named 'farce'; did you mean 'force'"):
        sprint().with_constants(farce=1.0)


def test_switches_of_a_ceiling_are_found_where_the_calculus_puts_them(bryson_denham):
    ceiling = 1 / 9
    plain = replace(
        bryson_denham(), path=(), states=[State("x", "m", (-1, ceiling)), State("v", "m/s", (-10, 10))],
        equations=lambda at: Equations({"x": at.v, "v": at.u}, integrands={"effort": 0.5 * at.u**2}),
        constants={},
    )  # fmt: skip
    touch = {"x": ceiling, "v": 0.0}
    problem = ocp.divided(plain, [0.3, 0.7], [{}, {"initial": touch, "terminal": touch}, {}])
    solution = ocp.solve(problem, mesh=Mesh.uniform(1, 4), tolerance=1e-8, optimality=1e-11)
    # the answer is a cubic, a constant and a cubic: twelve points carry it to rounding
    assert solution.objective == pytest.approx(4, abs=1e-9)
    # the cost is flat in the switches, so that they are found to the square root of its accuracy
    np.testing.assert_allclose(
        [solution["arc 1"].parameter("t_final"), solution["arc 2"].parameter("t_final")],
        [1 / 3, 2 / 3],
        atol=2e-6,
    )


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: Phases("trip", []), "'trip' has no phase"),
        (lambda: Phases("trip", [sprint().phases[0]] * 2), "two phases of 'trip' are named 'go'"),
        (
            lambda: Phases("trip", [replace(sprint().phases[0], lagrange=None)]),
            "'trip' has no objective: give cost, or lagrange or mayer of a phase",
        ),
        (
            lambda: Phases("trip", [sprint().phases[0], replace(sprint().phases[1], objective_scale=2.0)]),
            "have objective scales 1 and 2",
        ),
        (
            lambda: Phases("trip", [sprint().phases[0], sprint(force=3.0).phases[1]]),
            "constant force of 'trip' is 2 and, in phase 'stop', 3",
        ),
        (lambda: Link("jump", "m"), "link 'jump' has no expression"),
        (
            lambda: continuous(*sprint().phases, names=["y"]),
            "phase 'go': no state or parameter is named 'y'",
        ),
        (
            lambda: continuous(
                sprint().phases[0],
                replace(sprint().phases[1], states=[State("x", "km"), State("v", "m/s")]),
            ),
            "x is in m in phase 'go' and in km in phase 'stop'; link them by an expression that converts",
        ),
        (lambda: ocp.divided(sprint().phases[0], [1.5]), "switches 1.5 do not increase between 0 and 1.1 s"),
        (lambda: ocp.divided(sprint().phases[0], [0.5], [{}]), "1 switches make 2 arcs, not 1"),
        (
            lambda: ocp.divided(replace(sprint().phases[0], periodic=["v"], initial={}), [0.5]),
            "'go' has periodic states and cannot be divided",
        ),
    ],
)  # fmt: skip
def test_contradictions_between_phases_are_refused_at_once(make, reason):
    with pytest.raises(ProblemError, match=reason):
        make()


def test_guess_and_mesh_of_an_unknown_phase_are_refused():
    with pytest.raises(ProblemError, match="the guess: no phase is named 'stopp'; did you mean 'stop'"):
        ocp.solve(sprint(), {"stopp": {"u": 0.0}})
    with pytest.raises(ProblemError, match="no phase is named 'og'"):
        ocp.solve(sprint(), mesh={"og": Mesh.uniform(2, 3)})


def test_solution_is_asked_for_phases_and_links_that_it_has(sprinted):
    with pytest.raises(ProblemError, match="no phase is named 'halt'"):
        sprinted["halt"]
    with pytest.raises(ProblemError, match="no link is named 'half-way'; did you mean 'half way'"):
        sprinted.link_multiplier("half-way")
    with pytest.raises(ProblemError, match="no phase is named 'halt'"):
        ocp.sensitivity.derivative(sprinted, "force").of("halt")


def test_link_that_cannot_hold_is_named_in_the_failure():
    problem = sprint()
    far = Link("too far", "m", (5.0, 5.0), expression=lambda at: at.go.final.x)
    with pytest.raises(ocp.SolveError) as caught:
        ocp.solve(replace(problem, links=[*problem.links, far]), iterations=60)
    named = [row.equation for row in caught.value.residuals[:3]]
    assert any("too far" in name or "half way" in name or "x" in name for name in named)
    assert "5 m" in caught.value.report() or "below 5 m" in caught.value.report()


def test_first_order_system_of_all_phases_is_met(sprinted):
    rows = ocp.kkt.FirstOrder(sprinted).stationarity()
    assert {row.quantity for row in rows} == {
        f"{phase}: {name}"
        for phase, names in (
            ("go", ["x", "v", "u", "t_final"]),
            ("stop", ["x", "v", "u", "t_initial", "t_final"]),
        )
        for name in names
    }
    assert max(row.scaled for row in rows) < 1e-8
