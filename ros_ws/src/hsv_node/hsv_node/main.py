"""Start and stop of a node process."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import pairwise

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.utilities import remove_ros_args

from hsv.base.errors import HsvError, ParameterError
from hsv.base.processes import choose_log_folder, ignore_ctrl_c_at_end, take_signals
from hsv.graph.exclusive import ros_domain
from hsv_node.middleware import prefer_profiles
from hsv_node.process import ProcessNode, ends_with


def run_node(
    build: Callable[[], ProcessNode | Iterable[ProcessNode]],
    name: str,
    args: Sequence[str] | None = None,
    executor_class: Callable[[], Executor] = EventsExecutor,
    *,
    own_arguments: bool = False,
    several: bool = False,
) -> int:
    """Spin the node that ``build`` makes until it finishes or is interrupted; return the exit code of the process.

    ``several`` nodes share one executor, until the first of them finishes. Bad parameters end the process before it
    joins the graph, with one line on standard error and exit code 2. So do arguments that are not for ROS, unless the
    process has ``own_arguments``, which it has checked itself.
    """
    words = list(sys.argv if args is None else args)
    try:
        # Looked through before they are used: then rcl logs nothing of its own about what is wrong.
        others = remove_ros_args(words)[1:]
        if others and not own_arguments:
            raise ParameterError(f"argument {others[0]!r}: expected only those that follow --ros-args")
        ros_domain()
        prefer_profiles()
        choose_log_folder()
        rclpy.init(args=words, signal_handler_options=rclpy.SignalHandlerOptions.NO)
    except rclpy_implementation.UnknownROSArgsError as error:
        return _refuse(name, ParameterError(f"unknown ROS arguments {error}"))
    except Exception as error:  # rcl reports a malformed command line or parameter file by several exception types
        return _refuse(name, error)
    if not several:
        given = (value.partition(":=")[0] for flag, value in pairwise(words) if flag in ("-p", "--param"))
        ProcessNode.own_only = frozenset(given)
    # An orderly end must never wait for a message: the handler only asks, and the loop looks four times a second.
    stop: list[int] = []
    take_signals(lambda received, _frame: stop.append(received))
    ignore_ctrl_c_at_end()
    nodes: list[ProcessNode] = []
    executor: Executor | None = None
    code = 1
    try:
        executor = executor_class()
        built = build()
        for node in [built] if isinstance(built, ProcessNode) else built:
            nodes.append(node)
            node.process_nodes = nodes
            executor.add_node(node)
        # What was imported and built stays: the collector need not look through it again in flight.
        gc.collect()
        gc.freeze()
        while not stop:
            for node in nodes:
                if node.exit_code is None:
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
        # Output would be lost if the process is ended here. If its reader is gone, Python reports that at exit.
        with suppress(OSError):
            sys.stdout.flush()
        with ends_with(code):
            # The executor keeps its nodes, and a node whose constructor has failed keeps itself until it is collected:
            # the participant of the middleware is destroyed with the last of them.
            if executor is not None:
                executor.shutdown()
            for node in nodes:
                node.destroy_node()
            gc.collect()
            rclpy.try_shutdown()
    return code


def _refuse(name: str, error: BaseException) -> int:
    # rcl adds where in its sources it was.
    text = " ".join(str(error).split()).partition(", at /")[0]
    print(f"{name}: error: {text}", file=sys.stderr, flush=True)
    return 2
