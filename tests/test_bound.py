"""Compiled functions whose arguments are looked at once."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
from numba import njit

from hsv.bound import bound
from hsv.vehicle.envelope import in_model_range


@njit
def scaled(x: Any, factor: float, offset: Any = None) -> float:
    """Return the scaled sum of ``x``, plus an offset where there is one."""
    total = 0.0
    for value in x:
        total += factor * value
    return total if offset is None else total + offset


def test_a_bound_function_gives_what_the_function_gives():
    x = np.array([1.0, 2.0, 4.0])
    assert bound(scaled, x, 0.5, None)(x, 0.5, None) == scaled(x, 0.5) == 3.5
    assert bound(scaled, x, 0.5, 1.0)(x, 0.5, 2.0) == 5.5


def test_an_argument_as_by_default_is_compiled_as_if_left_out():
    x = np.ones(2)
    scaled(x, 1.0)
    before = len(scaled.overloads)
    bound(scaled, x, 1.0, None)
    assert len(scaled.overloads) == before


def test_what_is_not_compiled_is_returned_as_it_is():
    assert bound(scaled.py_func, np.ones(1), 1.0, None) is scaled.py_func


def test_a_bound_function_travels_to_another_process():
    state = np.arange(9.0)
    sent = pickle.loads(pickle.dumps(bound(in_model_range, state, 0.5)))
    assert sent(state, 0.5) == in_model_range(state, 0.5)
