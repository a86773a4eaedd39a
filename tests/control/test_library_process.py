"""Memory that two processes have: it grows, and keeps what it holds."""

import os

import numpy as np
from numpy.testing import assert_array_equal

from hsv.control.library_process import SharedMemory


def test_shared_memory_grows_and_keeps_what_it_holds():
    memory = SharedMemory()
    memory.numbers(3)[:] = [1.0, 2.0, 3.0]
    assert_array_equal(memory.numbers(2), [1.0, 2.0])
    assert_array_equal(memory.numbers(1000), [1.0, 2.0, 3.0, *np.zeros(997)])
    other = SharedMemory(os.dup(memory.descriptor))
    other.numbers(1000)[999] = 4.0
    assert memory.numbers(1000)[999] == 4.0
