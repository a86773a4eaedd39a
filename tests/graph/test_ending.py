"""A process that leaves the graph ends, even if the middleware waits for ever."""

import subprocess
import sys

import pytest
from marking import long


def run(script, environment=None):
    """Run a script that prints its answer and then leaves the graph; a time limit catches one that hangs."""
    begin = (
        "import ctypes, resource, sys, time\nfrom hsv_node.process import ends_with\nprint('the answer', flush=True)\n"
    )
    command = [sys.executable, "-c", begin + script]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment)


@pytest.mark.parametrize("code", [2, long(0), long(130)])
def test_a_process_that_waits_with_the_interpreter_locked_ends_with_its_code(code):
    # PyDLL keeps the interpreter lock while it waits for a signal, so that no Python thread or handler can run.
    done = run(f"with ends_with({code}, within=0.3): ctypes.PyDLL(None).pause()")
    assert (done.returncode, done.stdout, done.stderr) == (code, "the answer\n", "")


def test_a_process_that_has_left_in_time_goes_on():
    done = run("with ends_with(7, within=2): pass\ntime.sleep(3)\nsys.exit(3)")
    assert (done.returncode, done.stderr) == (3, "")


def test_the_exit_code_of_a_node_stands_when_ctrl_c_comes_at_the_very_end():
    done = run("""
import os, signal
from hsv.base.processes import ignore_ctrl_c_at_end, take_signals
take_signals(lambda number, frame: None)
ignore_ctrl_c_at_end()
class Last:
    def __del__(self, kill=os.kill, process=os.getpid(), number=signal.SIGINT): kill(process, number)
last = Last()
sys.exit(2)
""")
    assert (done.returncode, done.stderr) == (2, "")
