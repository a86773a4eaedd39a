"""What the set-up compiles is all that commands need."""

import os
import subprocess
import sys

import pytest


@pytest.mark.long
def test_after_the_set_up_no_command_compiles(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "caches"), "XDG_CACHE_HOME": str(tmp_path / "kept")}

    def kept():
        return {path.name for path in (tmp_path / "caches").rglob("*") if path.is_file()}

    subprocess.run([sys.executable, "-m", "hsv.warm"], env=environment, check=True)
    before = kept()
    assert "ahead_of_time.json" in before and not any(name.endswith((".nbi", ".nbc")) for name in before)
    for words in (
        ("trim",),
        ("simulate", "case1"),
        ("simulate", "case1_realistic"),
        ("simulate", "case1_active"),
        ("montecarlo", "case1", "--samples", "40", "--workers", "1"),
    ):
        subprocess.run(["hsv", *words], env=environment, cwd=tmp_path, check=True)
        assert kept() == before, words
    # Another checkout takes the library, and compiles nothing: there is no compiler.
    another = {**environment, "NUMBA_CACHE_DIR": str(tmp_path / "another"), "CC": "/nowhere"}
    subprocess.run([sys.executable, "-m", "hsv.warm"], env=another, check=True)
    for name in before:
        assert (tmp_path / "another" / name).read_bytes() == (tmp_path / "caches" / name).read_bytes()


@pytest.mark.parametrize("setting", ["no folder for caches", "NUMBA_DISABLE_JIT"])
def test_commands_run_where_nothing_is_kept_or_compiled(setting, tmp_path):
    environment = {**os.environ, "HOME": "/proc", "NUMBA_CACHE_DIR": "/proc"}
    if setting == "NUMBA_DISABLE_JIT":
        environment = {**os.environ, setting: "1"}
    program = "import numpy as np; from hsv.elementary import sine; print(sine(0.5), np.sin(0.5))"
    ran = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    ours, other = map(float, ran.stdout.split())
    assert ours == pytest.approx(other, rel=1e-15)
