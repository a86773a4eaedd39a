"""A repeatable controller, and one that depends on its process.

Spawned processes find them here: a package named tests, which rtamt installs, hides the tests themselves.
"""

import os
from types import SimpleNamespace

import numpy as np


class Steady:
    """Feedback with an integral of the pitch angle, which reset clears."""

    PARAMETERS = ()

    @classmethod
    def from_parameters(cls, values, design):
        return cls()

    def __init__(self):
        self.memory = SimpleNamespace(integral=0.0)

    def reset(self):
        self.memory.integral = 0.0

    def step(self, inputs):
        self.memory.integral += 0.02 * (inputs.estimate[3] - inputs.reference[3])
        return inputs.reference_input + np.array([0.0, 0.05 * self.memory.integral + self.more(inputs)])

    def more(self, inputs):
        return 0.0


class OfTheProcess(Steady):
    """Depends on the process that it runs in."""

    def more(self, inputs):
        return 1e-12 * os.getpid()
