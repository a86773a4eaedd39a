"""Builds of the core with sanitizers, other compilers and optimisation levels: golden flights keep their bits."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src" / "hsv"
MINUTES = 10
"""Processor time of the random calls of the core"""
STRICT = "-Wall -Wextra -Werror"

PROGRAM = """
import json, sys
sys.path[:0] = ["{tests}/flight", "{tests}/support"]
from test_golden_flights import LINES, compare_three_ways
import hsv.core
assert hsv.core.__file__.startswith({folder!r}), hsv.core.__file__
compare_three_ways(range({first}, len(LINES), {stride}))
print(hsv.core.instruction_set())
"""


def build(folder, compiler="", flags=""):
    """Build the package with its core from a copy of the sources; return the folder to import it from."""
    copy, library = folder / "hsv", folder / "library"
    shutil.copytree(SOURCES, copy, ignore=shutil.ignore_patterns("*.so", "build", "*.egg-info", "__pycache__"))
    command = [sys.executable, "setup.py", "-q", "build", "--build-base", str(folder / "base"), "--build-lib", library]
    chosen = {"CC": compiler, "LDSHARED": f"{compiler} -shared"} if compiler else {}
    environment = os.environ | {"HSV_CFLAGS": flags} | chosen
    built = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr[-3000:]
    return library


def fly(library, first, stride, **environment):
    """Fly golden flights in three ways with the core of a build; return the instruction set that it used."""
    program = PROGRAM.format(tests=ROOT / "tests", folder=str(library), first=first, stride=stride)
    environment = os.environ | {"PYTHONPATH": str(library)} | environment
    flown = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert (flown.returncode, flown.stderr) == (0, ""), flown.stderr[-3000:]
    return flown.stdout.strip()


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory):
    """Return the folder of a build with both sanitizers, and the variables with which it is imported."""
    library = build(
        tmp_path_factory.mktemp("sanitized"), "gcc", "-O1 -fsanitize=address,undefined -fno-sanitize-recover=all"
    )
    runtime = subprocess.run(["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=True)
    # Python and numpy do not free all memory at exit.
    return library, {"LD_PRELOAD": runtime.stdout.strip(), "ASAN_OPTIONS": "detect_leaks=0"}


@pytest.mark.long
def test_all_flights_and_the_binding_under_the_sanitizers(sanitized):
    library, environment = sanitized
    fly(library, 0, 5, **environment)
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/core/test_binding.py"]
    environment = os.environ | environment | {"PYTHONPATH": str(library)}
    tested = subprocess.run(words, env=environment, cwd=ROOT, capture_output=True, text=True)
    assert tested.returncode == 0, tested.stdout[-3000:]


@pytest.mark.long
def test_random_numbers_in_all_data_of_the_core_under_the_sanitizers(sanitized):
    library, environment = sanitized
    path = os.pathsep.join(map(str, (library, ROOT / "tests" / "support", ROOT / "tests" / "flight")))
    words = [sys.executable, ROOT / "tests" / "support" / "fuzzed_core.py", str(MINUTES * 60)]
    environment = os.environ | environment | {"PYTHONPATH": path}
    ran = subprocess.run(words, env=environment, capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (0, "") and int(ran.stdout) > 0, ran.stderr[-3000:]


@pytest.mark.long
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("level", ["-O0", "-O3"])
def test_any_compiler_and_level_of_optimisation_gives_the_same_bits(tmp_path, compiler, level):
    if not shutil.which(compiler):
        pytest.skip(f"no {compiler}")
    library = build(tmp_path, compiler, f"{level} {STRICT} -Wno-unused-parameter -Wno-missing-field-initializers")
    widest = fly(library, 3, 30)
    for instructions in ("sse2", "avx2", "avx512"):
        if instructions <= widest or instructions == "sse2":
            assert fly(library, 3, 30, HSV_CORE=instructions) == instructions


def test_the_core_compiles_without_warnings():
    for source in sorted((SOURCES / "hsv" / "core").glob("[a-z]*.c")):
        command = ["gcc", "-std=gnu99", "-fsyntax-only", "-ffp-contract=off", "-Wno-psabi", *STRICT.split(), source]
        compiled = subprocess.run(command, capture_output=True, text=True)
        assert (compiled.returncode, compiled.stderr) == (0, ""), source
