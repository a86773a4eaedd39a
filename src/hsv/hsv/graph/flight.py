"""One run of the graph from start to end: processes started, watched and ended, the bag mended where it has to be."""

from __future__ import annotations

from collections.abc import Callable

from hsv.errors import RunError
from hsv.graph.description import COMPOSED
from hsv.graph.launcher import Ending, Launcher
from hsv.graph.preparation import PreparedRun


def fly_graph(
    prepared: PreparedRun,
    *,
    composed: bool = False,
    on_step: Callable[[int], None] = lambda step: None,
    on_line: Callable[[str, str], None] = lambda node, text: None,
) -> Ending:
    """Fly ``prepared`` with its node processes, or with all nodes in one, recorded to its bag.

    Args:
        prepared: What :func:`hsv.graph.preparation.prepare` returns.
        composed: All nodes in one process.
        on_step: Called with the steps the plant reports.
        on_line: Called with node and text of every other line that a node writes.

    Returns:
        How the flight ended: code 3 if it diverged.

    Raises:
        RunError: A process failed or is not built; its last words are in the message.
    """
    from hsv.recording.metadata import FILE_NAME
    from hsv.recording.recover import recover

    arguments = [word for path in prepared.parameter_files for word in ("--params-file", str(path))]
    # The last one to start flies the plant: when it ends, the run does.
    started = (COMPOSED,) if composed else prepared.nodes
    try:
        with Launcher(started, arguments, on_step, on_line) as launcher:
            ending = launcher.wait(started[-1].name)
    finally:
        # A recorder that was killed could not finish its bag.
        if prepared.bag.is_dir() and not (prepared.bag / FILE_NAME).exists():
            recover(prepared.bag)
    if ending.culprit:
        words = "".join(f"\n  {word}" for word in ending.last_words)
        raise RunError(f"{ending.culprit} {ending.reason}; the bag is {prepared.bag}. Its last words:{words}")
    return ending
