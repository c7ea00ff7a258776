"""The picture of the optimal set-ups shows each parameter as a share of its bound, at its own row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from thesislib.lap import figures_offsets, style
from thesislib.lap.adjustments import ADJUSTMENTS
from thesislib.lap.figures_offsets import Offset

FRONT = Offset("ride height", "front", "mm", 10.0, {"D": 6.0, "N": 9.6}, {"D": 6.6, "N": 10.0})
REAR = Offset("ride height", "rear", "mm", 30.0, {"D": 12.4, "N": 1.6}, {"D": 12.0, "N": 1.7})
BALANCE = Offset("balance", "", "", 1.0, {"M": 0.1926, "N": 0.2554}, {"M": 0.1955, "N": 0.2478})


def test_offsets_are_drawn_as_shares_of_their_bounds_one_panel_for_both_axles(marks):
    height, balance = figures_offsets.optimal_offsets([FRONT, REAR, BALANCE]).axes
    assert height.get_title() == "ride height\n±10, ±30 mm"
    assert balance.get_title() == "balance\n±1"
    assert [label.get_text() for label in height.get_xticklabels()] == ["D", "N"]
    hollow = {"markerfacecolor": "none", "linestyle": "None"}
    shares = {
        axle: [share for _, share in marks(height, color=colour, **hollow)]
        for axle, colour in (("front", style.FRONT), ("rear", style.REAR))
    }
    np.testing.assert_allclose(shares["front"], [0.6, 0.96])
    np.testing.assert_allclose(shares["rear"], [12.4 / 30.0, 1.6 / 30.0])
    ours = [share for _, share in marks(height, color=style.FRONT, markerfacecolor=style.FRONT, marker="o")]
    np.testing.assert_allclose(ours, [0.66, 1.0])
    # a mark stands nearer to its own row than to any other
    assert all(abs(place - round(place)) < 0.5 for place, _ in marks(height, **hollow))
    np.testing.assert_allclose(marks(balance, color=style.BLACK, **hollow), [(0, 0.1926), (1, 0.2554)])


def test_parameters_of_the_table_come_with_its_bounds_in_its_units():
    thesis = {"N": {"dh_f": 0.0096, "dh_r": 0.0016, "a_off": 0.2554}, "E": {"dK_h_rear": -300e3}}
    ours = {"N": {"dh_f": 0.010, "dh_r": 0.0017, "a_off": 0.2478, "dK_h_rear": 0.0}, "E": {"dK_h_rear": -3e5}}
    found = figures_offsets.offsets_of_table(thesis, ours)
    assert [(each.panel, each.axle, each.unit, each.bound) for each in found] == [
        ("ride height", "front", "mm", 10.0),
        ("ride height", "rear", "mm", 30.0),
        ("heave stiffness", "rear", "kN/m", 300.0),
        ("fixed balance", "", "", 1.0),
    ]
    assert found[0].thesis == {"N": pytest.approx(9.6)} and found[0].ours == {"N": pytest.approx(10.0)}
    # row N holds its heave stiffness, so that it is not among those that have one
    assert found[2].ours == {"E": pytest.approx(-300.0)}


def test_every_adjustment_of_the_table_has_its_panel():
    everything = {"P": {name: one.bound for name, one in ADJUSTMENTS.items()}}
    assert len(figures_offsets.offsets_of_table(everything, everything)) == len(ADJUSTMENTS)


def test_an_offset_beyond_its_bound_stays_in_the_picture():
    beyond = replace(BALANCE, ours={"M": -1.5})
    low, high = figures_offsets.optimal_offsets([beyond]).axes[0].get_ylim()
    assert low < -1.5 and high > 1.5


def test_the_legend_of_the_offsets_names_only_what_is_there():
    (legend,) = figures_offsets.optimal_offsets([FRONT, REAR]).legends
    assert [text.get_text() for text in legend.texts] == ["front", "rear", "thesis", "this run"]


def test_panels_beyond_the_last_are_hidden():
    many = [replace(BALANCE, panel=f"balance {number}") for number in range(4)]
    assert [axes.get_visible() for axes in figures_offsets.optimal_offsets(many).axes] == [True] * 4 + [
        False
    ] * 2


@pytest.mark.parametrize("bound", [0.0, -1.0, float("nan"), float("inf")])
def test_an_offset_without_a_bound_is_refused(bound):
    with pytest.raises(ValueError, match=r"the bound of ride height front is .* positive number"):
        replace(FRONT, bound=bound)


def test_an_offset_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match="balance of row M is nan; it must be a number"):
        replace(BALANCE, ours={"M": float("nan")})


def test_a_picture_of_no_parameter_is_refused():
    with pytest.raises(ValueError, match="there is no set-up parameter to draw"):
        figures_offsets.optimal_offsets([])
