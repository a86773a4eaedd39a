"""The command that sets a parameter: what can be nobody's name or value is one line, at once."""

from __future__ import annotations

import pytest
from node_processes import Processes

pytestmark = pytest.mark.graph


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("tube mpc", "feedback.tau", "[0.8]"), "node = 'tube mpc': expected the name of a node"),
        (("tube_mpc", "feedback.tau", "[36893488147419103232]"), "too big"),
        (("tube_mpc", "feedback.tau", "{a: 1}"), "not one of the allowed types"),
    ],
    ids=["name", "size", "type"],
)
def test_what_cannot_be_is_refused_in_one_line(processes: Processes, words: tuple[str, ...], expected: str) -> None:
    ran = processes.run("ros2", "run", "hsv_bringup", "set_parameter", *words)
    assert ran.returncode == 1
    said = [line for line in ran.stdout.splitlines() if not line.startswith("[ros2run]")]
    assert len(said) == 1 and expected in said[0], ran.stdout
