"""Start and stop of a node process."""

from __future__ import annotations

import gc
import signal
import sys
from collections.abc import Callable, Iterator, Sequence

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation

from hsv.errors import HsvError
from hsv_node.process import ProcessNode


def run_node(build: Callable[[], ProcessNode], name: str, args: Sequence[str] | None = None) -> int:
    """Spin the node that ``build`` makes until it finishes or is interrupted; return the exit code of the process.

    Bad parameters end it before it joins the graph, with one line on standard error and exit code 2.
    """
    return run_nodes(lambda: iter([build()]), name, args)


def run_nodes(
    build: Callable[[], Iterator[ProcessNode]],
    name: str,
    args: Sequence[str] | None = None,
    executor_class: Callable[[], Executor] = EventsExecutor,
) -> int:
    """Spin several nodes with one executor, as :func:`run_node` does one, until the first of them finishes."""
    try:
        rclpy.init(args=None if args is None else list(args), signal_handler_options=rclpy.SignalHandlerOptions.NO)
    except Exception as error:  # rcl reports a malformed command line or parameter file by several exception types
        return _refuse(name, error)
    # An orderly end must never wait for a message: the handler only asks, and the loop looks four times a second.
    stop: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _frame: stop.append(received))
    nodes: list[ProcessNode] = []
    code = 0
    try:
        executor = executor_class()
        for node in build():
            nodes.append(node)
            executor.add_node(node)
        # What was imported and built stays: the collector need not look through it again in flight.
        gc.collect()
        gc.freeze()
        while not stop:
            for node in nodes:
                node.poll()
            codes = [node.exit_code for node in nodes if node.exit_code is not None]
            if codes:
                code = max(codes)
                break
            # The executor runs nothing while it waits without a limit.
            executor.spin_once(timeout_sec=min([node.wait_timeout() for node in nodes]))
        else:
            code = max([node.stopped(stop[0]) if node.exit_code is None else node.exit_code for node in nodes])
    except (HsvError, ParameterException, rclpy_implementation.RCLError) as error:
        code = _refuse(name, error)
    finally:
        for node in nodes:
            try:
                node.close()
            except HsvError as error:
                # A full disk is found out by the write that fails, and then by this one: said once.
                code = code or _refuse(name, error)
            node.destroy_node()
        rclpy.try_shutdown()
    return code


def _refuse(name: str, error: BaseException) -> int:
    print(f"{name}: error: {' '.join(str(error).split())}", file=sys.stderr, flush=True)
    return 2
