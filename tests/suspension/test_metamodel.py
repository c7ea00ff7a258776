"""Claims of section 3.2.1 about the suspension metamodel of Table 3.1."""

import casadi
import numpy as np
import pytest

from thesislib import provenance
from thesislib.suspension import Metamodel

# the car at rest: 660 kg, mass centre 1.8 m behind the front axle of a 3.4 m wheelbase; N per wheel, SAE
FRONT_STATIC = -660 * 9.80665 * 1.6 / 3.4 / 2
REAR_STATIC = -660 * 9.80665 * 1.8 / 3.4 / 2


@pytest.fixture(scope="module")
def printed() -> Metamodel:
    return Metamodel.from_file()


@pytest.fixture(scope="module")
def of_the_text() -> Metamodel:
    return Metamodel.from_file(rear_constant="text")


def at_equal_loads(model, front, rear):
    return model.heights(front, front, rear, rear)


def test_front_axle_stands_at_its_nominal_height_under_the_static_load(printed):
    assert at_equal_loads(printed, FRONT_STATIC, REAR_STATIC).h_f == pytest.approx(-14.0e-3, abs=0.02e-3)


def test_front_ride_height_at_full_load_is_seven_millimetres(printed):
    # by hand: -21.52 + 2 * 6 * 2.513 + 36 * (2 * -0.08324 + 0.1126) = 6.696 mm
    assert at_equal_loads(printed, -6000.0, 0.0).h_f == pytest.approx(6.69632e-3, abs=1e-9)


def test_constant_of_the_text_reproduces_the_rear_heights_of_the_text(of_the_text):
    unloaded, static, full = (
        at_equal_loads(of_the_text, 0.0, rear).h_r for rear in (0.0, REAR_STATIC, -8000.0)
    )
    assert unloaded == pytest.approx(-88.0e-3, abs=0.05e-3)
    assert static == pytest.approx(-74.1e-3, abs=0.05e-3)
    assert full == pytest.approx(-27.0e-3, abs=0.15e-3)


def test_readings_of_the_rear_constant_differ_by_a_millimetre_everywhere(printed, of_the_text):
    loads = np.random.default_rng(5).uniform(-8000.0, 0.0, size=(4, 30))
    one, other = printed.heights(*loads), of_the_text.heights(*loads)
    np.testing.assert_allclose(other.h_r - one.h_r, 1e-3, atol=1e-15)
    np.testing.assert_array_equal(other.h_f, one.h_f)


def test_roll_ranges_are_those_of_figures_3_9_and_3_10(printed):
    left_only = printed.heights(-6000.0, 0.0, -8000.0, 0.0)
    assert np.degrees(left_only.phi_f) == pytest.approx(-2.4, abs=0.05)
    assert np.degrees(left_only.phi_r) == pytest.approx(-5.0, abs=0.15)


def test_right_hand_turn_rolls_the_car_to_the_left(printed):
    posture = printed.heights(-4000.0, -1000.0, -5000.0, -2000.0)
    assert posture.phi_f < 0.0
    assert posture.phi_r < 0.0


def test_mirrored_loads_keep_the_heights_and_turn_the_roll_angles(printed):
    fl, fr, rl, rr = np.random.default_rng(6).uniform(-8000.0, 0.0, size=(4, 50))
    here, mirrored = printed.heights(fl, fr, rl, rr), printed.heights(fr, fl, rr, rl)
    np.testing.assert_allclose(mirrored.h_f, here.h_f, atol=1e-15)
    np.testing.assert_allclose(mirrored.h_r, here.h_r, atol=1e-15)
    np.testing.assert_allclose(mirrored.phi_f, -here.phi_f, atol=1e-16)
    np.testing.assert_allclose(mirrored.phi_r, -here.phi_r, atol=1e-16)


