"""Start and stop of a node process."""

from __future__ import annotations

import gc
import sys
import time
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
    """Spin the node that ``build`` returns until it finishes or is interrupted; return the exit code of the process.

    With ``several``, ``build`` yields several nodes, which share one executor until the first of them finishes. Wrong
    parameters end the process before it joins the graph, with exit code 2 and one line on standard error that begins
    with ``name``. So do other arguments than those of ROS, unless ``own_arguments`` says that the caller checks them.
    """
    words = list(sys.argv if args is None else args)
    try:
        # Check the arguments first, so that rcl does not log its own errors about them.
        others = remove_ros_args(words)[1:]
        if others and not own_arguments:
            raise ParameterError(f"argument {others[0]!r}: expected only those that follow --ros-args")
        if time.time() >= 2**31:
            date = time.strftime("%F")
            raise ParameterError(f"clock = {date}: expected a date before 2038-01-19, which ROS stamps can hold")
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
    ProcessNode.parameter_files = tuple(value for flag, value in pairwise(words) if flag == "--params-file")
    # The handler only requests the end; the loop checks the request at least four times a second.
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
        # Exclude what has been created so far from garbage collection, which then takes less time in flight.
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
            # Always with a timeout: EventsExecutor runs no callbacks while it waits without one.
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
                # An error such as a full disk may have been reported already by the write before: report it once.
                code = code or _refuse(name, error)
        # Output would be lost if ends_with() ends the process. If the pipe is closed, Python reports that at exit.
        with suppress(OSError):
            sys.stdout.flush()
        with ends_with(code):
            # The DDS participant is destroyed with the last node. The executor holds its nodes, and a node whose
            # constructor has failed exists until it is collected.
            if executor is not None:
                executor.shutdown()
            for node in nodes:
                node.destroy_node()
            gc.collect()
            rclpy.try_shutdown()
    return code


def _refuse(name: str, error: BaseException) -> int:
    # rcl appends the place in its source code.
    text = " ".join(str(error).split()).partition(", at /")[0]
    print(f"{name}: error: {text}", file=sys.stderr, flush=True)
    return 2
