"""Claims about the metamodel with heave stiffness, Table 3.2."""

import casadi
import numpy as np
import pytest

from thesislib import provenance
from thesislib.suspension import Metamodel, StiffnessMetamodel
from thesislib.suspension.stiffness import StiffenedMetamodel


@pytest.fixture(scope="module")
def printed():
    return StiffnessMetamodel.from_file()


@pytest.fixture(scope="module")
def of_the_text():
    return Metamodel.from_file(rear_constant="text")


def test_unloaded_front_axle_stands_where_the_table_says(printed):
    # by hand: -25.3 - 1.19e-3 * 1000 + 3.13e-6 * 1000^2 = -23.36 mm
    assert printed.values["h_f_unloaded"] == pytest.approx(-23.36e-3, abs=1e-12)
    assert printed.heights(0.0, 0.0, 0.0, 0.0).h_f == pytest.approx(-23.36e-3, abs=1e-12)


def test_stiffness_counts_in_kilonewtons_per_metre_and_not_as_an_offset(printed, of_the_text):
    # as an offset from the nominal value the table would be 9 mm off in front and 41 mm behind
    F_l, F_r = np.random.default_rng(2).uniform(-6000.0, 0.0, (2, 50))
    here, there = printed.heights(F_l, F_r, F_l, F_r), of_the_text.heights(F_l, F_r, F_l, F_r)
    assert np.abs(here.h_f - there.h_f).max() < 2e-3
    assert np.abs(here.h_r - there.h_r).max() < 2e-3


def test_tables_differ_by_a_constant_and_by_their_fit_errors(printed, of_the_text):
    offsets = printed.offsets(of_the_text)
    assert offsets["front"][0] == pytest.approx(-1.26e-3, abs=0.01e-3)
    assert offsets["rear"][0] == pytest.approx(-1.35e-3, abs=0.01e-3)
    # the two stated fit errors of the front axle, 0.44 mm and 0.147 mm, bound what remains
    assert max(rest for _, rest in offsets.values()) < 0.587e-3


def test_reconciled_table_has_no_constant_left(printed, of_the_text):
    reconciled = printed.reconciled(of_the_text)
    for (constant, rest), (_, before) in zip(
        reconciled.offsets(of_the_text).values(), printed.offsets(of_the_text).values(), strict=True
    ):
        assert constant == pytest.approx(0.0, abs=1e-15)
        assert rest == pytest.approx(before, abs=1e-15)
    assert reconciled.phi_f == printed.phi_f
    assert reconciled.h_r[1:] == printed.h_r[1:]


def test_stiffer_spring_sinks_less(printed):
    softer, stiffer = (
        printed.heights(-5e3, -5e3, -5e3, -5e3, {"K_h_front": 1e6 + change, "K_h_rear": 0.65e6 + change})
        for change in (-1e5, 1e5)
    )
    assert stiffer.h_f < softer.h_f
    assert stiffer.h_r < softer.h_r


def test_height_adjustment_moves_its_axle_by_as_much_at_any_stiffness(printed):
    loads, K = (-2e3, -1e3, -4e3, -3e3), {"K_h_front": 1.3e6}
    lower = {"h_f_unloaded": printed.values["h_f_unloaded"] + 5e-3, **K}
    assert printed.heights(*loads, lower).h_f - printed.heights(*loads, K).h_f == pytest.approx(
        5e-3, abs=1e-15
    )


def test_loads_and_stiffnesses_may_be_symbols(printed):
    x = casadi.SX.sym("x", 6)
    names = ("K_h_front", "K_h_rear")
    posture = printed.heights(
        *casadi.vertsplit(x[:4]), dict(zip(names, casadi.vertsplit(x[4:]), strict=True))
    )
    symbolic = casadi.Function("posture", [x], list(vars(posture).values()))
    point = (-4321.0, -1234.0, -5432.0, -2345.0, 1.2e6, 0.5e6)
    expected = printed.heights(*point[:4], dict(zip(names, point[4:], strict=True)))
    np.testing.assert_allclose(
        [float(one) for one in symbolic(point)], list(vars(expected).values()), atol=1e-15
    )


def test_mirrored_loads_keep_the_heights_and_turn_the_roll_angles(printed):
    fl, fr, rl, rr = np.random.default_rng(6).uniform(-8000.0, 0.0, size=(4, 50))
    here, mirrored = printed.heights(fl, fr, rl, rr), printed.heights(fr, fl, rr, rl)
    np.testing.assert_allclose(mirrored.h_f, here.h_f, atol=1e-15)
    np.testing.assert_allclose(mirrored.phi_r, -here.phi_r, atol=1e-16)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("-25.3, ", "", r"h of the metamodel table, front needs 10 finite coefficients"),
        ("front_nominal_kN_per_m = 1000.0", "front_nominal_kN_per_m = 0.0", "nominal_front = 0 N/m"),
        ('unit = "mm"', 'unit = "m"', r"\[h_f\] must have unit = 'mm'"),
    ],
)
def test_bad_table_is_refused(tmp_path, old, new, message):
    source = provenance.project_root() / "data" / "suspension" / "metamodel_table_3_2.toml"
    text = source.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "table.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        StiffnessMetamodel.from_file(path)


def test_stiffened_metamodel_is_its_base_at_nominal_stiffness_and_moves_as_the_table_does(
    printed, of_the_text
):
    stiffened = StiffenedMetamodel(of_the_text, printed)
    loads = np.random.default_rng(5).uniform(-6000.0, 0.0, (4, 20))
    lower = {"h_f_unloaded": stiffened.values["h_f_unloaded"] + 0.004}
    stiffer = {"K_h_front": 1.2e6, "K_h_rear": 0.5e6}
    for name in ("h_f", "h_r", "phi_f", "phi_r"):
        base = getattr(of_the_text.heights(*loads, lower), name)
        np.testing.assert_allclose(getattr(stiffened.heights(*loads, lower), name), base, atol=1e-15)
        moved = getattr(stiffened.heights(*loads, {**lower, **stiffer}), name) - base
        table = getattr(printed.heights(*loads, stiffer), name) - getattr(printed.heights(*loads), name)
        assert np.abs(table).max() > 1e-5
        np.testing.assert_allclose(moved, table, atol=1e-15)
