import copy
import tomllib
from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.design.inputs import parse_inputs, read_inputs

OFFLINE_DESIGN = Path(__file__).parents[2] / "offline_design"


@pytest.fixture
def table():
    return tomllib.loads((OFFLINE_DESIGN / "baseline.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", sorted(OFFLINE_DESIGN.glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_inputs_load_and_carry_their_name(path):
    assert read_inputs(path).name == path.stem


def test_quantities_are_converted(inputs):
    assert_allclose(inputs.feedback.state_scale.array(), [6.096, 3.048, 0.05, 0.05, 0.2])
    assert_allclose(inputs.nominal.start.altitude, 26060.4)


def test_two_designs_differ_only_in_name_description_and_scales():
    one, family = (read_inputs(OFFLINE_DESIGN / f"{n}.toml").model_dump() for n in ("baseline_single_k", "baseline"))
    for inputs in (one, family):
        del inputs["name"], inputs["description"], inputs["nominal"]["scales"]
    assert one == family


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("feedback.state_scale.altitude", "20 s", "feedback.state_scale.altitude = '20 s': wrong unit"),
        ("feedback.state_scale.altitude", 20.0, "feedback.state_scale.altitude = 20.0: the unit is missing"),
        (
            "feedback.state_scale.altitude",
            "-20 ft",
            "feedback.state_scale.altitude = '-20 ft': input should be greater",
        ),
        ("model.period", "nan s", "model.period = 'nan s'"),
        ("model.representation", "lucky", "model.representation = 'lucky': input should be"),
        ("model.tensor_product.tolerance", 0.0, "model.tensor_product.tolerance = 0.0: input should be greater than 0"),
        (
            "model.grid.altitude_vertices",
            1,
            "model.grid.altitude_vertices = 1: input should be greater than or equal to 2",
        ),
        ("model.grid.altitude_vertices", 4.5, "model.grid.altitude_vertices = 4.5"),
        ("feedback.method", "lucky", "feedback.method = 'lucky': input should be 'guaranteed_cost' or"),
        ("nominal.scales", [1.0, float("nan")], "nominal.scales.1 = nan"),
        ("nominal.input_bound.elevator", "5 deg", "nominal.input_bound.elevator: unknown field"),
    ],
)
def test_a_wrong_field_is_named(table, path, value, message):
    *parents, leaf = path.split(".")
    changed = copy.deepcopy(table)
    branch = changed
    for parent in parents:
        branch = branch[parent]
    branch[leaf] = value
    with pytest.raises(DesignError) as caught:
        parse_inputs(changed)
    assert str(caught.value).startswith(message)


def test_a_missing_field_is_named(table):
    del table["nominal"]["target"]["velocity"]
    with pytest.raises(DesignError, match=r"nominal.target.velocity: missing"):
        parse_inputs(table)


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(DesignError, match=r"absent.toml: cannot be read"):
        read_inputs(tmp_path / "absent.toml")
    broken = tmp_path / "broken.toml"
    broken.write_text("name = ")
    with pytest.raises(DesignError, match=r"broken.toml.*in TOML"):
        read_inputs(broken)
