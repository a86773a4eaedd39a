import numpy as np
import pytest

from hsv.design.disturbance import DisturbanceSet
from hsv.design.tube_problem import tube_problem
from hsv.design.verification.plan import Plan


@pytest.fixture(scope="session")
def problem(subject):
    return tube_problem(subject.design, subject.vehicle, DisturbanceSet(-np.ones(7), np.ones(7)))


@pytest.fixture(scope="session")
def plan(subject):
    return Plan.of(subject)
