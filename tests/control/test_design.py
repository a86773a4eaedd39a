"""Control designs: their files, parameters, bounds and tau."""

import copy
import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import DesignError, ParameterError
from hsv.control.design import ControlDesign, certified, digest, scheduled_changes
from hsv.control.design_file import find_design, find_file, read_design, read_parameters, write_design

DESIGNS = sorted((Path(__file__).parents[2] / "offline_design").glob("*.yaml"))
VALUES = read_parameters(find_design("baseline"))
ARRAYS = [name for name, value in VALUES.items() if isinstance(value, list)]


def with_entry(name, index, value):
    changed = copy.deepcopy(VALUES)
    changed[name][index] = value
    return changed


@pytest.mark.parametrize("path", DESIGNS, ids=lambda path: path.stem)
def test_every_shipped_design_loads_unmodified(path):
    design = read_design(path)
    assert design.name == path.stem
    assert not design.modified


def test_design_survives_writing_and_reading_bit_for_bit(tmp_path):
    design = ControlDesign.from_parameters(VALUES)
    path = tmp_path / "copy.yaml"
    write_design(path, design, "a comment\nof two lines")
    assert path.read_text().startswith("# a comment\n# of two lines\n")
    assert read_parameters(path) == design.to_parameters() == VALUES
    again = read_design(path)
    assert_array_equal(again.polytope.A, design.polytope.A)
    assert_array_equal(again.nominal_ellipsoids, design.nominal_ellipsoids)


def test_a_changed_number_shows_as_modified():
    design = ControlDesign.from_parameters(with_entry("feedback.gain", 0, VALUES["feedback.gain"][0] * (1 + 1e-12)))
    assert design.modified
    assert digest(VALUES) == VALUES["design.hash"]


@pytest.mark.parametrize("name", ARRAYS)
def test_an_entry_that_is_no_finite_double_is_named(name):
    with pytest.raises(DesignError) as caught:
        ControlDesign.from_parameters(with_entry(name, 0, math.nan))
    assert str(caught.value).startswith(f"parameter {name}[0] = nan: expected double array")


@pytest.mark.parametrize("name", ARRAYS)
def test_an_array_of_wrong_length_is_named(name):
    for changed in ([*VALUES[name], VALUES[name][-1]], VALUES[name][:-1]):
        with pytest.raises(DesignError) as caught:
            ControlDesign.from_parameters({**VALUES, name: changed})
        # Breakpoints and weights belong together, as do the columns of the notch filter.
        group = name.rpartition(".")[0]
        assert f"parameter {group}." in str(caught.value)
        assert "expected" in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"period": 1}, "period = 1: expected double"),
        ({"design.name": 3}, "design.name = 3: expected string"),
        ({"scheduling.interpolation": "quintic"}, "scheduling.interpolation = 'quintic': expected one of"),
        ({"input.minimum": VALUES["input.maximum"]}, "input.minimum: expected values below input.maximum"),
        ({"nominal.ellipsoids": VALUES["nominal.ellipsoids"][25:]}, "nominal.ellipsoids: 6 matrices, expected one per"),
        ({"nominal.input_minimum": []}, "nominal.input_minimum: 0 values, expected"),
        ({"nominal.region_maximum": [1.0] * 6}, "nominal.region_maximum: 6 values, expected"),
        ({"feedback.tau": [0.6], "feedback.tau_minimum": [0.7]}, "feedback.tau = 0.6: expected 0.7 to 1"),
        ({"feedback.tau_minimum": [0.0]}, "feedback.tau_minimum = [0.0]: expected values above zero"),
        ({"feedback.tau_minimum": [0.5, 0.5]}, "feedback.tau_minimum: 2 values, expected 1 or 5"),
        ({"feedback.tau": [0.05], "feedback.tau_minimum": [0.05]}, "feedback.tau: spectral radius "),
        ({"tube.shape": [-entry for entry in VALUES["tube.shape"]]}, "tube.shape"),
    ],
)
def test_a_wrong_parameter_is_named(changes, message):
    with pytest.raises(DesignError) as caught:
        ControlDesign.from_parameters(VALUES | changes)
    assert str(caught.value).startswith(f"parameter {message}")


