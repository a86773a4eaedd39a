import copy
import tomllib
from pathlib import Path

import pytest

from hsv.base.errors import DesignError
from hsv.design.inputs import parse_inputs, read_inputs

OFFLINE_DESIGN = Path(__file__).parents[2] / "offline_design"


@pytest.fixture
def table():
    return tomllib.loads((OFFLINE_DESIGN / "baseline.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", sorted(OFFLINE_DESIGN.glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_inputs_load_and_carry_their_name(path):
    assert read_inputs(path).name == path.stem


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("feedback.state_scale.altitude", "20 s", "feedback.state_scale.altitude = '20 s': wrong unit"),
        ("feedback.state_scale.altitude", "-20 ft", "feedback.state_scale.altitude = '-20 ft': input should be"),
        ("model.representation", "lucky", "model.representation = 'lucky': input should be"),
        ("model.grid.altitude_vertices", 1, "model.grid.altitude_vertices = 1: input should be greater than or equal"),
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
