"""The shipped designs come out alike on processors that round differently, here emulated: `make test-long`."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

DESIGNS = sorted(path.stem for path in Path(__file__).parents[2].glob("offline_design/*.toml"))

AGREED = 1e-4
"""In scaled coordinates; `hsv design --check` itself asks for ten times less."""

WITHOUT_FMA = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA"}
PROCESSORS = {
    "Haswell, two threads": {"OPENBLAS_CORETYPE": "Haswell", "OPENBLAS_NUM_THREADS": "2"},
    "Nehalem, libm without FMA": {"OPENBLAS_CORETYPE": "Nehalem", "OPENBLAS_NUM_THREADS": "1"} | WITHOUT_FMA,
}


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("processor", PROCESSORS)
@pytest.mark.parametrize("name", DESIGNS)
def test_a_shipped_design_comes_out_as_shipped(name, processor):
    words = [sys.executable, "-m", "hsv.cli.entry", "design", name, "--check", "--json"]
    ran = subprocess.run(words, env=os.environ | PROCESSORS[processor], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    found = {d["parameter"]: d["scaled"] for d in json.loads(ran.stdout)["deviations"]}
    assert {parameter: scaled for parameter, scaled in found.items() if scaled > AGREED} == {}
