"""A process that leaves the graph ends, even where the middleware waits for ever."""

from __future__ import annotations

import subprocess
import sys

import pytest


def run(script: str) -> subprocess.CompletedProcess[str]:
    """Run a script that has said its answer and then leaves; one that hung would fail here."""
    begin = "import ctypes, sys, time\nfrom hsv_node.ending import ends_with\nprint('the answer', flush=True)\n"
    return subprocess.run([sys.executable, "-c", begin + script], capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("code", [0, 2, 130])
def test_a_process_that_waits_with_the_interpreter_locked_ends_with_its_code(code):
    # PyDLL keeps the lock while it waits for a signal: no thread and no handler of Python's runs any more.
    done = run(f"with ends_with({code}, within=0.3): ctypes.PyDLL(None).pause()")
    assert (done.returncode, done.stdout, done.stderr) == (code, "the answer\n", "")


def test_a_process_that_has_left_in_time_goes_on():
    done = run("with ends_with(7, within=0.3): pass\ntime.sleep(1)\nsys.exit(3)")
    assert (done.returncode, done.stderr) == (3, "")


def test_an_error_is_not_hidden():
    done = run("with ends_with(0): raise ValueError('lost')")
    assert done.returncode == 1 and "ValueError: lost" in done.stderr
