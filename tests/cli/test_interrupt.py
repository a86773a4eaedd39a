"""Ctrl-C, which a terminal sends to all processes of a command: one line, exit code 130, no process left."""

import os
import signal
import subprocess
import time
from pathlib import Path

import psutil
import pytest
from marking import long
from ros_domain import own_environment

from hsv.cli.main import EXIT_CODES

INTERRUPTED = next(code for code, meaning in EXIT_CODES.items() if meaning == "interrupted")

DESIGNS = Path(__file__).parents[2] / "offline_design"

COMMANDS = [
    "design baseline",
    "check tube_mpc",
    "montecarlo case1 --samples 2000",
    "montecarlo case1 --samples 2000 --scheduler 127.0.0.1:9",
    "resilience --controllers case1 --faults elevator_loss",
    "bench --only in_process",
    "certify baseline.yaml",
    "run case1 --live --live-port 0",
]


def ignores_ctrl_c(process):
    """Return whether a child process ignores Ctrl-C, as at the end of Python, or has ended as a zombie."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    fields = dict(line.split(":", 1) for line in lines)
    return fields["State"].split()[0] == "Z" or bool(int(fields["SigIgn"], 16) & 1 << signal.SIGINT - 1)


@pytest.mark.parametrize(
    ("words", "delay"),
    [
        long("run case1", 0.05),
        ("run case1", 0.4),
        *(long(words, delay) for words in COMMANDS for delay in (0.2, 2.0, 7.0)),
    ],
)
def test_ctrl_c_is_one_line_and_leaves_no_process(tmp_path, words, delay):
    for name in ("baseline.yaml", "baseline.certificate.json"):
        (tmp_path / name).symlink_to(DESIGNS / name)
    with own_environment() as environment:
        marked = environment | {"HSV_INTERRUPTED": str(tmp_path)}
        command = ["hsv", *words.split(), *(["--out", "mine.yaml"] if words.startswith("design") else [])]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        popen = subprocess.Popen(command, cwd=tmp_path, env=marked, start_new_session=True, **pipes)
        time.sleep(delay)
        done = popen.poll() is not None
        if not done:
            os.killpg(popen.pid, signal.SIGINT)
            done = ignores_ctrl_c(popen.pid)
        said = popen.communicate()[1].splitlines()
        if done and popen.returncode == 0:
            pytest.skip("done before it was interrupted")
        # Earlier lines may have been printed, such as the estimated time. Python may print nothing of its own.
        assert popen.returncode == INTERRUPTED
        assert said[-1].startswith("hsv: error: interrupted")
        assert not [line for line in said if "Traceback" in line or "KeyboardInterrupt" in line]
        left = [each.info["environ"] or {} for each in psutil.process_iter(["environ"])]
        assert not [found for found in left if found.get("HSV_INTERRUPTED") == str(tmp_path)]
