"""The same flights on other processors, Pythons and packages, as "make test-portability" prepares them.

The emulated processors are slow; ``make test`` leaves them out.
"""

from __future__ import annotations

import pytest
from other_environments import changed_flights, fly

from portability import Environment

pytestmark = pytest.mark.portability


# In this order, because two workers are given two tests each: the emulated ones, which take longest, side by side.
@pytest.mark.parametrize(
    ("name", "field", "begins"),
    [
        ("nehalem", "instruction set", "sse2"),
        ("python-3.12", "python", "3.12."),
        ("aarch64", "machine", "aarch64"),
        ("numpy-1.26", "numpy", "1.26."),
    ],
)
def test_flights_are_as_published(name, field, begins):
    environment = Environment.read(name)
    if environment is None:
        pytest.skip(f"no environment {name}: make test-portability prepares it")
    report = fly(environment)
    assert report["flown on"][field].startswith(begins)
    assert name != "nehalem" or not report["flown on"]["numpy dispatches to"]
    assert not changed_flights(report)
