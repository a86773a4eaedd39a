"""The same flights on other processors, Pythons and packages, as "make test-portability" prepares them.

The emulated processors are slow; ``make test`` leaves them out.
"""

from __future__ import annotations

import pytest
from other_environments import changed_flights, fly

from portability import Environment

# In this order, because two workers are given two tests each: the emulated ones, which take longest, side by side.
pytestmark = pytest.mark.portability


def flown(name):
    environment = Environment.read(name)
    if environment is None:
        pytest.skip(f"no environment {name}: make test-portability prepares it")
    return fly(environment)


def test_x86_64_without_avx_and_fma():
    report = flown("nehalem")
    processor = report["flown on"]
    assert (processor["machine"], processor["instruction set"]) == ("x86_64", "sse2")
    assert not processor["numpy dispatches to"]
    assert not changed_flights(report)


def test_python_3_12():
    report = flown("python-3.12")
    assert report["flown on"]["python"].startswith("3.12.")
    assert not changed_flights(report)


def test_aarch64():
    report = flown("aarch64")
    assert report["flown on"]["machine"] == "aarch64"
    assert not changed_flights(report)


def test_numpy_1_26():
    report = flown("numpy-1.26")
    assert report["flown on"]["numpy"].startswith("1.26.")
    assert not changed_flights(report)
