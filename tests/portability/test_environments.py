"""The same flights on other processors, Pythons and packages, as "make test-portability" prepares them.

They take minutes, as everything is compiled afresh by emulated processors; ``make test`` leaves them out.
"""

from __future__ import annotations

import pytest
from other_environments import changed_flights, fly

from portability import Environment

# In this order, because two workers are given two tests each: the emulated ones, which take longest, side by side.
pytestmark = pytest.mark.portability


def flown(name, compiled, **variables):
    environment = Environment.read(name)
    if environment is None:
        pytest.skip(f"no environment {name}: make test-portability prepares it")
    return fly(environment, compiled, **variables)


def test_x86_64_without_avx_and_fma(tmp_path):
    report = flown("nehalem", tmp_path)
    processor = report["flown on"]
    assert (processor["machine"], processor["compiled for"]) == ("x86_64", "nehalem")
    assert not {"avx", "avx2", "fma"} & {*processor["compiled with"]} and not processor["numpy dispatches to"]
    assert not changed_flights(report)


def test_python_3_12(tmp_path):
    report = flown("python-3.12", tmp_path)
    assert report["flown on"]["python"].startswith("3.12.")
    assert not changed_flights(report)


def test_aarch64(tmp_path):
    report = flown("aarch64", tmp_path, NUMBA_CPU_NAME="generic")
    assert (report["flown on"]["machine"], report["flown on"]["compiled for"]) == ("aarch64", "generic")
    assert not changed_flights(report)


def test_numpy_1_26(tmp_path):
    report = flown("numpy-1.26", tmp_path)
    assert report["flown on"]["numpy"].startswith("1.26.")
    assert not changed_flights(report)
