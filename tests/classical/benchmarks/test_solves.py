"""From a statement to a problem of the library: nothing is added, above all no scale."""

import numpy as np
import pytest

from thesislib.classical.benchmarks.problems import STATEMENTS
from thesislib.classical.benchmarks.solves import guess_of, problem_of


@pytest.mark.parametrize("name", STATEMENTS)
def test_nothing_is_scaled_by_hand(name):
    problem = problem_of(STATEMENTS[name])
    quantities = (*problem.states, *problem.controls, *problem.parameters, *problem.path, *problem.boundary)
    assert all(quantity.scale is None for quantity in quantities)
    assert problem.objective_scale == 1


def test_linked_ends_are_periodic_where_nothing_is_gained_and_a_condition_where_something_is():
    problem = problem_of(STATEMENTS["dynamic soaring"])
    assert list(problem.periodic) == ["v", "gamma"]
    (turn,) = problem.boundary
    assert turn.bounds == (-2 * np.pi, -2 * np.pi)


def test_guess_runs_along_the_guessed_time_and_starts_a_free_end():
    guess = guess_of(STATEMENTS["Goddard"])
    np.testing.assert_allclose(guess["h"](np.array([0.0, 30.0, 60.0])), [0, 9000, 18000])
    assert guess["t_final"] == 60


def test_guess_of_a_fixed_end_names_no_time():
    guess = guess_of(STATEMENTS["free-flying robot"])
    assert "t_final" not in guess
    np.testing.assert_allclose(guess["theta"](np.array([0.0, 12.0])), [np.pi / 2, 0])


def test_maximum_is_the_minimum_of_the_negative():
    statement = STATEMENTS["re-entry"]
    assert statement.is_maximum and statement.end_cost == ("lat", -1.0)
    assert not STATEMENTS["dynamic soaring"].is_maximum
