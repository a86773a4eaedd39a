"""The same flights whatever libraries choose for a processor: libm, BLAS and numpy their kernels, numba its target."""

from __future__ import annotations

from pathlib import Path

import pytest
from other_environments import fly

FMA = "fma" in Path("/proc/cpuinfo").read_text().split()
"""Where there is none, libraries have nothing to choose from."""


@pytest.fixture(scope="module")
def usual():
    return fly()


def test_libm_blas_and_numpy_as_on_an_old_processor(usual):
    dispatched = usual["flown on"]["numpy dispatches to"]
    old = fly(
        GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA",
        OPENBLAS_CORETYPE="Prescott",
        NPY_DISABLE_CPU_FEATURES=" ".join(dispatched),
    )
    assert old["fingerprints"] == usual["fingerprints"]
    if FMA:
        assert old["flown on"]["libm"] != usual["flown on"]["libm"]
        assert old["flown on"]["blas"] != usual["flown on"]["blas"]
    assert not old["flown on"]["numpy dispatches to"]


def test_code_compiled_for_any_x86_64(usual, tmp_path):
    generic = fly(compiled=tmp_path, NUMBA_CPU_NAME="generic", OPENBLAS_CORETYPE="Sandybridge")
    assert generic["fingerprints"] == usual["fingerprints"]
    assert generic["flown on"]["compiled for"] == "generic" != usual["flown on"]["compiled for"]
    assert not generic["flown on"]["compiled with"]
    if FMA:
        assert "fma" in usual["flown on"]["compiled with"]
