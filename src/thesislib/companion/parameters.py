"""Parameters of a chapter: read from its text without executing it, and checked before a kernel starts.

One cell tagged ``parameters`` holds them, one line each::

    mass_kg: float = 660.0  # 400 .. 1200, vehicle mass with driver (Table C.1)
    track: str = "barcelona"  # {barcelona | barcelona_rough}, centre line to follow
    degree: int = 8  # {4 | 6 | 8}, degree of V
    rigid: bool = False  # whether the suspension is locked

that is ``name: type = value  # range or choices, description``.
"""

from __future__ import annotations

import ast
import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from thesislib.companion.chapters import Chapter, InputError

__all__ = ["Parameter", "Value", "changed_values", "parameters", "split_assignments"]

Value = float | int | str | bool

_TYPES: dict[str, type] = {"float": float, "int": int, "str": str, "bool": bool}
_NUMBER = r"[-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"(?P<low>{_NUMBER})\s*\.\.\s*(?P<high>{_NUMBER})\s*,\s*(?P<description>\S.*)")
_CHOICES = re.compile(r"\{(?P<choices>[^{}]*)\}\s*,\s*(?P<description>\S.*)")
_WORDS = {"true": True, "false": False}


@dataclass(frozen=True)
class Parameter:
    """One parameter of a chapter.

    Attributes
    ----------
    name, type, description : str
        As written in the parameters cell; the type is ``float``, ``int``, ``str`` or ``bool``.
    default : float, int, str or bool
        Value in the published run.
    low, high : float or None
        Range of a number, both ends allowed.
    choices : tuple of str or of int
        Choices of a text or of a whole number.
    """

    name: str
    type: str
    default: Value
    description: str
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] | tuple[int, ...] = ()

    @property
    def allowed(self) -> str:
        """What is allowed, in the notation of the parameters cell."""
        if self.choices:
            return "{" + " | ".join(map(str, self.choices)) + "}"
        return f"{self.low:g} .. {self.high:g}" if self.low is not None else "{true | false}"

    def checked(self, value: Value) -> Value:
        """Return a value of the parameter's type if it is allowed.

        Raises
        ------
        InputError
            If the value is not finite, outside the range or not among the choices.
        """
        if self.choices and value not in self.choices:
            near = difflib.get_close_matches(str(value), map(str, self.choices), n=1)
            hint = f"; did you mean {near[0]!r}?" if near and self.type == "str" else "."
            raise InputError(f"{self.name} = {value} is not one of {self.allowed} ({self.description}){hint}")
        if self.low is not None and self.high is not None and not isinstance(value, str):
            if not math.isfinite(value):
                raise InputError(f"{self.name} = {value} is not a finite number ({self.description}).")
            if not self.low <= value <= self.high:
                raise InputError(
                    f"{self.name} = {value:g} is outside {self.low:g} .. {self.high:g} ({self.description})."
                )
        return value

    def parsed(self, text: str) -> Value:
        """Return the value a text on the command line stands for.

        Raises
        ------
        InputError
            If the text is not of the parameter's type, or the value is not allowed.
        """
        kind = _TYPES[self.type]
        if kind is str:
            return self.checked(text)
        if kind is bool:
            if text.lower() not in _WORDS:
                raise InputError(f"{self.name} must be a bool (true or false), not {text!r}.")
            return _WORDS[text.lower()]
        try:
            return self.checked(kind(text))
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            article = "an int" if kind is int else "a float"
            raise InputError(f"{self.name} must be {article}, not {text!r} ({self.description}).") from error


def parameters(chapter: Chapter) -> tuple[Parameter, ...]:
    """Return the parameters of a chapter, in order.

    Raises
    ------
    InputError
        If the parameters cell is not written as the module's description says, a name stands twice,
        or a default is not allowed itself.
    """
    cells = [cell.source for cell in chapter.cells if "parameters" in cell.tags]
    if len(cells) > 1:
        raise InputError(f"{chapter.path.name} has {len(cells)} cells tagged 'parameters'; one is allowed.")
    found: dict[str, Parameter] = {}
    for source in cells:
        try:
            statements = ast.parse(source).body
        except SyntaxError as error:
            raise InputError(
                f"The parameters cell of {chapter.path.name} is not Python: {error.msg}, line {error.lineno}."
            ) from error
        lines = source.splitlines()
        for statement in statements:
            read = _parameter(statement, lines, chapter.path.name)
            if read.name in found:
                raise InputError(f"{chapter.path.name} has the parameter {read.name!r} twice.")
            found[read.name] = read
    return tuple(found.values())


