"""Shared code of the commands that act on a running graph: discovery, waiting, replies and exit."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, NoReturn

import rclpy
from hsv_msgs.msg import Run
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from hsv.bags.description import PLANT, NodeDescription
from hsv.base.errors import HsvError, RunError
from hsv.base.files import json_text
from hsv.graph.exclusive import is_published
from hsv.graph.standstill import Standstill
from hsv_node import roles
from hsv_node.main import take_signals
from hsv_node.middleware import LATCHED, type_name
from hsv_node.process import ends_with

ABSENT_AFTER = 3.0
"""Seconds without a change in the ROS domain after which nobody is looked for who is not on this machine."""

SILENT_AFTER = 30.0
"""Seconds without a change in the ROS domain after which somebody who is there, or may be, is given up."""

SETTLED_AFTER = 3.0
"""Seconds without a change in the topics after which all that there are are known."""

WHOLE_AFTER = 1.0
"""The same where all nodes of a graph are known."""

SAY_AFTER = 5.0
"""Seconds of waiting before the first message about it, and between messages."""

INTERRUPTED = 130

_UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
"""Name that rmw reports for a node whose endpoint is known but whose name is not yet."""

_LOOK = 0.1


class GraphClient(Node):
    """A node that is not of the graph: it asks, and is gone."""

    def __init__(self, name: str) -> None:
        super().__init__(f"hsv_{name}", enable_rosout=False, start_parameter_services=False)

    def find_run(self) -> Run:
        """Return the run of the plant that is there.

        Raises:
            RunError: There is none.
        """
        runs: list[Run] = []
        name = self._name_of(PLANT, roles.published, Run)
        if name:
            self.create_subscription(Run, name, runs.append, LATCHED)
        if not name or not self.wait_for(lambda: runs, f"a run ({name})"):
            raise RunError(f"no run in {self.where}: expected hsv run, or nodes started by hand there")
        return runs[-1]

    def topic_of(self, role: NodeDescription, kind: type) -> str:
        """Return the full name of the topic of a type that the node of the graph in ``role`` publishes.

        Raises:
            RunError: There is no such node.
        """
        return self._name_of(role, roles.published, kind) or self._refuse_absent(role)

    @property
    def where(self) -> str:
        """The domain and namespace in which this node looks for a graph."""
        namespace = self.get_namespace()
        return f"ROS_DOMAIN_ID={self.context.get_domain_id()}{f', namespace {namespace}' if namespace != '/' else ''}"

    def call(self, role: NodeDescription, kind: Any, request: Any) -> Any:
        """Return the reply of a service, by its type, of the node of the graph in ``role``.

        Raises:
            RunError: There is no such node, or it does not answer.
        """
        service = self._name_of(role, roles.services, kind) or self._refuse_absent(role)
        client = self.create_client(kind, service)
        if self.wait_for(client.service_is_ready, service):
            future = client.call_async(request)
            if self.wait_for(future.done, service):
                return future.result()
        raise RunError(f"no answer from {service} for {SILENT_AFTER:g} s")

    def publishers_of(self, topic: str) -> list[str]:
        """Return the full names of the known nodes that publish ``topic``, except this one."""
        return self._others(self.get_publishers_info_by_topic(topic))

    def subscribers_of(self, topic: str) -> list[str]:
        """Return the full names of the known nodes that subscribe ``topic``, except this one."""
        return self._others(self.get_subscriptions_info_by_topic(topic))

    def settle(self, whole: Callable[[], object], enough: Callable[[], object]) -> None:
        """Wait until nothing new comes for a while, a shorter one where the graph is ``whole``, or there is ``enough``.

        Beside a whole graph there are others that take part in its topics: a recorder, or who watches.
        """
        standstill = Standstill()
        while not enough():
            still = standstill.look(self._endpoints())
            if still >= (WHOLE_AFTER if whole() else SETTLED_AFTER):
                return
            rclpy.spin_once(self, timeout_sec=_LOOK)

    def _endpoints(self) -> list[tuple[str, int, int]]:
        names = (name for name, _ in self.get_topic_names_and_types())
        return [(name, self.count_publishers(name), self.count_subscribers(name)) for name in names]

    def wait_for(
        self, done: Callable[[], object], what: str, published: Sequence[str] = (), for_ever: bool = False
    ) -> bool:
        """Wait until ``done``; return whether it is.

        Args:
            done: Condition to wait for.
            what: Name of the condition in messages.
            published: Where somebody has to be there, what he publishes. Who does on this machine may take his time;
                otherwise nobody is long looked for.
            for_ever: Whether to wait however long nothing changes.
        """
        standstill, says = Standstill(), Standstill()
        absent = bool(published)
        while not done():
            rclpy.spin_once(self, timeout_sec=_LOOK)
            if absent:
                absent = not any(
                    is_published(self.context.get_domain_id(), self.resolve_topic_name(topic)) for topic in published
                )
            still = standstill.look(sorted(self.get_node_names_and_namespaces()))
            if not for_ever and still > (ABSENT_AFTER if absent else SILENT_AFTER):
                return False
            if says.look(None) > SAY_AFTER:
                says = Standstill()
                print(f"waiting for {what}", file=sys.stderr, flush=True)
        return True

    def _name_of(
        self, role: NodeDescription, offers: Callable[[Node, str, str], Mapping[str, Sequence[str]]], kind: type
    ) -> str | None:
        """Return what the node in ``role`` calls that of its ``offers`` which is of a type, None without a node."""
        names: list[str] = []

        def found() -> bool:
            node = roles.node_in_role(self, role)
            offered = offers(self, *node) if node else {}
            names[:] = [name for name, kinds in offered.items() if type_name(kind) in kinds]
            return bool(names)

        return names[0] if self.wait_for(found, f"{role.name} in {self.where}", role.own_topics) else None

    def _refuse_absent(self, role: NodeDescription) -> NoReturn:
        raise RunError(f"no {role.name} in {self.where}: expected a node that publishes {role.known_by}")

    def _others(self, endpoints: Sequence[Any]) -> list[str]:
        # An endpoint is known sooner than its node.
        known = [e for e in endpoints if e.node_name not in (_UNKNOWN_NODE, self.get_name())]
        return sorted({roles.full_name(e.node_name, e.node_namespace) for e in known})


class OneLineParser(argparse.ArgumentParser):
    """Refuses wrong words in one line."""

    def error(self, message: str) -> NoReturn:
        """End with exit code 2."""
        self.exit(2, f"{self.prog}: error: {message} (see {self.prog} --help)\n")


class _Prog(argparse.Action):
    """Name of the command for its user, such as ``hsv set``, which precedes error messages."""

    def __call__(self, parser: argparse.ArgumentParser, _options: argparse.Namespace, values: Any, *_: object) -> None:
        parser.prog = values


def run_client(
    parser: argparse.ArgumentParser,
    act: Callable[[GraphClient, argparse.Namespace], None],
    args: Sequence[str] | None = None,
) -> int:
    """Run a command and return its exit code: 1 without a run, 2 if rejected, with one line each."""
    given = list(sys.argv if args is None else args)
    name = parser.prog
    parser.add_argument("--prog", action=_Prog, help=argparse.SUPPRESS)
    options = parser.parse_args(remove_ros_args(given)[1:])
    clients: list[GraphClient] = []
    code = 1
    try:
        take_signals(signal.default_int_handler)
        rclpy.init(args=given, signal_handler_options=rclpy.SignalHandlerOptions.NO)
        clients.append(GraphClient(name))
        act(clients[0], options)
        sys.stdout.flush()
        code = 0
    except KeyboardInterrupt:
        code = _refuse(parser.prog, "interrupted", INTERRUPTED)
    except BrokenPipeError:
        # Nobody reads any more: Python must not find that out a second time at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 1
    except HsvError as error:
        code = _refuse(parser.prog, error, 1 if isinstance(error, RunError) else 2)
    finally:
        with suppress(KeyboardInterrupt), ends_with(code):
            for client in clients:
                client.destroy_node()
            rclpy.try_shutdown()
    return code


def answer(text: str, values: Mapping[str, Any], as_json: bool) -> None:
    """Print an answer: ``text`` for people, ``values`` as a JSON object on one line for programs."""
    print(json_text(values) if as_json else text, flush=True)


def acting_from(run: Run, step: int) -> tuple[str, dict[str, Any]]:
    """Return from which time on something acts that begins at ``step``, in words and as numbers.

    Raises:
        RunError: The run will have ended before.
    """
    if step > run.last_step:
        raise RunError(f"the run ends with step {run.last_step}: what begins at step {step} does not act any more")
    time = step * run.period
    return f"t = {time:.2f} s", {"step": step, "time_s": round(time, 9)}


def _refuse(name: str, problem: object, code: int) -> int:
    print(f"{name}: error: {' '.join(str(problem).split())}", file=sys.stderr, flush=True)
    return code
