from pathlib import Path

import pytest

from hsv.design.baseline import design_gains
from hsv.design.inputs import read_inputs

OFFLINE_DESIGN = Path(__file__).parents[2] / "offline_design"


@pytest.fixture(scope="session")
def inputs():
    return read_inputs(OFFLINE_DESIGN / "baseline.toml")


@pytest.fixture(scope="session")
def result(inputs):
    return design_gains(inputs)


@pytest.fixture(scope="session")
def design(result):
    return result.design
