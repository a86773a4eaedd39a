"""Real node processes for the graph tests: starting, finding and stopping them."""

import signal
import subprocess
from contextlib import suppress
from pathlib import Path

import psutil
from waiting import output_of, wait_until

from hsv.bags.reader import Bag
from hsv.base.errors import RecordingError

SHORT = """
title = "a short Case 1"
duration = "{duration} s"

[vehicle]
coupling = "{coupling}"

[initial]
altitude = "85500 ft"
velocity = "7900 ft/s"

[[command]]
altitude_change = "600 ft"
velocity_change = "250 ft/s"

[notch]
enabled = {notch}

[[fault]]
channel = "elevator_deflection"
type = "loss_of_effectiveness"
effectiveness = 0.9
start = "{fault} s"
"""


def short_scenario(folder, duration=5, fault=3, coupling="paper_like", notch=True):
    """Write a shortened Case 1 and return its path."""
    path = folder / "short.toml"
    path.write_text(SHORT.format(duration=duration, fault=fault, coupling=coupling, notch=str(notch).lower()))
    return path


class Processes:
    """A starter of processes, which can also stop all that it has started."""

    def __init__(self, environment, folder):
        self.environment = environment
        self.folder = folder
        self._started = []

    def start(self, *command, output=subprocess.PIPE):
        """Start a command with its output in a pipe, or in ``output``."""
        popen = subprocess.Popen(
            [str(word) for word in command],
            cwd=self.folder,
            env=self.environment,
            stdout=output,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._started.append(popen)
        return popen

    def run(self, *command):
        """Run a command to its end and return exit code and output."""
        popen = self.start(*command)
        output = output_of(popen)
        return subprocess.CompletedProcess(popen.args, popen.returncode, output)

    def fly(self, scenario, name, *words):
        """Fly a scenario by ``hsv run`` and return its bag ``name``."""
        # On a busy machine a node may be silent for longer than the default time limit.
        command = ("hsv", "run", scenario, "--no-report", "--step-timeout", "30", "--bag", self.folder / name)
        done = self.run(*command, *words)
        assert done.returncode == 0, done.stdout
        return Bag(self.folder / name)

    def stop(self):
        """Stop the processes that still run."""
        for number in (signal.SIGINT, signal.SIGKILL):
            running = [popen for popen in self._started if popen.poll() is None]
            for popen in running:
                popen.send_signal(number)
            with suppress(AssertionError):
                wait_until(lambda: all(popen.poll() is not None for popen in self._started), [p.pid for p in running])


def recorded_steps(bag):
    """Return the number of steps that a bag has on disk."""
    try:
        return len(Bag(bag).times("hsv/state"))
    except RecordingError:
        return 0  # the bag does not exist yet


def fly_until(flight, bag, steps):
    """Wait until ``steps`` steps of a flight are on disk.

    Raises:
        AssertionError: The flight has ended before.
    """

    def flown():
        assert flight.poll() is None, flight.communicate()[0]
        return recorded_steps(bag) >= steps

    wait_until(flown, [flight.pid], lambda: recorded_steps(bag))


def children(pid):
    """Return the node processes below ``hsv run`` with process id ``pid``, by executable name."""
    found = {}
    for child in psutil.Process(pid).children():
        with suppress(psutil.Error):
            words = child.cmdline()
            if "--ros-args" in words:
                found[Path(words[words.index("--ros-args") - 1]).name] = child.pid
    return found


def last_line(done):
    """Return the last printed line of a command.

    Earlier lines may report waiting, or that Fast DDS takes another port of its shared memory. The names of these ports
    are the same in all domains of a machine, and another process may hold one.
    """
    *before, last = done.stdout.splitlines()
    others = [line for line in before if "Failed init_port fastrtps_port" not in line]
    assert all(line.startswith("waiting for ") for line in others), done.stdout
    return str(last)
