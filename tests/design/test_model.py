"""The polytopic model of a design, and linear matrix inequalities whose solution does not depend on rounding."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hsv.base.errors import DesignError
from hsv.control.notch_filter import NotchSection
from hsv.design.baseline import initial_deviation, nominal_problem
from hsv.design.inputs import read_inputs
from hsv.design.model import design_model
from hsv.lmi.nominal_gain import nominal_gain
from hsv.lmi.semidefinite import BOUND_DIGITS, GAP, Unknown, minimise, outward, rounded_to_size
from hsv.model.vehicle import load_vehicle

OFFLINE_DESIGN = Path(__file__).parents[2] / "offline_design"


@pytest.fixture(scope="module")
def designed(inputs):
    return design_model(inputs.model, load_vehicle())


def test_tensor_product_has_the_paper_s_vertices_and_meets_its_accuracy(designed):
    accuracy = designed.report["accuracy"]
    assert designed.report["vertices"] == [4, 5]
    assert accuracy["points"] == 46 * 46
    assert accuracy["relative_frobenius_error"] < 1e-8
    assert accuracy["bode_magnitude_error_db"] < 1e-3
    assert accuracy["bode_phase_error_deg"] < 0.01
    assert accuracy["smallest_weight"] >= -1e-9
    assert accuracy["weight_sum_error"] <= 1e-9


def test_vertices_have_the_unstable_pole_of_the_vehicle(designed):
    # Control study, section 1: the pole is 1.64 to 1.81 rad/s at the vertices.
    radii = [np.log(np.abs(np.linalg.eigvals(A)).max()) / 0.02 for A in designed.polytope.A]
    assert min(radii) > 1.63 and max(radii) < 1.82
    # Where rigid states do not depend on elastic ones, the matrix exponential leaves rounding errors.
    assert np.abs(designed.polytope.A[:, :5, 5:]).max() < 1e-15


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


def test_the_cost_is_above_its_optimum_by_the_gap():
    # The minimum of t x - log(x - 3) is at x = 3 + 1 / t.
    (x,) = minimise([Unknown((1, 1))], lambda x: x[0, 0], lambda x: [x - 3.0], "scalar")
    assert GAP / 2.0 < x[0, 0] / 3.0 - 1.0 < 2.0 * GAP


def test_what_has_no_solution_is_refused_by_name():
    with pytest.raises(DesignError, match="nothing: status"):
        minimise([Unknown((1, 1))], lambda x: x[0, 0], lambda x: [x - 1.0, 0.5 - x], "nothing")


def test_nominal_gain_hardly_moves_with_the_rounding_of_vertices(inputs, model):
    # Without regularisation the optimum is so flat that entries of the gain moved by 88 % between two processors.
    problem = nominal_problem(inputs, model.polytope, inputs.nominal.input_bound.array())
    state = 0.2 * initial_deviation(inputs)
    noise = np.random.default_rng(1).uniform(-1e-10, 1e-10, problem.A.shape)
    scale = problem.state_scale
    moved = dataclasses.replace(problem, A=problem.A + noise * scale[:, None] / scale)
    one, other = nominal_gain(problem, state), nominal_gain(moved, state)
    size = problem.input_scale[:, None] / scale
    assert np.abs((one.K - other.K) / size).max() < 1e-5
    diagonal = np.sqrt(np.diag(one.Q))
    assert np.abs((one.Q - other.Q) / np.outer(diagonal, diagonal)).max() < 1e-5


def test_digits_are_counted_from_the_size_not_the_value():
    values = np.array([12.3456789, 0.00123456, 1e-9, -1e-9])
    assert rounded_to_size(values, 10.0, 4).tolist() == [12.346, 0.001, 0.0, 0.0]
    assert not np.signbit(rounded_to_size(values, 10.0, 4)).any()
    assert rounded_to_size(values, [10.0, 0.001, 1e-9, 1e-9], 1).tolist() == [12.0, 0.0012, 1e-9, -1e-9]


@given(st.floats(1e-12, 1e12), st.sampled_from([-1.0, 1.0]))
@example(1.000000000001, -1.0)  # above the rounded bound by less than the margin
def test_bounds_grow_by_no_more_than_their_last_digit(size, sign):
    value = outward(np.array([sign * size]))[0]
    assert np.sign(value) == sign
    # The margin of outward, and 1 % of it for the rounding of these operations, about 5e-16.
    assert -1.01e-12 <= abs(value) / size - 1.0 <= 10.0 ** (1 - BOUND_DIGITS)
    assert outward(np.array([value]))[0] == value
