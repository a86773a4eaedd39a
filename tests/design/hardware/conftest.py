from pathlib import Path

import numpy as np
import pytest

from hsv.design.certified import Plan, load_certified
from hsv.design.disturbance import DisturbanceSet
from hsv.design.tube_problem import tube_problem


@pytest.fixture(scope="session")
def problem(subject):
    return tube_problem(subject.design, subject.vehicle, DisturbanceSet(-np.ones(7), np.ones(7)))


@pytest.fixture(scope="session")
def plan(subject):
    return Plan.of(subject)


@pytest.fixture(scope="session")
def realistic():
    return load_certified(Path(__file__).parents[3] / "offline_design" / "realistic.yaml")