def split_assignments(words: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Split the words of a command line into plain ones and ``name=value`` ones.

    Raises
    ------
    InputError
        If a name stands twice.
    """
    plain: list[str] = []
    assigned: dict[str, str] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals:
            plain.append(word)
        elif name in assigned:
            raise InputError(f"{name} is given twice: {assigned[name]!r} and {text!r}.")
        else:
            assigned[name] = text
    return plain, assigned


def changed_values(chapter: Chapter, texts: Mapping[str, str]) -> dict[str, Value]:
    """Return the values that a command line gives to parameters of a chapter.

    The whole parameters cell is checked as well, so that a chapter whose own defaults are not allowed
    is not run.

    Raises
    ------
    InputError
        If the chapter has no parameter of that name, or its value is of another type or not allowed.
    """
    known = {parameter.name: parameter for parameter in parameters(chapter)}
    values = {}
    for name, text in texts.items():
        if name not in known:
            spelt = {each.lower(): each for each in known}
            near = difflib.get_close_matches(name.lower(), spelt, n=1, cutoff=0.5)
            hint = f"did you mean {spelt[near[0]]!r}?" if near else f"it has {', '.join(known) or 'none'}."
            raise InputError(f"Chapter {chapter.id} has no parameter {name!r}; {hint}")
        values[name] = known[name].parsed(text)
    return values


def _parameter(statement: ast.stmt, lines: Sequence[str], file: str) -> Parameter:
    line = lines[statement.lineno - 1]
    place = f"The parameters cell of {file} has the line {line.strip()!r}"
    if (
        not isinstance(statement, ast.AnnAssign)
        or not isinstance(statement.target, ast.Name)
        or not isinstance(statement.annotation, ast.Name)
        or statement.annotation.id not in _TYPES
        or statement.value is None
        or statement.end_lineno != statement.lineno
    ):
        raise InputError(f"{place}, which is not 'name: type = value' with type float, int, str or bool.")
    name, kind = statement.target.id, statement.annotation.id
    try:
        default: Value = ast.literal_eval(statement.value)
    except ValueError as error:
        raise InputError(f"{place}, whose value is not a plain constant.") from error
    if kind == "float" and isinstance(default, int) and not isinstance(default, bool):
        default = float(default)
    if type(default) is not _TYPES[kind]:
        raise InputError(f"{place}, whose value is not of the type {kind}.")
    # columns of the syntax tree count bytes
    rest = line.encode("utf-8")[statement.end_col_offset :].decode("utf-8").strip()
    parameter = _described(name, kind, default, rest.removeprefix("#").strip(), place)
    try:
        parameter.checked(default)
    except InputError as error:
        raise InputError(f"The default of a parameter of {file} is not allowed: {error}") from error
    return parameter


def _described(name: str, kind: str, default: Value, comment: str, place: str) -> Parameter:
    """Build a parameter from what its comment says."""
    if kind == "bool":
        if not comment:
            raise InputError(f"{place}, whose comment does not describe it.")
        return Parameter(name, kind, default, comment)
    if kind == "str":
        found = _CHOICES.fullmatch(comment)
        choices = tuple(choice.strip() for choice in found["choices"].split("|")) if found else ()
        if found is None or not all(choices) or len(set(choices)) < len(choices):
            raise InputError(f"{place}, whose comment is not '{{choice | choice}}, description'.")
        return Parameter(name, kind, default, found["description"], choices=choices)
    listed = _CHOICES.fullmatch(comment) if kind == "int" else None
    if listed is not None:
        words = [word.strip() for word in listed["choices"].split("|")]
        if not all(re.fullmatch(r"[-+]?\d+", word) for word in words) or len(set(words)) < len(words):
            raise InputError(f"{place}, whose choices are not different whole numbers.")
        numbers = tuple(map(int, words))
        return Parameter(name, kind, default, listed["description"], choices=numbers)
    found = _RANGE.fullmatch(comment)
    if found is None:
        raise InputError(f"{place}, whose comment is not 'low .. high, description'.")
    low, high = float(found["low"]), float(found["high"])
    if not low < high:
        raise InputError(f"{place}, whose range is empty.")
    return Parameter(name, kind, default, found["description"], low, high)
