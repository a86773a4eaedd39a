"""Processor time of whole commands, compared with that of a Python that only imports numpy."""

from __future__ import annotations

import resource
import shutil
import subprocess
import sys

from hsv.base.errors import RunError
from hsv.bench.figure import Figure, interleaved

_HELP_SHARE, _HELP_REST = 0.5, 0.2
"""Of ``hsv --help``: what it may take of the time in which Python imports numpy, and beside it (s)."""


def against_imports(repeats: int) -> list[Figure]:
    """Return the start of the help, and of commands that compute, which fly 200 s in a sixtieth of a second.

    Raises:
        RunError: There is no ``hsv`` on the search path, or it failed.
    """
    ours, theirs = _measured(("--help",), "import numpy", repeats)
    allowed = tuple(_HELP_SHARE * seconds + _HELP_REST for seconds in theirs)
    against = f"{_HELP_SHARE:g} x python -c 'import numpy', and {_HELP_REST:g} s"
    figures = [Figure("startup_help", "processor time of hsv --help", against, "s", ours, allowed, "most", 1.0)]
    for words, limit in ((("trim",), 4.0), (("simulate", "case1"), 6.0)):
        ours, theirs = _measured(words, "import numpy", repeats)
        what = f"processor time of hsv {' '.join(words)}"
        figures.append(
            Figure(f"startup_{words[0]}", what, "python -c 'import numpy'", "s", ours, theirs, "most", limit)
        )
    return figures


def _measured(words: tuple[str, ...], imports: str, repeats: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    command = shutil.which("hsv")
    if command is None:
        raise RunError("no hsv on the search path: expected it to be installed")
    return interleaved(
        lambda: _run(command, *words), lambda: _run(sys.executable, "-c", imports), repeats, clock=_used_by_children
    )


def _run(*words: str) -> None:
    ran = subprocess.run(words, capture_output=True, text=True)
    if ran.returncode:
        raise RunError(f"{' '.join(words)}: exit code {ran.returncode}: {ran.stderr.strip()}")


def _used_by_children() -> float:
    """Return the processor time (s) of all processes that this one has started and that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
