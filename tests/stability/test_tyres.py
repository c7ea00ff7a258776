"""The axle's force and its fits."""

import numpy as np
import pytest

from thesislib.stability.tyres import MagicFormula, cubic_tyre, polynomial_fit, rational_fit


@pytest.fixture(params=["front", "rear"])
def axle(request):
    return MagicFormula.from_file(request.param)


def test_slopes_are_derivatives(axle):
    alpha = np.linspace(-0.5, 0.5, 11)
    for tyre in (axle, rational_fit(axle), cubic_tyre()):
        difference = (tyre.force(alpha + 1e-6) - tyre.force(alpha - 1e-6)) / 2e-6
        assert np.allclose(tyre.slope(alpha), difference, rtol=1e-6, atol=1e-2)


def test_the_rational_fit_is_within_three_per_cent_of_the_peak(axle):
    alpha = np.linspace(-0.7, 0.7, 999)
    error = np.abs(rational_fit(axle).force(alpha) - axle.force(alpha)).max()
    assert error < 0.03 * abs(axle.D)


def test_the_rational_fit_is_optimal(axle):
    """No neighbour of the fit has a smaller sum of squares."""
    fit, alpha = rational_fit(axle), np.linspace(-0.7, 0.7, 1401)

    def residual(numerator, denominator):
        polyval = np.polynomial.polynomial.polyval
        return ((polyval(alpha, numerator) / polyval(alpha, denominator) - axle.force(alpha)) ** 2).sum()

    best = residual(fit.numerator, fit.denominator)
    for place, k in (("numerator", 1), ("numerator", 3), ("denominator", 0), ("denominator", 2)):
        for factor in (0.999, 1.001):
            parts = {"numerator": list(fit.numerator), "denominator": list(fit.denominator)}
            parts[place][k] *= factor
            assert residual(**parts) > best


def test_higher_polynomials_fit_better_and_none_as_well_as_the_rational_fit(axle):
    alpha = np.linspace(-0.7, 0.7, 999)

    def error(tyre):
        return np.sqrt(((tyre.force(alpha) - axle.force(alpha)) ** 2).mean())

    third, seventh = (error(polynomial_fit(axle, order)) for order in (3, 7))
    assert error(rational_fit(axle)) < seventh < third


def test_a_fit_over_a_narrow_range_degenerates_and_says_so():
    with pytest.raises(ValueError, match=r"degenerates: q_1 = .* is above 20"):
        rational_fit(MagicFormula.from_file("front"), reach=0.3)


def test_even_orders_are_refused(axle):
    with pytest.raises(ValueError, match="order = 4 of the polynomial fit"):
        polynomial_fit(axle, 4)
