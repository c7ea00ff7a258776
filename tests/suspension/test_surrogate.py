"""Claims about metamodels of one axle: sweeps, fits, boxes and the energy polynomial."""

import casadi
import numpy as np
import pytest

from thesislib.polynomials import basis_size
from thesislib.suspension import surrogate
from thesislib.suspension.implications import reciprocity
from thesislib.suspension.surrogate import AxleMetamodel, Sweep

HALF_TRACK = 0.73


@pytest.fixture(scope="module")
def data(reduced, heaviest):
    return surrogate.sweep(reduced, heaviest, points=21)


@pytest.fixture(scope="module")
def over_stiffness(reduced, axle, heaviest):
    K_h = axle.heave_stiffness * np.linspace(0.5, 1.5, 7)
    return surrogate.sweep(reduced, heaviest, points=11, stiffnesses=K_h)


def test_sweep_covers_the_square_of_loads(data, heaviest):
    assert data.F_l.shape == data.height.shape == (21, 21)
    assert data.box == ((heaviest, 0.0), (heaviest, 0.0))
    assert data.points.shape == (441, 2)
    assert data.points.min() == heaviest / 1e3


def test_fit_of_a_polynomial_axle_is_that_polynomial():
    F_l, F_r = np.meshgrid(np.linspace(-6e3, 0, 5), np.linspace(-6e3, 0, 5), indexing="ij")
    left, right = F_l / 1e3, F_r / 1e3
    height = 1e-3 * (-20.0 - 2.0 * (left + right) + 0.1 * left * right)
    model = surrogate.fitted(Sweep(F_l, F_r, None, height, 0.01 * (left - right)), 2)
    np.testing.assert_allclose(model.h, [-20.0, -2.0, -2.0, 0.0, 0.1, 0.0], atol=1e-12)
    np.testing.assert_allclose(model.phi, [0.0, 0.01, -0.01, 0.0, 0.0, 0.0], atol=1e-15)
    found = surrogate.misfit(model, Sweep(F_l, F_r, None, height + 1e-4, 0.01 * (left - right)))
    assert found.height == pytest.approx(1e-4)
    assert found.height_rms == pytest.approx(1e-4)
    assert found.roll < 1e-15


def test_fitted_axle_is_symmetric(data):
    model = surrogate.fitted(data, 3)
    F_l, F_r = np.random.default_rng(1).uniform(-6e3, 0.0, (2, 20))
    (h, phi), (mirrored, opposite) = model(F_l, F_r), model(F_r, F_l)
    np.testing.assert_allclose(mirrored, h, atol=1e-13)
    np.testing.assert_allclose(opposite, -phi, atol=1e-13)


def test_quadratic_is_as_good_between_the_mesh_points_as_on_them(data, reduced, heaviest):
    model = surrogate.fitted(data)
    on, off = (surrogate.misfit(model, one) for one in (data, surrogate.sweep(reduced, heaviest, points=30)))
    assert off.height < 1.05 * on.height
    assert off.roll < 1.05 * on.roll


@pytest.mark.parametrize("with_stiffness", [False, True])
def test_each_degree_more_fits_better(data, over_stiffness, with_stiffness):
    source = over_stiffness if with_stiffness else data
    errors = [surrogate.misfit(surrogate.fitted(source, degree), source) for degree in (2, 3, 4)]
    assert errors[0].height > errors[1].height > errors[2].height
    assert errors[0].height < (3e-3 if with_stiffness else 0.15e-3)


def test_metamodel_with_stiffness_has_ten_coefficients_and_meets_the_one_without(over_stiffness, axle, data):
    model = surrogate.fitted(over_stiffness)
    assert len(model.h) == basis_size(3, 2) == 10
    height, _ = model(data.F_l, data.F_r, axle.heave_stiffness)
    # a quadratic over half the stiffness to either side is good to 0.7 mm in front and 2.7 mm behind
    np.testing.assert_allclose(height, data.height, atol=3e-3)


def test_energy_polynomial_is_reciprocal_and_nearly_as_good(data):
    free, bound = surrogate.fitted(data), surrogate.reciprocal_fit(data, HALF_TRACK)
    assert reciprocity(bound, HALF_TRACK).ratio == pytest.approx(1.0, abs=1e-12)
    errors = surrogate.misfit(free, data), surrogate.misfit(bound, data)
    assert errors[1].height < 1.6 * errors[0].height
    assert errors[1].roll < 1.6 * errors[0].roll


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_energy_polynomial_of_any_degree_is_symmetric_and_reciprocal(data, degree):
    model = surrogate.reciprocal_fit(data, HALF_TRACK, degree)
    F_l, F_r, step = -2000.0, -500.0, 10.0

    def contact(left, right):
        h, phi = model(F_l + left, F_r + right)
        return np.array([-h + HALF_TRACK * phi, -h - HALF_TRACK * phi])

    left_by_right = (contact(0, step) - contact(0, -step))[0]
    right_by_left = (contact(step, 0) - contact(-step, 0))[1]
    # Psi is a polynomial of degree 5 at most: central differences miss its third derivative only
    assert left_by_right == pytest.approx(right_by_left, rel=1e-5, abs=1e-12)
    mirrored = model(F_r, F_l)
    np.testing.assert_allclose([mirrored[0], -mirrored[1]], model(F_l, F_r), atol=1e-15)


def test_energy_polynomial_takes_loads_alone(over_stiffness):
    with pytest.raises(ValueError, match="takes loads alone"):
        surrogate.reciprocal_fit(over_stiffness, HALF_TRACK)


def test_casadi_and_numpy_evaluate_the_same_metamodel(over_stiffness):
    model = surrogate.fitted(over_stiffness)
    x = casadi.SX.sym("x", 3)
    symbolic = casadi.Function("m", [x], list(model(*casadi.vertsplit(x))))
    point = (-4321.0, -1234.0, 7.5e5)
    np.testing.assert_allclose([float(one) for one in symbolic(point)], model(*point), rtol=1e-13)


def test_metamodel_knows_its_box_and_the_time_outside_it(data, heaviest):
    model = surrogate.fitted(data)
    assert model.inside([heaviest, -1.0], [-1.0, 0.0]).all()
    assert not model.inside([1.01 * heaviest, -1.0], [-1.0, 1.0]).any()
    # one sample of four is outside: half of the step before it and half of the step after it
    loads = np.array([[-1.0, -1.0], [2 * heaviest, -1.0], [-1.0, -1.0], [-1.0, -1.0]])
    assert model.time_outside([0.0, 0.2, 0.5, 1.0], loads) == pytest.approx(0.25)


def test_wrong_number_of_inputs_or_coefficients_is_refused(data):
    model = surrogate.fitted(data)
    with pytest.raises(ValueError, match="has 2 inputs, not 3"):
        model(-1.0, -1.0, 1e6)
    with pytest.raises(ValueError, match="h of the metamodel short needs 6 finite coefficients"):
        AxleMetamodel("short", 2, (1.0,) * 5, (1.0,) * 6, model.box)


@pytest.mark.parametrize(("heaviest", "points"), [(6000.0, 31), (-6000.0, 1), (0.0, 31)])
def test_mesh_that_is_none_is_refused(reduced, heaviest, points):
    with pytest.raises(ValueError, match="the heaviest load must be below zero"):
        surrogate.sweep(reduced, heaviest, points=points)
