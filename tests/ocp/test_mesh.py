import numpy as np
import pytest

from thesislib.ocp import Mesh
from thesislib.ocp.quadrature import FLIPPED_RADAU, RADAU

UNEVEN = Mesh(np.array([0.0, 0.1, 0.4, 1.0]), np.array([2, 5, 3]))


@pytest.mark.parametrize(
    ("boundaries", "orders", "reason"),
    [
        ([0, 1], [2, 2], "2 mesh points do not bound 2 mesh intervals"),
        ([0, 0.6, 0.5, 1], [2, 2, 2], "must increase from 0 to 1"),
        ([0, 0.5, 0.9], [2, 2], "must increase from 0 to 1"),
        ([0.1, 0.5, 1], [2, 2], "must increase from 0 to 1"),
        ([0, 0.5, 1], [2, 0], "mesh interval 1 has no collocation point"),
    ],
)
def test_impossible_mesh_is_refused_with_the_reason(boundaries, orders, reason):
    with pytest.raises(ValueError, match=reason):
        Mesh(np.array(boundaries), np.array(orders))


def test_points_lie_in_their_intervals_and_the_end_is_a_node_only():
    assert UNEVEN.points == 10
    starts, ends = UNEVEN.boundaries[UNEVEN.interval], UNEVEN.boundaries[UNEVEN.interval + 1]
    assert np.all((starts <= UNEVEN.collocation) & (UNEVEN.collocation < ends))
    np.testing.assert_array_equal(UNEVEN.collocation[UNEVEN.first], UNEVEN.boundaries[:-1])
    assert UNEVEN.nodes[-1] == 1.0 and len(UNEVEN.nodes) == 11


def test_weights_integrate_a_polynomial_of_the_lowest_interval_over_the_whole_range():
    assert UNEVEN.weights @ UNEVEN.collocation**2 == pytest.approx(1 / 3, abs=1e-15)


def test_states_are_interpolated_with_the_interval_end_and_controls_without():
    places = np.array([0.0, 0.05, 0.1, 0.3, 0.99, 1.0])
    squares = UNEVEN.interpolate_states(UNEVEN.nodes[None] ** 2, places)
    np.testing.assert_allclose(squares[0], places**2, atol=1e-14)
    lines = UNEVEN.interpolate_controls(3 * UNEVEN.collocation[None] - 1, places)
    np.testing.assert_allclose(lines[0], 3 * places - 1, atol=1e-14)


def test_control_may_jump_at_a_mesh_point_and_takes_the_later_value_there():
    values = (UNEVEN.interval == 1).astype(float)[None]
    np.testing.assert_allclose(
        UNEVEN.interpolate_controls(values, np.array([0.0999999, 0.1, 0.4]))[0], [0, 1, 0], atol=1e-12
    )


def test_halved_mesh_keeps_all_mesh_points_and_orders():
    halved = UNEVEN.halved()
    np.testing.assert_array_equal(halved.boundaries[::2], UNEVEN.boundaries)
    np.testing.assert_array_equal(halved.orders, [2, 2, 5, 5, 3, 3])


def test_divided_mesh_has_no_interval_longer_than_asked_and_no_part_too_many():
    divided = UNEVEN.divided(0.1)
    # widths of 0.1, 0.3 and 0.6, up to rounding: 1, 3 and 6 parts
    np.testing.assert_allclose(divided.widths, 0.1)
    assert set(UNEVEN.boundaries) <= set(divided.boundaries)


def test_parts_of_a_divided_interval_have_two_points_less_but_three_at_least():
    mesh = Mesh(np.array([0.0, 0.1, 0.3, 0.5, 0.7, 1.0]), np.array([8, 8, 4, 2, 3]))
    # the first interval stays whole, and one of two points keeps them
    np.testing.assert_array_equal(mesh.divided(0.15).orders, [8, 6, 6, 3, 3, 2, 2, 3, 3])


def test_mesh_that_is_fine_enough_is_not_divided():
    np.testing.assert_array_equal(UNEVEN.divided(0.7).boundaries, UNEVEN.boundaries)


def test_intervals_by_order_are_each_interval_once():
    found = sorted((int(k), order) for order, members in UNEVEN.by_order() for k in members)
    assert found == [(0, 2), (1, 5), (2, 3)]


def test_flipped_points_leave_out_the_start_and_keep_their_kind():
    flipped = Mesh(UNEVEN.boundaries, UNEVEN.orders, FLIPPED_RADAU)
    np.testing.assert_allclose(flipped.collocation, np.sort(1 - mirrored().collocation), atol=1e-15)
    assert flipped.nodes[0] == 0.0 and flipped.nodes[-1] == 1.0 and len(flipped.nodes) == 11
    np.testing.assert_array_equal(flipped.nodes[flipped.collocated], flipped.collocation)
    assert flipped.weights.sum() == pytest.approx(1, abs=1e-15)
    assert flipped.halved().rule is FLIPPED_RADAU and flipped.divided(0.2).rule is FLIPPED_RADAU


def mirrored() -> Mesh:
    """The mesh that `UNEVEN` is when it is read from its end."""
    return Mesh(1 - UNEVEN.boundaries[::-1], UNEVEN.orders[::-1])


@pytest.mark.parametrize("rule", [RADAU, FLIPPED_RADAU], ids=["Radau", "flipped Radau"])
def test_polynomials_of_an_interval_go_through_its_nodes(rule):
    mesh = Mesh(UNEVEN.boundaries, UNEVEN.orders, rule)
    values = np.vstack((mesh.nodes**2, 1 - mesh.nodes))
    places = np.linspace(0, 1, 23)
    found = mesh.interpolate_states(values, places)
    np.testing.assert_allclose(found, [places**2, 1 - places], atol=1e-14)
