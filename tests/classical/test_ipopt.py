"""The peer reports its way in the terms of this room."""

import numpy as np
import pytest

from thesislib.classical.ipopt import ipopt
from thesislib.classical.programme import NotConvergedError, Programme


def test_way_begins_at_the_start_and_ends_at_the_optimum(hs71):
    found = ipopt(hs71, [1.0, 5.0, 5.0, 1.0])
    np.testing.assert_allclose(found.points[0], [1.0, 5.0, 5.0, 1.0], atol=0.05)  # IPOPT moves off bounds
    np.testing.assert_allclose(found.points[-1], found.x, atol=1e-12)
    assert len(found.points) == len(found.residuals) == found.iterations + 1
    assert found.residuals[-1] == pytest.approx(hs71.kkt_residual(found.x, found.lam, found.mu), rel=1e-6)


def test_infeasible_programme_raises():
    nowhere = Programme(lambda x: x[0], 1, lambda x: [x[0] ** 2 + 1], name="nowhere")
    with pytest.raises(
        NotConvergedError, match=r"nowhere: IPOPT stopped with Infeasible.* \(2\.22b\) 1, by 1"
    ):
        ipopt(nowhere, [1.0])
