"""Claims about the description of an axle: what is read from its file, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from thesislib import provenance
from thesislib.suspension import Axle, GeometryError


def test_files_hold_millimetres_and_the_axle_metres(front):
    np.testing.assert_allclose(front.wheel_centre, [0.0, -0.73, 0.0])
    assert front.heave_stiffness == 1.0e6
    assert front.pinion_radius == pytest.approx(0.012)


def test_link_lengths_of_the_file_are_the_distances_of_its_points(axle):
    apart = np.linalg.norm(axle.inner_ends - axle.carrier, axis=1)
    np.testing.assert_allclose(axle.link_lengths, apart, atol=1e-9)  # the file has nanometres


def test_lengths_follow_from_the_points_if_none_are_given(front):
    derived = replace(front, link_lengths=np.array([]))
    np.testing.assert_allclose(derived.link_lengths, front.link_lengths, atol=1e-9)


def test_other_springs_leave_everything_else(front):
    softer = front.with_springs(heave_stiffness=5e5, anti_roll_stiffness=100.0)
    assert (softer.heave_stiffness, softer.anti_roll_stiffness) == (5e5, 100.0)
    assert softer.torsion_preload == front.torsion_preload
    np.testing.assert_array_equal(softer.chassis, front.chassis)


@pytest.mark.parametrize("spring", ["heave_stiffness", "torsion_stiffness", "anti_roll_stiffness"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_spring_without_stiffness_is_refused_by_name(front, spring, value):
    with pytest.raises(GeometryError, match=rf"front axle: {spring} = .* (above zero|not a finite number)"):
        front.with_springs(**{spring: value})


def test_what_is_no_spring_is_not_changed_as_one(front):
    with pytest.raises(TypeError, match="carrier_mass is no spring"):
        front.with_springs(carrier_mass=30.0)


def moved(front, **changes):
    """The front axle with other points, their link lengths left to follow."""
    return replace(front, link_lengths=np.array([]), **changes)


def test_link_of_another_length_than_its_ends_allow_is_refused(front):
    lengths = front.link_lengths.copy()
    lengths[4] += 2e-6
    with pytest.raises(
        GeometryError, match=r"the track rod is 461\.\d+ mm long, but its ends are 461\.\d+ mm"
    ):
        replace(front, link_lengths=lengths)


def test_wishbone_with_aligned_arms_is_refused(front):
    chassis = front.chassis.copy()
    chassis[1] = front.carrier[0] + 0.5 * (chassis[0] - front.carrier[0])
    with pytest.raises(GeometryError, match="two arms of the upper wishbone are aligned"):
        moved(front, chassis=chassis)


def test_links_that_do_not_hold_the_wheel_are_refused(front):
    # rods that meet the line through the wishbones' outer joints cannot keep the wheel from turning about it
    carrier = front.carrier.copy()
    carrier[4] = 0.5 * (carrier[0] + carrier[2])
    carrier[5] = 0.2 * carrier[0] + 0.8 * carrier[2]
    with pytest.raises(GeometryError, match="six links do not hold the wheel carrier"):
        moved(front, carrier=carrier)


def test_axis_that_is_no_unit_vector_is_refused(front):
    with pytest.raises(GeometryError, match=r"rocker_axis has length 1\.1 and must be a unit vector"):
        replace(front, rocker_axis=np.array([1.1, 0.0, 0.0]))


def test_rod_that_passes_through_the_rockers_axis_is_refused(front):
    rod_end = front.pivot + 0.1 * (front.carrier[5] - front.pivot)
    with pytest.raises(GeometryError, match=r"the push rod passes \S+ mm from the rocker's axis"):
        moved(front, rod_end=rod_end)


def test_heave_spring_that_passes_through_the_rockers_axis_is_refused(front):
    with pytest.raises(GeometryError, match=r"the heave spring passes \S+ mm from the rocker's axis"):
        replace(front, spring_end=front.pivot + np.array([0.0, 0.05, 0.0]))


def test_right_hand_points_are_refused(front):
    with pytest.raises(GeometryError, match="left side need y < 0"):
        moved(front, wheel_centre=np.array([0.0, 0.73, 0.0]))


def test_travel_without_the_design_position_is_refused(front):
    with pytest.raises(GeometryError, match="must hold the design position"):
        replace(front, travel=(0.01, 0.05))


def test_unknown_axle_is_refused():
    with pytest.raises(FileNotFoundError, match="no axle third_axle"):
        Axle.from_file("third_axle")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass_kg = 23", "", r"\[wheel\] has no mass_kg"),
        ("mass_kg = 23", "mass_kg = 23\nmas_kg = 3", r"\[wheel\] has an unknown entry mas_kg"),
        ("mass_kg = 23", "mass_kg = nan", r"carrier_mass = nan is not a finite number"),
        ("stiffness_kN_per_m = 1000", "stiffness_kN_per_m = 0", r"heave_stiffness = 0 must be above zero"),
        ("damping_kNs_per_m = 8", "damping_kNs_per_m = -8", r"heave_damping = -8000 is below zero"),
        ("centre_mm = [0.000, ", "centre_mm = [", r"wheel_centre needs finite numbers of shape \(3,\)"),
    ],
)
def test_bad_file_is_refused_in_a_sentence(tmp_path, old, new, message):
    source = provenance.project_root() / "data" / "suspension" / "front_axle.toml"
    text = source.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "axle.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(GeometryError, match=message):
        Axle.from_file(path)
