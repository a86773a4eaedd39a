"""Shared code of the commands on a running graph: discovery, waiting, service calls, output and exit codes."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import rclpy
from hsv_msgs.msg import Run
from rclpy.node import Node

from hsv.bags.description import PLANT, NodeDescription
from hsv.base.errors import HsvError, RunError
from hsv.base.files import json_text
from hsv.base.processes import take_signals
from hsv.graph.exclusive import is_published, ros_domain
from hsv.graph.standstill import Standstill
from hsv_node import roles
from hsv_node.middleware import LATCHED, ServiceCall
from hsv_node.process import ends_with

ABSENT_AFTER = 3.0
"""Time (s) without a change in the ROS domain after which a node that does not run on this machine counts as absent."""

SILENT_AFTER = 30.0
"""Time (s) without a change in the ROS domain after which the wait for an existing node ends."""

SETTLED_AFTER = 3.0
"""Time (s) without a change in the topics after which discovery is complete."""

MESSAGE_AFTER = 5.0
"""Time (s) of waiting before the first message about the wait, and between messages."""

_POLL = 0.1
"""Time (s) between checks of a condition."""


class GraphClient(Node):
    """A temporary node that is not part of the graph, finds the nodes of the graph and calls their services."""

    def __init__(self, name: str) -> None:
        super().__init__(f"hsv_{name}", enable_rosout=False, start_parameter_services=False)

    def find_run(self) -> Run:
        """Return the current run; raise a RunError if there is none."""
        runs: list[Run] = []
        name = self._name_of(PLANT, Run)
        if name:
            self.create_subscription(Run, name, runs.append, LATCHED)
        if not name or not self.wait_for(lambda: runs, f"a run ({name})"):
            raise RunError(f"no run in {self.where}: expected hsv run, or nodes started by hand there")
        return runs[-1]

    def name_of(self, role: NodeDescription, kind: type) -> str:
        """Return the full name of the topic or service of type ``kind`` that the node in ``role`` offers.

        Raises:
            RunError: There is no such node or service.
        """
        if name := self._name_of(role, kind):
            return name
        raise RunError(f"no {role.name} in {self.where}: expected a node that publishes {role.known_by}")

    @property
    def where(self) -> str:
        """Domain and namespace in which this node looks for a graph, as text."""
        namespace = self.get_namespace()
        return f"ROS_DOMAIN_ID={self.context.get_domain_id()}{f', namespace {namespace}' if namespace != '/' else ''}"

    def call(self, role: NodeDescription, kind: Any, request: Any) -> Any:
        """Call the service of type ``kind`` of the node in ``role``; return the response, or raise a RunError."""
        service = self.name_of(role, kind)
        call = ServiceCall(self, kind, service, request)
        if self.wait_for(call.response, service):
            return call.response()
        raise RunError(f"no answer from {service} for {SILENT_AFTER:g} s")

    def publishers_of(self, topic: str) -> list[str]:
        """Return the full names of the other nodes that publish ``topic``, as far as their names are known yet."""
        return self._others(self.get_publishers_info_by_topic(topic))

    def subscribers_of(self, topic: str) -> list[str]:
        """Return the full names of the other nodes that subscribe to ``topic``, as far as their names are known yet."""
        return self._others(self.get_subscriptions_info_by_topic(topic))

    def settle(self, enough: Callable[[], object]) -> None:
        """Wait until ``enough`` returns true, or topics and endpoints have not changed for ``SETTLED_AFTER``."""
        standstill = Standstill()
        while not enough():
            names = (name for name, _ in self.get_topic_names_and_types())
            endpoints = [(name, self.count_publishers(name), self.count_subscribers(name)) for name in names]
            if standstill.look(endpoints) >= SETTLED_AFTER:
                return
            rclpy.spin_once(self, timeout_sec=_POLL)

    def wait_for(
        self, done: Callable[[], object], what: str, published: Sequence[str] = (), for_ever: bool = False
    ) -> bool:
        """Return True once ``done`` returns a true value; False if no node joins or leaves the domain for a time limit.

        Args:
            done: Condition to wait for.
            what: Object of the wait, for the message "waiting for ...".
            published: Topics of the awaited node. The limit is ``SILENT_AFTER``, or ``ABSENT_AFTER`` as long as no
                process of this machine has published any of the given topics.
            for_ever: Whether to wait without a limit.
        """
        standstill, message_pause = Standstill(), Standstill()
        domain = self.context.get_domain_id()
        absent = bool(published)
        while not done():
            rclpy.spin_once(self, timeout_sec=_POLL)
            absent = absent and not any(is_published(domain, self.resolve_topic_name(topic)) for topic in published)
            still = standstill.look(sorted(self.get_node_names_and_namespaces()))
            if not for_ever and still > (ABSENT_AFTER if absent else SILENT_AFTER):
                return False
            if message_pause.look(None) > MESSAGE_AFTER:
                message_pause = Standstill()
                print(f"waiting for {what}", file=sys.stderr, flush=True)
        return True

    def _name_of(self, role: NodeDescription, kind: type) -> str | None:
        names: list[str | None] = []

        def found() -> bool:
            names.append(roles.name_of(self, role, kind))
            return names[-1] is not None

        return names[-1] if self.wait_for(found, f"{role.name} in {self.where}", role.own_topics) else None

    def _others(self, endpoints: Sequence[Any]) -> list[str]:
        # DDS discovers an endpoint before the name of its node.
        known = [e for e in endpoints if e.node_name not in ("_NODE_NAME_UNKNOWN_", self.get_name())]
        return sorted({roles.full_name(e.node_name, e.node_namespace) for e in known})


def run_client(name: str, act: Callable[[GraphClient, Any], None], options: Any) -> int:
    """Run the command ``name``, which calls ``act`` with ``options``, and return the exit code.

    The code is 0 after success, 1 after a RunError, such as no run, or if the reader of a pipe has ended, 2 after
    another HsvError, such as a rejected request, and 130 after Ctrl-C. An HsvError is printed on one line.
    """
    client: GraphClient | None = None
    code = 1
    try:
        take_signals(signal.default_int_handler)
        ros_domain()
        rclpy.init(signal_handler_options=rclpy.SignalHandlerOptions.NO)
        client = GraphClient(name)
        act(client, options)
        sys.stdout.flush()
        code = 0
    except KeyboardInterrupt:
        code = _refuse("interrupted", 130)
    except BrokenPipeError:
        # The reader of the pipe has ended: redirect stdout, so that Python does not fail again when it exits.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except HsvError as error:
        code = _refuse(error, 1 if isinstance(error, RunError) else 2)
    finally:
        with suppress(KeyboardInterrupt), ends_with(code):
            if client:
                client.destroy_node()
            rclpy.try_shutdown()
    return code


def answer(text: str, values: Mapping[str, Any], as_json: bool) -> None:
    """Print an answer: ``text``, or ``values`` as a JSON object on one line if ``as_json``."""
    print(json_text(values) if as_json else text, flush=True)


def acting_from(client: GraphClient, run: Run, step: int) -> tuple[str, dict[str, Any]]:
    """Return the time of ``step`` and the run as text, and ``step``, ``time_s`` and ``run_id`` as values by name.

    Raises:
        RunError: The run ends before ``step``.
    """
    if step > run.last_step:
        raise RunError(f"the run ends with step {run.last_step}: what begins at step {step} does not act any more")
    time = step * run.period
    values = {"step": step, "time_s": round(time, 9), "run_id": run.run_id}
    return f"t = {time:.2f} s (run {run.run_id[:8]}, {client.where})", values


def _refuse(problem: object, code: int) -> int:
    print(f"hsv: error: {' '.join(str(problem).split())}", file=sys.stderr, flush=True)
    return code
