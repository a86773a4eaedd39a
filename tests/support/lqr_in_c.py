"""The regulator of examples/lqr, whose step is a C function that the bench calls by its address."""

import numpy as np
from c_libraries import step_function
from hsv_lqr import Lqr

from hsv.control.controller import StepKernel


class LqrInC(Lqr):
    @property
    def kernel(self):
        parameters = np.concatenate(([self.period], self.minimum, self.maximum, self.gain.ravel()))
        return StepKernel(step_function("lqr"), np.zeros(2), parameters)
