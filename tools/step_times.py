"""Measure how long the control laws take for a step in their nodes: python3 tools/step_times.py, after env.sh.

Flies each scenario with hsv run and prints the 99th percentiles that the nodes report in the recorded diagnostics.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from hsv.bags.description import DIAGNOSTICS
from hsv.bags.reader import Bag

SCENARIOS = ("case1", "case1_smooth", "case1_governed", "case1_qp", "case1_active", "case2")

NODES = ("nominal_trajectory", "tube_mpc")
"""The law's two nodes: the plan, and the feedback about it."""

KEY = "step_time_p99_ms"


def reported(bag: Bag) -> dict[str, list[float]]:
    """Return the 99th percentiles (ms) of the step times that each node has reported, once a simulated second."""
    found: dict[str, list[float]] = {name: [] for name in NODES}
    for _, message in bag.decode(DIAGNOSTICS):
        for status in message.status:
            name = status.name.partition(":")[0]
            if name in found:
                found[name] += [float(pair.value) for pair in status.values if pair.key == KEY]
    return found


def main() -> int:
    """Fly all scenarios and print the table."""
    print("| scenario | " + " | ".join(f"{name}, ms | largest" for name in NODES) + " |")
    print("| --- |" + " ---: |" * (2 * len(NODES)))
    for scenario in SCENARIOS:
        with tempfile.TemporaryDirectory() as folder:
            bag = Path(folder, "bag")
            run = subprocess.run(
                ["hsv", "run", scenario, "--bag", str(bag), "--no-report"], capture_output=True, text=True, check=False
            )
            if run.returncode:
                print(f"{scenario}: {run.stdout}{run.stderr}", file=sys.stderr)
                return run.returncode
            cells = [f"{np.median(times):.3f} | {max(times):.3f}" for times in reported(Bag(bag)).values()]
        print(f"| `{scenario}` | {' | '.join(cells)} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
