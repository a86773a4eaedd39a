from pathlib import Path

import numpy as np
import pytest

from hsv.control.notch_filter import NotchSection
from hsv.design.inputs import read_inputs
from hsv.design.model import design_model
from hsv.model.vehicle import load_vehicle

OFFLINE_DESIGN = Path(__file__).parents[2] / "offline_design"


@pytest.fixture(scope="module")
def model(inputs):
    return design_model(inputs.model, load_vehicle())


def test_tensor_product_has_the_paper_s_vertices_and_meets_its_accuracy(model):
    accuracy = model.report["accuracy"]
    assert model.report["vertices"] == [4, 5]
    assert accuracy["points"] == 46 * 46
    assert accuracy["relative_frobenius_error"] < 1e-8
    assert accuracy["bode_magnitude_error_db"] < 1e-3
    assert accuracy["bode_phase_error_deg"] < 0.01
    assert accuracy["smallest_weight"] >= -1e-9
    assert accuracy["weight_sum_error"] <= 1e-9


def test_vertices_have_the_unstable_pole_of_the_vehicle(model):
    # Control study, section 1: 1.64 to 1.81 rad/s at the vertices.
    radii = [np.log(np.abs(np.linalg.eigvals(A)).max()) / 0.02 for A in model.polytope.A]
    assert min(radii) > 1.63 and max(radii) < 1.82
    # The matrix exponential leaves rounding where the rigid states do not depend on the elastic ones.
    assert np.abs(model.polytope.A[:, :5, 5:]).max() < 1e-15


def test_grid_is_the_simple_and_less_accurate_alternative(inputs):
    model = design_model(inputs.model.model_copy(update={"representation": "grid"}), load_vehicle())
    assert model.found.interpolation == "linear"
    assert model.report["vertices"] == [4, 5]
    assert 1e-6 < model.report["accuracy"]["relative_frobenius_error"] < 1e-4


@pytest.fixture(scope="module")
def codesign():
    return read_inputs(OFFLINE_DESIGN / "adjustable.toml")


@pytest.mark.long
def test_codesigned_model_keeps_six_vertices_and_agrees_with_the_ecm(codesign):
    notch = sections(codesign)
    model = design_model(codesign.model, load_vehicle(), notch)
    accuracy = model.report["accuracy"]
    assert model.report["vertices"] == [2, 3]
    assert accuracy["relative_frobenius_error"] < 5e-5
    assert accuracy["bode_magnitude_error_db"] < 0.3
    assert accuracy["bode_phase_error_deg"] < 1.5
    assert accuracy["smallest_weight"] >= -1e-9
    assert model.whole.A.shape == (6, 11, 11) and model.polytope.A.shape == (6, 9, 9)


def sections(inputs):
    return tuple(NotchSection(**section.model_dump()) for section in inputs.notch)