def test_more_load_on_both_wheels_always_lowers_the_axle(printed):
    front, rear = np.linspace(0.0, -6000.0, 61), np.linspace(0.0, -8000.0, 61)
    posture = at_equal_loads(printed, front, rear)
    assert np.all(np.diff(posture.h_f) > 0.0)
    assert np.all(np.diff(posture.h_r) > 0.0)


def test_ride_height_adjustment_moves_its_axle_by_as_much(printed):
    loads = (-2000.0, -1500.0, -3000.0, -2500.0)
    lower = {"h_f_unloaded": printed.values["h_f_unloaded"] + 5e-3}
    assert printed.heights(*loads, lower).h_f - printed.heights(*loads).h_f == pytest.approx(5e-3, abs=1e-15)
    assert printed.heights(*loads, lower).h_r == printed.heights(*loads).h_r


def test_casadi_and_numpy_give_the_same_posture(printed):
    load = casadi.SX.sym("F", 4)
    symbolic = casadi.Function(
        "posture", [load], list(vars(printed.heights(*casadi.vertsplit(load))).values())
    )
    numbers = (-4321.0, -1234.0, -5432.0, -2345.0)
    expected = list(vars(printed.heights(*numbers)).values())
    np.testing.assert_allclose([float(one) for one in symbolic(numbers)], expected, rtol=0, atol=1e-15)


def test_axles_by_themselves_have_the_polynomials_of_the_table(printed):
    loads = np.random.default_rng(7).uniform(-6000.0, 0.0, size=(4, 20))
    posture = printed.heights(*loads)
    np.testing.assert_allclose(printed.front(*loads[:2]), [posture.h_f, posture.phi_f], atol=1e-15)
    np.testing.assert_allclose(printed.rear(*loads[2:]), [posture.h_r, posture.phi_r], atol=1e-15)


def test_table_knows_its_meshes_and_the_time_outside_them(printed):
    assert (printed.front.box, printed.rear.box) == (2 * ((-6000.0, 0.0),), 2 * ((-8000.0, 0.0),))
    front, rear = np.array([[-5e3, -5e3], [-7e3, -1e3], [-5e3, -5e3]]), np.full((3, 2), -7e3)
    # one front sample of three is outside: half of each step beside it
    assert printed.time_outside([0.0, 1.0, 3.0], front, rear) == {"front": 1.5, "rear": 0.0}


def test_table_that_names_no_mesh_is_known_everywhere(tmp_path):
    source = provenance.project_root() / "data" / "suspension" / "metamodel_table_3_1.toml"
    text = source.read_text(encoding="utf-8")
    path = tmp_path / "table.toml"
    path.write_text(text[: text.index("[mesh]")] + text[text.index("[h_f]") :], encoding="utf-8")
    assert Metamodel.from_file(path).front.inside(-1e6, -1e6)


def test_unknown_reading_of_the_rear_constant_is_refused():
    with pytest.raises(ValueError, match="rear_constant = 'chapter 3' is not one of printed, text"):
        Metamodel.from_file(rear_constant="chapter 3")


def test_unknown_table_is_refused():
    with pytest.raises(FileNotFoundError, match="no metamodel table_9_9"):
        Metamodel.from_file("table_9_9")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('unit = "mm"', 'unit = "m"', r"\[h_f\] must have unit = 'mm'"),
        ("-21.52, ", "", r"h_f of the metamodel table needs 6 finite coefficients"),
        ("-21.52", "nan", r"h_f of the metamodel table needs 6 finite coefficients"),
        ("[phi_r]", "[phi_q]", r"\[phi_r\] must have unit = 'rad'"),
        ("constant_from_text = -88.04", "", r"\[h_r\] has no constant_from_text"),
    ],
)
def test_incomplete_table_is_refused(tmp_path, old, new, message):
    source = provenance.project_root() / "data" / "suspension" / "metamodel_table_3_1.toml"
    text = source.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "table.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        Metamodel.from_file(path, rear_constant="text")
