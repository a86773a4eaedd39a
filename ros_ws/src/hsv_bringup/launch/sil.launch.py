"""Launch the node graph; end with the summary, the verdict and the exit code of the flight.

ros2 launch hsv_bringup sil.launch.py scenario:=case1

This file runs under the interpreter of the ROS 2 installation, which may lack the packages of the bench. It therefore
prepares the run with the command ``hsv``, which runs under the interpreter of the build.
"""

import atexit
import difflib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, OpaqueFunction
from launch.event_handlers import OnShutdown
from launch.events import Shutdown
from launch.events.process import ProcessExited, ShutdownProcess
from launch_ros.actions import Node

from launch import Action, LaunchContext, LaunchDescription

ARGUMENTS = {
    "scenario": ("case1", "name of a shipped scenario (hsv list scenarios lists them), or path of a TOML file"),
    "bag": ("", "bag to write, a new folder; empty: bags/<scenario>_<UTC>"),
    "real_time_factor": ("", "pace: 1 is real time, 0 as fast as possible; empty: 0, with a live view 1"),
    "step_timeout": ("", "wall time (s) after which a silent node ends the run; empty: 10"),
    "paused": ("false", "true: start paused, until hsv set paused false or the live page resumes the flight"),
    "external": ("false", "true: wait for a controller that is started by hand, any node of yours"),
    "live": ("false", "true: show the flight while it is flown, on a page and to Foxglove; or false"),
    "live_port": ("", "port for Foxglove, the page has the next one; 0: any two that are free; empty: 8765"),
    "composed": ("false", "true: all nodes in one process, faster, the same bytes; or false"),
    "report": ("true", "true: write the report into the bag's folder; or false"),
    "units": ("metric", "units of summary and report: metric (SI with degrees), si, or paper for ft, ft/s, deg"),
    "log_level": ("info", "what the nodes log: debug, info, warn, error or fatal"),
    "namespace": ("/", "namespace of all nodes and topics, such as /veh1: several graphs fly in one domain"),
}
"""Default and description of each launch argument; the arguments correspond to the options of hsv run."""

FLAGS = ("composed", "external", "live", "paused")
CHOICES = {
    **dict.fromkeys((*FLAGS, "report"), ("true", "false")),
    "units": ("metric", "si", "paper"),
    "log_level": ("debug", "info", "warn", "error", "fatal"),
}

LAUNCH_OWN = ("emulate_tty", "launch-prefix", "launch-prefix-filter", "sigkill_timeout", "sigterm_timeout")
"""Arguments common to all launch files."""

GRACE = 20
"""Time (s) between SIGTERM and SIGKILL for a node; on a busy machine the recorder needs several seconds."""


class Flight:
    """The processes of one run: when a node of the flight ends, the others are stopped and the flight is concluded."""

    def __init__(self, hsv: str, run: dict[str, Any], options: dict[str, str]) -> None:
        """Store the path of the command ``hsv``, the output of ``hsv prepare``, and the launch arguments by name."""
        self._hsv, self._run, self._options = hsv, run, options
        self._running: dict[Action, dict[str, Any]] = {}
        self._ending = False
        self._failure = ""
        self._verdict = ""

    def actions(self) -> list[Action]:
        """Return the launch actions that start the nodes."""
        for node in self._run["nodes"]:
            action = Node(
                package=node["package"],
                executable=node["executable"],
                namespace=self._run["namespace"],
                parameters=self._run["parameter_files"],
                ros_arguments=["--log-level", self._options["log_level"]],
                output="screen",
                sigterm_timeout=str(GRACE),
                on_exit=self._on_exit,
            )
            self._running[action] = node
        return list(self._running)

    def _on_exit(self, event: ProcessExited, context: LaunchContext) -> list[Action]:
        node, code = self._running.pop(event.action), event.returncode
        actions = []
        # Losing a viewer does not end the flight.
        if node["in_flight"] and not self._ending:
            self._ending = True
            # The first process to end determines the outcome: the plant ends after the flight, others on a failure.
            if not (node["ends_run"] and code in self._run["landed_exit_codes"]):
                what = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
                self._failure = f"{node['name']} {what}"
            others = list(self._running)
            actions = [EmitEvent(event=ShutdownProcess(process_matcher=lambda action: action in others))]
        if not self._running and not context.is_shutdown:
            actions = [self._conclusion()]
        return actions

    def _conclusion(self) -> Action:
        options = ["--units", self._options["units"]]
        options.append("--report" if self._options["report"] == "true" else "--no-report")
        if self._failure:
            options += ["--failure", self._failure]
        command = [self._hsv, "conclude", self._run["bag"], *options]
        return ExecuteProcess(cmd=command, output="screen", on_exit=self._on_concluded)

    def _on_concluded(self, event: ProcessExited, _: LaunchContext) -> None:
        if event.returncode:
            self._verdict = f"{self._run['bag']}: {self._failure or 'the flight was lost'}"

    def on_shutdown(self, _: Shutdown, __: LaunchContext) -> None:
        """Raise a RuntimeError if ``hsv conclude`` failed, as for a lost flight; launch then ends with exit code 1."""
        verdict, self._verdict = self._verdict, ""
        if verdict:
            raise RuntimeError(verdict)


