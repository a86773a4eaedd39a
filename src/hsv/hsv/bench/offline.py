"""Wall times of the offline design and of its verification, as a user waits for them."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from hsv.base.errors import RunError
from hsv.bench.figure import Figure


def design_and_verify() -> list[Figure]:
    """Return the times of the baseline design with its certificate, and of verifying it.

    Raises:
        RunError: A command failed.
    """
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        file = str(Path(folder, "baseline.yaml"))
        designed = _timed("design", "baseline", "--out", file)
        verified = _timed("verify", file)
    return [
        Figure("design", "hsv design baseline, certificate included", "", "s", (designed,), (), "most", 60.0),
        Figure("verify", "hsv verify of it", "", "s", (verified,), (), "most", 20.0),
    ]


def _timed(*words: str) -> float:
    started = time.perf_counter()
    ran = subprocess.run([sys.executable, "-m", "hsv.cli.entry", *words], capture_output=True, text=True)
    if ran.returncode:
        raise RunError(f"hsv {' '.join(words)}: exit code {ran.returncode}: {ran.stderr.strip()}")
    return time.perf_counter() - started
