"""Level sets along rays, against ones that are known in closed form."""

import numpy as np
import pytest

from thesislib.stability.bivariate import Polynomial
from thesislib.stability.rays import Rays

SQUARE = Polynomial.from_terms({(2, 0): 1.0, (0, 2): 1.0})


@pytest.mark.parametrize("half", [True, False])
def test_the_lowest_level_is_that_of_the_root_and_not_of_the_samples_beside_it(half):
    # dV/dt changes sign on a circle whose radius is no sample; V = r^8 bends there as a V of degree 8 does,
    # and linear interpolation between the samples would miss by one part in a hundred
    radius = 0.271
    rises = SQUARE * (SQUARE - radius**2)
    V = SQUARE * SQUARE * SQUARE * SQUARE
    # bisection ends 2e-11 from the root, which V multiplies by 8 / 0.27
    assert Rays(24, half=half).lowest_level(V, rises) == pytest.approx(radius**8, rel=1e-9)


def test_a_v_that_falls_everywhere_has_no_lowest_level():
    assert Rays(24, half=True).lowest_level(SQUARE, -1.0 * SQUARE) == np.inf


def test_the_boundary_of_an_ellipse_is_where_it_is():
    rays = Rays(36, half=True)
    ellipse = Polynomial.from_terms({(2, 0): 4.0, (0, 2): 25.0})
    along, across = rays.directions.T
    known = 1 / np.sqrt(4 * along**2 + 25 * across**2)
    # three steps of Newton from less than a hundredth away leave rounding
    assert rays.boundary(ellipse) == pytest.approx(known, rel=1e-12)


def test_a_set_without_end_is_refused():
    strip = Polynomial.from_terms({(0, 2): 1.0})
    with pytest.raises(ValueError, match=r"The set V <= 1 extends beyond 6 units of slip"):
        Rays(36, half=True).boundary(strip)
