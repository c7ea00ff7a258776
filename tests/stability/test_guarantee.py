"""The guarantee for the Magic Formula, and the interval arithmetic below it."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from thesislib.stability.bivariate import Polynomial
from thesislib.stability.guarantee import GuaranteeError, guarantee, sampled_level
from thesislib.stability.intervals import Interval, enclose
from thesislib.stability.phase_plane import escapes


def test_interval_operations_hold_every_exact_result():
    generator = np.random.default_rng(5)
    ends = np.sort(generator.normal(size=(2, 2, 200)), axis=1)
    x, y = (Interval(low, high) for low, high in ends)
    for name, exactly in (
        ("__add__", lambda a, b: a + b),
        ("__sub__", lambda a, b: a - b),
        ("__mul__", lambda a, b: a * b),
    ):
        result = getattr(x, name)(y)
        for k in range(200):
            for a in (x.low[k], x.high[k]):
                for b in (y.low[k], y.high[k]):
                    value = exactly(Fraction(float(a)), Fraction(float(b)))
                    assert Fraction(float(result.low[k])) <= value <= Fraction(float(result.high[k]))


def test_a_polynomial_s_values_lie_in_its_enclosure():
    p = Polynomial.from_terms({(0, 0): 0.3, (3, 1): -2.0, (1, 2): 1.5, (0, 4): 0.7})
    low = np.random.default_rng(6).uniform(-1, 1, (2, 50))
    x, y = (Interval(each, each + 0.1) for each in low)
    bound = enclose(p, x, y)
    for share in np.random.default_rng(7).uniform(0, 0.1, (20, 2)):
        value = p(low[0] + share[0], low[1] + share[1])
        assert ((bound.low <= value) & (value <= bound.high)).all()


@pytest.fixture(scope="module", params=["linear", "arctan"])
def promise(request, magic, found):
    car = replace(magic, slip=request.param)
    return car, guarantee(car, found.regions[4].V)


def test_the_guaranteed_level_loses_little(promise):
    _, given = promise
    assert 0.9 < given.level < given.sampled
    # a level that cannot be shown costs a million boxes, and some seconds: the first one tried has to hold
    assert given.boxes < 100_000


def test_no_motion_of_the_magic_formula_escapes(promise, truth, found):
    car, given = promise
    boundary = found.regions[4].boundary(found.to_state, truth.trim, level=given.level)
    assert escapes(car, boundary) == 0


def test_a_level_above_the_sampled_one_is_not_guaranteed(magic, found):
    from thesislib.stability.enclosures import enclosed
    from thesislib.stability.guarantee import _Search

    V = found.regions[2].V
    search = _Search(enclosed(magic), V, 1.03 * sampled_level(magic, V))
    assert "V rises at a point below level" in search.run()


def test_a_level_that_only_touches_is_given_up_after_the_boxes_allowed(magic, found):
    from thesislib.stability.enclosures import enclosed
    from thesislib.stability.guarantee import _Search

    V = found.regions[2].V
    search = _Search(enclosed(magic), V, (1 - 1e-6) * sampled_level(magic, V))
    search.most_boxes = 5_000
    assert "boxes would be needed" in search.run()


def test_samples_close_in_on_the_level_at_which_v_stops_falling(magic, found):
    car, V = replace(magic, slip="arctan"), found.regions[4].V
    close = sampled_level(car, V)
    # along the curve on which it stops falling V changes by the square of the distance to its lowest point
    assert close == pytest.approx(sampled_level(car, V, rays=1001, radii=500), rel=1e-5)


def test_a_scale_that_makes_boxes_inexact_is_refused(magic, found):
    with pytest.raises(ValueError, match="scale = 1/10 of V is not a power of two"):
        guarantee(magic, found.regions[2].V, scale=Fraction(1, 10))


def test_a_v_that_does_not_fall_is_refused(magic, found):
    with pytest.raises(GuaranteeError, match="No level of V"):
        guarantee(magic, Polynomial.from_terms({(2, 0): 1.0, (0, 2): 40.0}))


def test_other_tyres_are_refused(car, found):
    with pytest.raises(TypeError, match="MagicFormula axles, not RationalTyre"):
        guarantee(car, found.regions[2].V)
