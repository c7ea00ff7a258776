"""A metamodel held at the end of its mesh."""

from dataclasses import replace

import casadi
import numpy as np
import pytest

from thesislib.suspension.held import HeldHeights
from thesislib.suspension.metamodel import Metamodel
from thesislib.suspension.stiffness import StiffnessMetamodel

MODELS = {"Table 3.1": Metamodel.from_file(), "Table 3.2": StiffnessMetamodel.from_file()}


@pytest.fixture(params=list(MODELS))
def model(request):
    return MODELS[request.param]


def test_beyond_the_mesh_the_heights_are_those_of_its_edge_and_roll_goes_on(model) -> None:
    held = HeldHeights(model)
    heavy = held.heights(-9500.0, -3000.0, -9900.0, -4000.0)
    edge = model.heights(-6000.0, -3000.0, -8000.0, -4000.0)
    free = model.heights(-9500.0, -3000.0, -9900.0, -4000.0)
    # the rounded corners leave 0.3 N each, at 2.5 to 5 mm a kilonewton
    assert heavy.h_f == pytest.approx(edge.h_f, abs=5e-6)
    assert heavy.h_r == pytest.approx(edge.h_r, abs=5e-6)
    assert (heavy.phi_f, heavy.phi_r) == (free.phi_f, free.phi_r)
    assert heavy.h_f < free.h_f - 5e-3


def test_replaced_numbers_reach_the_model(model) -> None:
    loads = (-4000.0, -3000.0, -3500.0, -3000.0)
    held = HeldHeights(model)
    assert held.values == model.values
    moved = held.heights(*loads, {"h_f_unloaded": model.values["h_f_unloaded"] + 5e-3})
    assert moved.h_f - held.heights(*loads).h_f == pytest.approx(5e-3)


def test_arrays_and_symbols_agree(model) -> None:
    loads = np.array([[-2000.0, -5990.0, -8100.0], [-100.0, -6010.0, -9000.0]])
    symbols = [casadi.SX.sym(name) for name in ("fl", "fr")]
    symbolic = HeldHeights(model).heights(*symbols, *symbols)
    function = casadi.Function("heights", symbols, [symbolic.h_f, symbolic.h_r])
    numeric = HeldHeights(model).heights(*loads, *loads)
    for column in range(3):
        values = [float(each) for each in function(*loads[:, column])]
        np.testing.assert_allclose(values, [numeric.h_f[column], numeric.h_r[column]], rtol=1e-12)


def test_a_model_without_a_mesh_has_no_edge(model) -> None:
    with pytest.raises(ValueError, match="heaviest_rear = -inf"):
        HeldHeights(replace(model, heaviest_rear=-np.inf))
