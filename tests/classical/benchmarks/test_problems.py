"""The statements: one text, many mathematics; guesses that respect their bounds; a file that stands alone."""

import ast
import math
import sys
from inspect import getfile
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from thesislib.classical.benchmarks import problems
from thesislib.classical.benchmarks.problems import STATEMENTS


def point(statement, fraction):
    variables = (*statement.states, *statement.controls, *statement.parameters)
    return {"t": 3.0, **{v.name: v.guess_at(fraction) + 0.01 for v in variables}}


@pytest.mark.parametrize("name", STATEMENTS)
def test_casadi_and_python_see_the_same_equations(name):
    statement = STATEMENTS[name]
    values = point(statement, 0.4)
    symbols = {key: ca.SX.sym(key) for key in values}
    plain = statement.equations(math, SimpleNamespace(**values))
    rates = statement.equations(ca, SimpleNamespace(**symbols))
    for ours, theirs in ((plain.derivatives, rates.derivatives), (plain.path, rates.path)):
        assert list(ours) == list(theirs)
        function = ca.Function("f", list(symbols.values()), [ca.vertcat(*theirs.values())])
        found = np.array(function(*values.values())).ravel()
        # the same operations in the same order, up to the last digits of sin and exp
        np.testing.assert_allclose(found, list(ours.values()), rtol=1e-12)


@pytest.mark.parametrize("name", STATEMENTS)
def test_guess_and_end_values_are_within_the_bounds(name):
    statement = STATEMENTS[name]
    for variable in (*statement.states, *statement.controls, *statement.parameters):
        low, high = variable.bounds
        values = [variable.guess_at(fraction) for fraction in np.linspace(0, 1, 11)]
        values += [value for value in (variable.initial, variable.terminal) if value is not None]
        # the heading of the glider ends where a rounded 1 + 2 pi leads
        assert all(low - 1e-12 <= value <= high + 1e-12 for value in values), variable.name
    if isinstance(statement.final, tuple):
        assert statement.final[0] < statement.final_guess < statement.final[1]


@pytest.mark.parametrize("name", STATEMENTS)
def test_every_state_has_a_derivative_and_the_objective_is_stated_once(name):
    statement = STATEMENTS[name]
    rates = statement.equations(math, SimpleNamespace(**point(statement, 0.4)))
    assert list(rates.derivatives) == [v.name for v in statement.states]
    assert list(rates.path) == [v.name for v in statement.path]
    assert (rates.cost is None) == (statement.end_cost is not None)


def test_statements_import_the_standard_library_only():
    # packages in environments of their own read the file without this library
    tree = ast.parse(Path(getfile(problems)).read_text(encoding="utf-8"))
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    imported |= {
        alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names
    }
    assert {name.partition(".")[0] for name in imported if name} <= sys.stdlib_module_names


def test_optimum_of_bryson_and_denham_is_that_of_the_calculus():
    # J = 4/(9 l) for a ceiling l of at most 1/6
    ceiling = STATEMENTS["Bryson-Denham"].states[0].bounds[1]
    assert STATEMENTS["Bryson-Denham"].published == pytest.approx(4 / (9 * ceiling), rel=1e-15)


def test_optimum_of_the_hypersensitive_problem_is_that_of_its_end_layers():
    # far ends: cost to go from 1.5 plus cost to come to 1, V' = sqrt(x^6 + x^2) -+ x^3
    slope = np.polynomial.legendre.leggauss(60)
    nodes, weights = 0.5 * (1 + slope[0]), 0.5 * slope[1]

    def integral(f, end):
        return float(end * weights @ f(end * nodes))

    to_go = integral(lambda x: -(x**3) + np.sqrt(x**6 + x**2), 1.5)
    to_come = integral(lambda x: x**3 + np.sqrt(x**6 + x**2), 1.0)
    assert to_go + to_come == pytest.approx(STATEMENTS["hypersensitive"].published, rel=1e-9)
