"""The same flights whatever libraries choose for a processor: libm, BLAS and numpy their kernels, numba its target."""

from __future__ import annotations

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
    assert old["compiled for"] == usual["compiled for"] and not old["numpy dispatches to"]
    if FMA:
        assert old["libm"] != usual["libm"]
        assert old["blas"] != usual["blas"]


@pytest.mark.long
def test_code_compiled_for_any_x86_64(tmp_path):
    report = fly(compiled=tmp_path, NUMBA_CPU_NAME="generic", OPENBLAS_CORETYPE="Sandybridge")
    assert not changed_flights(report)
    generic, usual = report["flown on"], flown_on()
    assert generic["compiled for"] == "generic" != usual["compiled for"] and not generic["compiled with"]
    if FMA:
        assert "fma" in usual["compiled with"]
