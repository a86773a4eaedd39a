"""One run of the graph from start to end: processes started, watched and ended, the bag completed if necessary."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from hsv.bags.description import ROOT, TOPICS
from hsv.base.errors import RecordingError, RunError
from hsv.graph.launcher import Launcher, parameter_arguments
from hsv.graph.preparation import PreparedRun
from hsv.graph.snapshot import Snapshot


def fly_graph(
    prepared: PreparedRun,
    *,
    namespace: str = ROOT,
    on_step: Callable[[int], None] = lambda step: None,
    on_line: Callable[[str, str], None] = lambda node, text: None,
    on_snapshot: Callable[[Snapshot], None] = lambda snapshot: None,
) -> None:
    """Fly ``prepared`` with its processes, recorded to its bag; interrupted before the first step, it leaves no bag.

    Args:
        prepared: Prepared run, from :func:`hsv.graph.preparation.prepare`.
        namespace: Namespace of all nodes, as :func:`hsv.bags.description.checked_namespace` returns it.
        on_step: Called with the steps the plant reports.
        on_line: Called with node and text of every other line that a node writes.
        on_snapshot: Called with what the recorder tells of the flight.

    Raises:
        RunError: A process failed or is not built, or the bag cannot be repaired; last words are in the message.
    """
    failures = []
    try:
        arguments = parameter_arguments(prepared.parameter_files)
        given = (on_step, on_line, prepared.step_timeout, namespace, on_snapshot)
        with Launcher(prepared.nodes, arguments, *given) as launcher:
            launcher.wait()
    except RunError as error:
        failures.append(str(error))
    except BaseException:
        with suppress(RunError, RecordingError):
            close_bag(prepared.bag)
            _remove_without_steps(prepared.bag)
        raise
    close_bag(prepared.bag, failures)


def close_bag(bag: Path, failures: Sequence[str] = ()) -> None:
    """Finish the bag of a graph whose processes have ended, and raise an error if anything failed.

    Args:
        bag: The bag directory; removed where no recorder has come to write anything.
        failures: Failures of processes, in words.

    Raises:
        RunError: There are ``failures``, or the bag cannot be repaired; names the bag where there is one.
    """
    words = list(failures)
    try:
        _mend(bag)
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


def _mend(bag: Path) -> None:
    from hsv.bags.metadata import FILE_NAME
    from hsv.bags.recover import finalise

    with suppress(OSError):
        bag.rmdir()  # where no recorder has come to write anything
    # A recorder that was killed could not finish its bag.
    if bag.is_dir() and not (bag / FILE_NAME).exists():
        finalise(bag)
