"""A process that leaves the graph ends, even where the middleware waits for ever."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from marking import long

from hsv.graph.standstill import HUNG_AFTER
from hsv_node.process import LEAVE_WITHIN


def run(script: str, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """Run a script that has said its answer and then leaves; one that hung would fail here."""
    begin = (
        "import ctypes, resource, sys, time\nfrom hsv_node.process import ends_with\nprint('the answer', flush=True)\n"
    )
    command = [sys.executable, "-c", begin + script]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment)


@pytest.mark.parametrize("code", [2, long(0), long(130)])
def test_a_process_that_waits_with_the_interpreter_locked_ends_with_its_code(code):
    # PyDLL keeps the lock while it waits for a signal: no thread and no handler of Python's runs any more.
    done = run(f"with ends_with({code}, within=0.3): ctypes.PyDLL(None).pause()")
    assert (done.returncode, done.stdout, done.stderr) == (code, "the answer\n", "")


def test_a_process_that_has_left_in_time_goes_on():
    done = run("with ends_with(7, within=2): pass\ntime.sleep(3)\nsys.exit(3)")
    assert (done.returncode, done.stderr) == (3, "")


def test_an_error_is_not_hidden():
    done = run("with ends_with(0): raise ValueError('lost')")
    assert done.returncode == 1 and "ValueError: lost" in done.stderr


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


def test_a_node_that_cannot_leave_is_ended_before_it_is_said_to_hang():
    assert LEAVE_WITHIN < HUNG_AFTER


SPY = """
from contextlib import contextmanager
from pathlib import Path
import json
import hsv_bringup.client, hsv_node.main
from hsv.base.errors import ParameterError
from hsv_bringup.client import OneLineParser, run_client
from hsv_bringup.flow_executor import BatchExecutor, FlowExecutor
from hsv_node.main import EventsExecutor, run_node
from hsv_node.process import ProcessNode

def participants():
    # Each has a thread for its events.
    return sum((thread / "comm").read_text().startswith("dds.ev.") for thread in Path("/proc/self/task").iterdir())

seen = {}

@contextmanager
def spy(code):
    seen.update(code=code, before=participants())
    with ends_with(code):
        yield
    seen["after"] = participants()

hsv_bringup.client.ends_with = hsv_node.main.ends_with = spy

class Short(ProcessNode):
    def __init__(self):
        super().__init__("short")
        self.polls = 0

    def poll(self):
        self.polls += 1
        if self.polls == 3:
            self.finish(4)

class Refused(ProcessNode):
    def __init__(self):
        super().__init__("refused")
        self.itself = self
        raise ParameterError("parameter gain = 0: expected more")

def ask(client, options):
    raise ParameterError("no")
"""
"""What leaving has seen: the exit code that it was given, and the middleware's participants before and after it."""


@pytest.mark.graph
@pytest.mark.parametrize(
    ("leave", "code"),
    [
        ("run_node(Short, 'short', ['short'], EventsExecutor)", 4),
        *[long(f"run_node(Short, 'short', ['short'], {name}Executor)", 4) for name in ("Batch", "Flow")],
        long("run_node(Refused, 'refused', ['refused'])", 2),
        ("run_client(OneLineParser(prog='ask'), ask, ['ask'])", 2),
    ],
)
def test_the_middleware_is_left_while_the_timer_runs(ros_environment, leave, code):
    done = run(f"{SPY}\nreturned = {leave}\nprint(json.dumps(seen))\nsys.exit(returned)", ros_environment)
    seen = json.loads(done.stdout.splitlines()[-1])
    assert done.returncode == seen["code"] == code
    assert (seen["before"], seen["after"]) == (1, 0)