def prepare(context: LaunchContext) -> list[Action]:
    """Prepare the run and return the actions that start its nodes; end with exit code 2 on bad arguments."""
    options = {name: context.launch_configurations[name] for name in ARGUMENTS}
    if Path(__file__).name in (Path(word).name for word in sys.argv):
        # Check the command line only if this file was launched directly, not if another file includes it.
        refuse_unknown(argument.split(":=")[0] for argument in context.argv)
    folder = tempfile.mkdtemp(prefix="hsv_launch_")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    try:
        hsv = str(Path(get_package_prefix("hsv"), "bin", "hsv"))
    except PackageNotFoundError:
        refuse("package hsv is not found: expected a built and sourced workspace (make setup, then source env.sh)")
    command = [hsv, "prepare", options["scenario"], "--json", "--folder", folder]
    for name in ("real_time_factor", "live_port", "step_timeout", "namespace", "bag"):
        command += [f"--{name.replace('_', '-')}", options[name]] if options[name] else []
    command += [f"--{name}" for name in FLAGS if options[name] == "true"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        refuse(as_arguments(done.stderr.strip().removeprefix("hsv: error: ")), done.returncode)
    run = json.loads(done.stdout)
    atexit.register(remove_if_empty, run["bag"])
    flight = Flight(hsv, run, options)
    # Register it as the last handler, because launch skips the handlers after an exception.
    context.register_event_handler(OnShutdown(on_shutdown=flight.on_shutdown), append=True)
    return flight.actions()


def refuse_unknown(names: Any) -> None:
    """Refuse the first unknown argument in ``names``, which launch itself would ignore."""
    for name in names:
        if name not in (*ARGUMENTS, *LAUNCH_OWN):
            near = difflib.get_close_matches(name, ARGUMENTS, n=1)
            hint = f", did you mean {near[0]}?" if near else f": expected one of {', '.join(ARGUMENTS)}"
            refuse(f"{name}: no such argument{hint}")


def refuse(problem: str, code: int = 2) -> None:
    """End with a one-line error and exit code ``code``, or raise the error if processes are running already."""
    print(f"sil.launch.py: error: {problem}", file=sys.stderr, flush=True)
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        raise SystemExit(code) from None
    # An including file has started processes: launch ends them and exits with code 1.
    raise RuntimeError(problem)


def as_arguments(text: str) -> str:
    """Return an error ``text`` of hsv with option names (``--live-port``) as launch arguments (``live_port``)."""
    for name in ARGUMENTS:
        text = text.replace("--" + name.replace("_", "-"), name).replace(name.replace("_", "-") + " =", name + " =")
    return text


def remove_if_empty(bag: str) -> None:
    """Remove the folder of a bag to which no recorder has written."""
    with suppress(OSError):
        Path(bag).rmdir()


def generate_launch_description() -> LaunchDescription:
    """Return the launch description of the graph for a scenario."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=description, choices=CHOICES.get(name))
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=prepare)])
