"""One model for numbers and for enclosures."""

import numpy as np
import pytest
from flint import arb, arb_series

from thesislib.vehicles import ParameterSet
from thesislib.vehicles.elementary import elementary, square
from thesislib.vehicles.tyres import tyre_forces


def test_an_enclosure_brings_its_own_functions():
    x = arb_series([arb(0.3), 1], prec=2)
    xp = elementary(1.0, x)
    for name, value, slope in (
        ("sin", np.sin(0.3), np.cos(0.3)),
        ("cos", np.cos(0.3), -np.sin(0.3)),
        ("tan", np.tan(0.3), 1 / np.cos(0.3) ** 2),
        ("arctan", np.arctan(0.3), 1 / 1.09),
        ("sqrt", np.sqrt(0.3), 0.5 / np.sqrt(0.3)),
    ):
        found = getattr(xp, name)(x)
        assert [float(found[k].mid()) for k in (0, 1)] == pytest.approx([value, slope], rel=1e-14)


def test_the_square_of_an_enclosure_across_zero_is_not_negative():
    found = square(arb_series([arb(0.01, 0.1), 1], prec=2))
    # a square has a power series without the constant term's sign; arb rounds outwards by parts in 1e9
    assert float(found[0].lower()) > -1e-8
    assert float(found[0].upper()) >= 0.11**2
    assert found[1].contains(2 * arb(0.11)) and found[1].contains(2 * arb(-0.09))


def test_tyre_forces_of_an_enclosure_hold_those_of_every_slip():
    p = ParameterSet.from_file("racing_tyre", "tyres").values
    ball = arb(0.08, 1e-3)
    enclosed = tyre_forces(3000.0, 0.03, arb_series([ball, 1], prec=2), p)
    floats = tyre_forces(3000.0, 0.03, np.linspace(0.079, 0.081, 41), p)
    for name in ("F_x", "F_y"):
        bound, values = getattr(enclosed, name)[0], getattr(floats, name)
        assert float(bound.lower()) <= values.min() <= values.max() <= float(bound.upper())
        assert float(bound.rad()) < 0.1 * np.abs(values).max()
