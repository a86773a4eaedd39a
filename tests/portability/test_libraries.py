"""The same flights whatever kernels libm, BLAS and numpy choose for a processor, and whatever instructions the core."""

from __future__ import annotations

import platform
from pathlib import Path

import pytest
from flight_fingerprints import flown_on
from other_environments import changed_flights, fly

FMA = "fma" in Path("/proc/cpuinfo").read_text().split()
"""Where there is none, libraries have nothing to choose from."""


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
