"""The same flights on other processors, Pythons and packages, and with other kernels of libraries."""

from __future__ import annotations

import platform
from pathlib import Path

import pytest
from flight_fingerprints import flown_on
from other_environments import changed_flights, fly

from portability import Environment


# Slow, so that make test leaves them out. In this order, two workers with two tests each run the emulated processors,
# the slowest, side by side.
@pytest.mark.portability
@pytest.mark.parametrize(
    ("name", "field", "begins"),
    [
        ("nehalem", "instruction set", "sse2"),
        ("python-3.12", "python", "3.12."),
        ("aarch64", "machine", "aarch64"),
        ("numpy-1.26", "numpy", "1.26."),
        ("zig", "compiler", "clang"),
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


FMA = "fma" in Path("/proc/cpuinfo").read_text().split()
"""Without FMA, libraries have no choice of kernels."""


def test_libm_blas_and_numpy_as_on_an_old_processor():
    usual = flown_on()
    report = fly(
        GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA",
        OPENBLAS_CORETYPE="Prescott",
        NPY_DISABLE_CPU_FEATURES=" ".join(usual["numpy dispatches to"]),
    )
    assert not changed_flights(report)
    old = report["flown on"]
    assert old["instruction set"] == usual["instruction set"] and not old["numpy dispatches to"]
    if FMA:
        assert old["libm"] != usual["libm"]
        assert old["blas"] != usual["blas"]


@pytest.mark.skipif(platform.machine() != "x86_64", reason="another machine has other instructions")
def test_the_core_for_any_x86_64():
    report = fly(HSV_CORE="sse2", OPENBLAS_CORETYPE="Sandybridge")
    assert not changed_flights(report)
    assert report["flown on"]["instruction set"] == "sse2"
