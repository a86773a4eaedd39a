import numpy as np
import pytest

from hsv.design.model import design_model
from hsv.lpv.hull import smallest_weight
from hsv.vehicle.parameters import vehicle_parameters


@pytest.fixture(scope="module")
def model(inputs):
    return design_model(inputs.model, vehicle_parameters("decoupled"))


def with_representation(inputs, **changes):
    return inputs.model.model_copy(update=changes)


def test_tensor_product_has_the_paper_s_vertices_and_meets_its_accuracy(model):
    accuracy = model.report["accuracy"]
    assert model.report["vertices"] == [4, 5]
    assert accuracy["points"] == 46 * 46
    assert accuracy["relative_frobenius_error"] < 1e-8
    assert accuracy["bode_magnitude_error_db"] < 1e-3
    assert accuracy["bode_phase_error_deg"] < 0.01
    assert accuracy["smallest_weight"] >= -1e-9
    assert accuracy["weight_sum_error"] <= 1e-9


def test_weights_are_non_negative_between_all_samples(model):
    for samples in (model.altitude_samples, model.velocity_samples):
        assert smallest_weight(*samples) >= -1e-9
        assert np.abs(samples[1].sum(axis=1) - 1.0).max() <= 1e-9


def test_vertices_have_the_unstable_pole_of_the_vehicle(model):
    # Control study, section 1: 1.64 to 1.81 rad/s at the vertices.
    radii = [np.log(np.abs(np.linalg.eigvals(A)).max()) / 0.02 for A in model.polytope.A]
    assert min(radii) > 1.63 and max(radii) < 1.82
    # The matrix exponential leaves rounding where the rigid states do not depend on the elastic ones.
    assert np.abs(model.polytope.A[:, :5, 5:]).max() < 1e-15


def test_a_coarser_tolerance_keeps_six_vertices(inputs):
    coarse = inputs.model.tensor_product.model_copy(update={"tolerance": 1e-5})
    model = design_model(with_representation(inputs, tensor_product=coarse), vehicle_parameters("decoupled"))
    assert model.report["vertices"] == [2, 3]
    assert model.report["accuracy"]["relative_frobenius_error"] < 5e-5
    assert model.report["accuracy"]["bode_magnitude_error_db"] < 0.3


def test_grid_is_the_simple_and_less_accurate_alternative(inputs):
    model = design_model(with_representation(inputs, representation="grid"), vehicle_parameters("decoupled"))
    assert model.interpolation == "linear"
    assert model.report["vertices"] == [4, 5]
    assert 1e-6 < model.report["accuracy"]["relative_frobenius_error"] < 1e-4
