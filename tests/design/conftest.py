from pathlib import Path

import pytest

from hsv.design.certified import load_certified
from hsv.design.inputs import read_inputs
from hsv.design.model import polytopic_model
from hsv.model.vehicle import load_vehicle

OFFLINE_DESIGN = Path(__file__).parents[2] / "offline_design"


@pytest.fixture(scope="session")
def inputs():
    return read_inputs(OFFLINE_DESIGN / "baseline.toml")


@pytest.fixture(scope="session")
def model(inputs):
    return polytopic_model(inputs.model, load_vehicle())


@pytest.fixture(scope="session")
def design(subject):
    """Return the shipped baseline, which stands for a newly computed one; the long run checks that they agree."""
    return subject.design


@pytest.fixture(scope="session")
def report(subject):
    return subject.certificate


@pytest.fixture(scope="session")
def subject():
    return load_certified(OFFLINE_DESIGN / "baseline.yaml")


@pytest.fixture(scope="session")
def found(subject):
    return subject.invariant_set()
