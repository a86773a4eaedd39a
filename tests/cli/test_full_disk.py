"""A full disk, or output that no process reads: a one-line message, exit code 2, and no partial file."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from full_disk import files_no_larger_than
from marking import long
from recorded_flight import record_flight

FULL = Path("/dev/full")


def command(*words, out, buffered=True):
    """Run the command in its own process, because what Python does at exit matters, too."""
    environment = os.environ | {"PYTHONUNBUFFERED": "" if buffered else "1"}
    ran = subprocess.run(
        [sys.executable, "-m", "hsv.cli.entry", *words], stdout=out, stderr=subprocess.PIPE, text=True, env=environment
    )
    return ran.returncode, ran.stderr


@pytest.mark.parametrize(
    ("words", "buffered"), [(("trim",), True), long(("trim", "--json"), False), long(("--help",), True)]
)
def test_output_that_finds_no_space_is_one_line(words, buffered):
    with FULL.open("w") as full:
        code, error = command(*words, out=full, buffered=buffered)
    assert (code, error) == (2, "hsv: error: output: cannot be written (No space left on device)\n")


@pytest.mark.long
def test_a_reader_that_has_gone_is_told_nothing():
    reading, writing = os.pipe()
    os.close(reading)
    try:
        assert command("trim", out=writing) == (1, "")
    finally:
        os.close(writing)


def test_histories_that_do_not_fit(hsv, tmp_path):
    with files_no_larger_than(50_000):
        ran = hsv("simulate", "case1", "--out", "flight.npz")
    assert ran.code == 2
    assert ran.error == "out = 'flight.npz': cannot be written (File too large)"
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return str(record_flight(tmp_path_factory.mktemp("bags") / "flight", duration=2.0, fault=1.0).path.parent)


@pytest.mark.parametrize("form", ["csv", long("parquet"), long("npz")])
def test_an_export_that_does_not_fit_is_not_in_the_way_of_the_next(hsv, tmp_path, bag, form):
    words = ("export", bag, f"--{form}", "--out", "table")
    with files_no_larger_than(2_000):
        ran = hsv(*words)
    assert ran.code == 2
    assert ran.error == "out = 'table': cannot be written: File too large"
    assert not list(tmp_path.iterdir())
    assert hsv(*words).code == 0
