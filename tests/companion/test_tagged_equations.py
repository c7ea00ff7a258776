r"""Equations keep the thesis's numbers where Sphinx's own wrapping would break the \tag."""

import pytest

from thesislib.companion.tagged_equations import numbered

MATRIX = r"y = \begin{bmatrix} a \\ b \end{bmatrix}"


def test_equation_of_one_line_is_left_to_sphinx() -> None:
    assert numbered(r"v = g t \tag{2.1}") is None


def test_lines_without_a_number_are_left_to_sphinx() -> None:
    assert numbered(MATRIX) is None


def test_number_of_a_matrix_equation_stands_outside_the_split() -> None:
    inside, outside = (numbered(MATRIX + r" \tag{4.17}") or "").split(r"\end{split}")
    assert inside == r"\begin{equation}\begin{split}" + MATRIX
    assert outside == r"\tag{4.17}\end{equation}"


def test_lines_with_a_number_each_are_aligned() -> None:
    lines = r"a &= b \tag{4.1} \\ c &= d \tag{4.2}"
    assert numbered(lines) == rf"\begin{{align}}{lines}\end{{align}}"


@pytest.mark.parametrize("name", ["align", "align*", "gather", "equation"])
def test_environment_of_its_own_is_not_wrapped(name: str) -> None:
    latex = rf"\begin{{{name}}} a \\ b \tag{{4.1}} \end{{{name}}}"
    assert numbered(f"\n{latex}\n") == latex
