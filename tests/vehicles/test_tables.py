"""Claims about parameter sets shown as tables of a page."""

import pytest

from thesislib.vehicles import ParameterSet
from thesislib.vehicles.tables import ParameterTable


def shown(table):
    return table._repr_markdown_().replace("\u00a0", " ").splitlines()


def test_every_parameter_has_a_row_in_the_unit_of_the_source():
    lines = shown(ParameterTable(ParameterSet.from_file("racing_tyre", "tyres")))
    assert lines[0] == "| symbol | description | value | range here |"
    assert len(lines) == 2 + 12
    assert r"| $\alpha_1$ | Slip angle for the friction peak at load 1 | 9° | 3 … 20 |" in lines
    assert r"| $\mu_{x1}$ | Peak longitudinal friction coefficient at load 1 | 1.75 | 0.5 … 2.5 |" in lines


def test_changed_value_is_shown_as_changed():
    lines = shown(ParameterTable(ParameterSet.from_file("racing_car").replace(P_max=571.2e3), "Table C.1"))
    assert "| $P_{max}$ | Peak engine power | 571.2 kW | 300 … 800 |" in lines


def test_misprint_is_quoted_beside_the_table():
    text = "\n".join(shown(ParameterTable(ParameterSet.from_file("hybrid_car"))))
    assert "| 210 V (3) | 50 … 800 |" in text
    assert "3. $V_{OC}^{min}$: printed 240 V. Minimum and maximum are exchanged" in text


def test_source_selects_the_rows():
    car = ParameterSet.from_file("racing_car")
    beside = ParameterTable(car, ("Section", "standard gravity")).rows
    assert [one.name for one in beside] == ["air_density", "gravity", "h_f_nominal", "h_r_nominal"]
    assert not {one.name for one in ParameterTable(car, "Table C.1").rows} & {one.name for one in beside}


def test_columns_of_a_record_hold_what_the_page_shows():
    table = ParameterTable(ParameterSet.from_file("racing_tyre", "tyres").replace(Q_x=1.7))
    columns = {name: values for name, (values, _) in table.columns.items()}
    rows = dict(zip(columns["name"], zip(columns["value"], columns["unit"], strict=True), strict=True))
    assert rows["Q_x"] == (1.7, "")
    assert rows["F_z2"] == (6000.0, "N")
    assert rows["alpha_1"] == (pytest.approx(9.0), "°")
