"""One run of the graph from start to end: processes started, watched and ended, the bag completed if necessary."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from hsv.bags.description import ROOT, TOPICS
from hsv.base.errors import RecordingError, RunError
from hsv.control.controller import NODE
from hsv.graph.launcher import Launcher, parameter_arguments
from hsv.graph.preparation import PreparedRun


def fly_graph(
    prepared: PreparedRun,
    *,
    namespace: str = ROOT,
    on_step: Callable[[int], None] = lambda step: None,
    on_line: Callable[[str, str], None] = lambda node, text: None,
) -> None:
    """Fly a prepared run with its node processes and record it to its bag.

    A run that is interrupted before the first step leaves no bag. The other arguments are those of
    :class:`hsv.graph.launcher.Launcher`.

    Raises:
        RunError: A process failed or is not built, or the bag cannot be repaired; the message has the last error line.
        ParameterError: Another run has the domain and the namespace.
    """
    failures = []
    try:
        arguments = parameter_arguments(prepared.parameter_files)
        # A controller that is started by hand must know the domain.
        own = prepared.scenario.controller != NODE
        with Launcher(prepared.nodes, arguments, on_step, on_line, prepared.step_timeout, namespace, own) as launcher:
            launcher.wait()
    except RunError as error:
        failures.append(str(error))
    except BaseException:
        with suppress(RunError, RecordingError):
            close_bag(prepared.bag)
            _remove_without_steps(prepared.bag)
        raise
    finally:
        if prepared.folder:
            prepared.folder.cleanup()
    close_bag(prepared.bag, failures)


def close_bag(bag: Path, failures: Sequence[str] = ()) -> None:
    """Complete the bag of a graph whose processes have ended; remove its folder if no recorder has written anything.

    Raises:
        RunError: There are ``failures`` of processes, or the bag cannot be repaired. The message names the bag, if any.
    """
    from hsv.bags.metadata import FILE_NAME
    from hsv.bags.recover import finalise

    words = list(failures)
    with suppress(OSError):
        bag.rmdir()  # succeeds only if no recorder has written anything
    try:
        # A recorder that was killed could not finish its bag.
        if bag.is_dir() and not (bag / FILE_NAME).exists():
            finalise(bag)
    except RecordingError as error:
        words.insert(0, str(error))
    if words:
        raise RunError((f"{bag}: " if bag.is_dir() else "") + "; ".join(words))


def _remove_without_steps(bag: Path) -> None:
    from hsv.bags.reader import Bag

    if not bag.is_dir():
        return
    opened = Bag(bag)
    if not any(len(opened.times(topic)) for topic in TOPICS if topic in opened.roles):
        shutil.rmtree(bag)