@pytest.mark.parametrize("name", ["feedback.gain", "nominal.gains"])
@pytest.mark.parametrize("factor", [0.0, 100.0, 1e306])
def test_a_gain_that_does_not_stabilise_is_refused_with_its_spectral_radius(name, factor):
    changed = {**VALUES, name: [factor * entry for entry in VALUES[name]]}
    with pytest.raises(
        DesignError, match=rf"parameter {name}: spectral radius (\d+\.\d+|inf) of the closed loop at vertex"
    ):
        ControlDesign.from_parameters(changed)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (None, "cannot be read (No such file or directory), expected a parameter file"),
        (b"", "expected ROS 2 parameters"),
        (b"/**:\n  ros__parameters:\n    a: [1.0,\n", "while parsing"),
    ],
)
def test_a_file_that_is_no_parameter_file_is_named_in_one_line(tmp_path, content, problem):
    path = tmp_path / "design.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DesignError) as caught:
        read_parameters(path)
    message = str(caught.value)
    assert message.startswith(f"design {str(path)!r}")
    assert problem in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("    period: ", "    perriod: ", "parameter perriod: unknown, expected those of a design (did you mean"),
        ("    period: 0.02", "    period: 0.02\n    design.name: b", "parameter design.name occurs twice"),
        ("half_width: [12.9", "half_width: [-12.9", "parameter tube.half_width = [-12.9"),
    ],
)
def test_what_a_design_must_not_have_is_named(tmp_path, old, new, problem):
    path, text = tmp_path / "mine.yaml", find_design("baseline").read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    with pytest.raises(DesignError) as caught:
        read_design(path)
    assert problem in str(caught.value) and str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_designs_are_found_by_name_and_by_path(tmp_path, monkeypatch):
    monkeypatch.setenv("HSV_DESIGN_PATH", str(tmp_path))
    own = tmp_path / "own.yaml"
    own.write_text("x")
    assert find_design("own") == own
    assert find_design(str(own)) == own
    assert find_design("baseline").name == "baseline.yaml"
    assert find_file("baseline", ".toml").name == "baseline.toml"
    with pytest.raises(DesignError, match=r"design = 'absent': no such file, expected the path of a .yaml file"):
        find_design("absent")


def test_factors_and_filtered_nominal_survive_the_parameter_file_and_are_left_out_where_they_say_nothing():
    design = read_design(find_design("baseline"))
    assert not {"feedback.tau", "feedback.tau_minimum", "nominal.filtered"} & design.to_parameters().keys()
    tau, minimum = np.array([0.8, 0.8, 0.9, 0.9, 1.0]), np.array([0.5, 0.5, 0.75, 0.75, 1.0])
    adjusted = dataclasses.replace(design, tau=tau, tau_minimum=minimum, filtered=True)
    values = adjusted.to_parameters()
    again = ControlDesign.from_parameters(values)
    assert not again.modified and again.filtered
    assert again.tau.tolist() == tau.tolist() and again.tau_minimum.tolist() == minimum.tolist()
    # Another tau in the certified range is no modification; another range is.
    assert not ControlDesign.from_parameters(values | {"feedback.tau": minimum.tolist()}).modified
    assert ControlDesign.from_parameters(values | {"feedback.tau_minimum": tau.tolist()}).modified


def test_both_bounds_hold_for_a_plan():
    bounds = read_design(find_design("baseline")).plan_bounds
    assert_allclose(bounds.lower, bounds.region_minimum[:2])
    assert_allclose(bounds.upper, bounds.region_maximum[:2])
    assert (bounds.lower > bounds.input_minimum).all() and (bounds.upper < bounds.input_maximum).all()
    low, high = bounds.pitch_acceleration
    assert low < 0.0 < high


def test_a_design_without_a_tube_carries_none():
    names = ("nominal.input_m", "nominal.region", "tube.")
    without = {n: v for n, v in VALUES.items() if not n.startswith(names)}
    assert ControlDesign.from_parameters(without).plan_bounds is None


SCALAR, DIAGONAL = np.full(5, 0.8), np.array([0.8, 0.6, 1.0, 1.0, 1.0])


def test_a_change_has_one_value_or_five():
    flown = {"tau_change.starts": [1.0, 2.0]}
    for values in ([0.9, 0.8], [0.9] * 5 + [0.8] * 5):
        (first, nine), (second, eight) = scheduled_changes(flown | {"tau_change.values": values}, SCALAR, 0.02)
        assert (first, second) == (50, 100)
        np.testing.assert_array_equal([nine, eight], [np.full(5, 0.9), np.full(5, 0.8)])
    for count in (1, 3, 5, 7):
        with pytest.raises(ParameterError, match=rf"tau_change\.values: {count} values, expected 2 or 10"):
            scheduled_changes(flown | {"tau_change.values": [0.9] * count}, SCALAR, 0.02)


@pytest.mark.parametrize(
    ("values", "minimum", "message"),
    [
        ([0.79], SCALAR, r"feedback\.tau = 0\.79: expected 0\.8 to 1"),
        ([1.0, 0.7, 1.0, 1.0, 1.0], SCALAR, r"feedback\.tau\[1\] = 0\.7: expected 0\.8 to 1"),
        ([0.8, 1.0, 1.0, 1.0, 1.0], DIAGONAL, "all the same share of the way from 1"),
        ([0.9], DIAGONAL, r"feedback\.tau = \[0\.9, .*the way from 1 to \[0\.8, 0\.6, 1\.0, 1\.0, 1\.0\]"),
        ([0.9], np.ones(5), "expected 1: no other factor is certified"),
    ],
)
def test_what_is_not_certified_is_refused(values, minimum, message):
    with pytest.raises(ParameterError, match=message):
        certified(values, minimum)
