"""Parameter sets as tables of a page, as the thesis's appendices print them."""

from __future__ import annotations

from dataclasses import dataclass

from thesislib.vehicles.parameters import Parameter, ParameterSet


@dataclass(frozen=True)
class ParameterTable:
    """A parameter set that shows itself as a table: symbol, description, value, range, and remarks.

    Attributes
    ----------
    parameters : ParameterSet
        What to show, in its order.
    source : str or tuple of str
        Only the parameters whose source begins with this text or one of these, for example ``"Table C.1"``;
        all if empty.
    """

    parameters: ParameterSet
    source: str | tuple[str, ...] = ""

    @property
    def rows(self) -> tuple[Parameter, ...]:
        """The parameters shown."""
        return tuple(one for one in self.parameters.parameters if one.source.startswith(self.source))

    @property
    def columns(self) -> dict[str, tuple[list[str] | list[float], str]]:
        """The table as columns of a record: name, value and unit, the unit being that of the source."""
        return {
            "name": ([one.name for one in self.rows], ""),
            "value": ([one.quoted(one.value) for one in self.rows], ""),
            "unit": ([_unit(one).strip() for one in self.rows], ""),
        }

    def _repr_markdown_(self) -> str:
        lines = [("symbol", "description", "value", "range here"), ("---",) * 4]
        remarks: list[str] = []
        for one in self.rows:
            mark = ""
            if one.printed or one.note:
                printed = f"printed {one.printed}. " if one.printed else ""
                remarks.append(f"{len(remarks) + 1}. ${one.symbol}$: {printed}{one.note}")
                mark = f" ({len(remarks)})"
            unit = _unit(one)
            value, low, high = (f"{one.quoted(number):.6g}" for number in (one.value, one.low, one.high))
            lines.append(
                (f"${one.symbol}$", one.description, f"{value}{unit}{mark}", f"{low}\u00a0…\u00a0{high}")
            )
        table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        return "\n\n".join([table, "\n".join(remarks)] if remarks else [table])


def _unit(parameter: Parameter) -> str:
    if parameter.quoted_unit == "1":
        return ""
    return "°" if parameter.quoted_unit == "deg" else f" {parameter.quoted_unit}"
