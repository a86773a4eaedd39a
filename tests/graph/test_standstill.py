"""A standstill: nothing changes and no processor time is used; a slow process does not count as one."""

import os
import signal
import subprocess
import sys
import time

from hsv.graph import standstill as module
from hsv.graph.standstill import Standstill, processor_time


def test_time_counts_while_nothing_changes_and_a_gap_between_looks_little(monkeypatch):
    now = 100.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now)
    standstill = Standstill()
    assert standstill.look("a") == 0.0
    for expected in (0.5, 1.0, 1.5):
        now += 0.5
        assert standstill.look("a") == expected
    now += 60.0
    # This process did not run for a minute; the others may not have run either, so the gap does not count.
    assert standstill.look("a") == 2.5
    now += 0.5
    assert standstill.look("b") == 0.0


LOOKS_AROUND = "import time\nprint(flush=True)\nwhile True: time.sleep(0.05)"


def test_processor_time_grows_for_a_process_that_looks_around_and_not_for_a_stopped_one():
    with subprocess.Popen([sys.executable, "-c", LOOKS_AROUND], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        before = used = processor_time(process.pid)
        assert before is not None and before > 0.0
        while used == before:
            time.sleep(0.01)
            used = processor_time(process.pid)
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        stopped = processor_time(process.pid)
        time.sleep(0.3)
        assert processor_time(process.pid) == stopped
        process.kill()
    assert processor_time(process.pid) is None
