"""Certified disturbance margins of the racing car in mid-corner."""

import copy
import json
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from thesislib.stability import checking
from thesislib.stability.ascent import scaling
from thesislib.stability.fields import TIME_UNIT
from thesislib.stability.margins import (
    certified_margin,
    exact_trim,
    margin_case,
    simulated_reach,
)
from thesislib.stability.phase_plane import returns
from thesislib.stability.racing_trim import read_trims

TRIMS = {(trim.lap, trim.corner): trim for trim in read_trims()}


@pytest.fixture(scope="module")
def trim():
    return TRIMS["row C", 6]


@pytest.fixture(scope="module")
def margin(trim):
    return certified_margin(trim, degree=2, steps=4)


@pytest.fixture(scope="module")
def document(margin):
    return margin.certificate.document


@pytest.mark.parametrize("key", [("row C", 5), ("row C", 8), ("row C", 15)])
def test_the_fitted_car_is_the_trim_nearby(key):
    trim = TRIMS[key]
    scale = Fraction(1, 16)
    field, to_state = exact_trim(trim, scale).field, scaling(trim.matrix, scale)
    assert not any(n.coefficients[0, 0] for n in field.n)  # an equilibrium, exactly
    n_1, n_2, d = field.floats
    for z in ([0.2, 0.1], [-0.3, 0.2], [0.1, -0.4]):
        fitted = to_state @ np.array([n_1(*z), n_2(*z)]) / d(*z) / float(TIME_UNIT)
        # fits within half a per cent of an axle's largest force near the trim
        largest = np.abs([axle.force_and_moment(np.linspace(-0.3, 0.3, 61))[0] for axle in trim.axles]).max()
        allowed = 0.005 * largest * np.array([1 / trim.mass, trim.a / trim.I_z])
        assert (np.abs(fitted - trim.rates(trim.trim() + to_state @ z)) < allowed).all()


def test_the_certificate_holds_and_names_the_ellipse(document, margin):
    verdict = checking.check(document)
    assert verdict.gamma == 1.0
    assert verdict.beta == pytest.approx(margin.energy_speed**2, rel=1e-12)


CHANGES = {
    "the yaw moment of the rear axle": ("cars", 0, "rear", "moment", 0),
    "the side force that holds the trim": ("cars", 0, "forcing", 0),
    "the yaw moment that holds the trim": ("cars", 0, "forcing", 1),
    "the size of the ellipse": ("contains", "beta"),
}


@pytest.mark.parametrize("path", CHANGES.values(), ids=CHANGES)
def test_a_changed_certificate_is_refused(document, path):
    changed = copy.deepcopy(document)
    *way, last = path
    place = changed
    for step in way:
        place = place[step]
    place[last] = str(Fraction(place[last]) * Fraction(1001, 1000))
    with pytest.raises(checking.CertificateError, match="The certificate fails"):
        checking.check(changed)


def test_no_start_on_the_boundary_is_lost_by_either_model(trim, margin):
    starts = trim.trim() + margin.boundary(rays=72)
    assert returns(trim, starts, arrival=2e-3).all()

    whole = SimpleNamespace(trim=trim.trim, to_slip=trim.to_slip, rates=trim.whole_car_rates)
    assert returns(whole, starts, arrival=2e-3).all()


def test_certified_margins_are_below_simulated_ones(trim, margin):
    ways = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    certified = [margin.along(*way) for way in ways]
    assert (certified < simulated_reach(trim, ways)).all()
    assert 0.5 * margin.simulated < margin.energy_speed < margin.simulated


def test_a_margin_along_an_axis_ends_where_v_is_one(trim, margin):
    to_slip = np.linalg.inv(scaling(trim.matrix, margin.scale))
    V = margin.certificate.V
    for way in ([1.0, 0.0], [0.0, -1.0]):
        reach = margin.along(*way)
        assert float(V(*(to_slip @ (reach * np.array(way))))) == pytest.approx(1.0, abs=1e-9)
        assert all(float(V(*(to_slip @ (x * reach * np.array(way))))) < 1 for x in np.linspace(0, 0.99, 50))


def test_the_ellipse_touches_the_set_nearly(trim, margin):
    away = margin.boundary(rays=72)
    nearest = np.hypot(away[:, 0], trim.gyration * away[:, 1]).min()
    # inside, and short of it by the largest step by which it may shrink before it is certified
    assert 0.97 * nearest < margin.energy_speed < nearest


def test_near_a_limit_of_stability_the_scale_follows_the_region():
    trim = TRIMS["row C", 15]
    small = certified_margin(trim, degree=2, steps=2)
    assert small.scale < Fraction(1, 32)
    assert 0 < small.energy_speed < small.simulated < 0.2


def test_an_unstable_trim_has_no_margin_and_says_so():
    case = margin_case("row C", 1)
    assert case["growth"] > 0
    assert "the frozen lateral motion is unstable (growth +3.4" in case["reason"]
    with pytest.raises(ValueError, match="unstable"):
        certified_margin(TRIMS["row C", 1])


def test_an_odd_degree_is_refused(trim):
    with pytest.raises(ValueError, match="deg V = 3 is not an even number"):
        certified_margin(trim, degree=3)


def test_the_certificate_survives_its_file(document, tmp_path):
    path = tmp_path / "corner.json"
    path.write_text(json.dumps(document))
    assert checking.check_file(path) == checking.check(document)
