"""The pinned versions and the program that makes them."""

import re
from pathlib import Path

import pytest

from lock import LOCKS, kept_pins, merge, normalise

ROOT = Path(__file__).parents[2]


def test_a_marker_is_written_only_where_the_pythons_differ():
    lines = merge({"3.11": {"a": "1", "b": "1", "c": "1"}, "3.12": {"a": "1", "b": "2"}})
    assert lines == [
        "a==1",
        'b==1 ; python_version == "3.11"',
        'b==2 ; python_version == "3.12"',
        'c==1 ; python_version == "3.11"',
    ]


def test_ros_packages_move_only_when_named():
    text = "# comment\nnumpy==1\nros-rclpy==7\nscipy==2\n"
    assert kept_pins(text, []) == ["numpy==1", "ros-rclpy==7", "scipy==2"]
    assert kept_pins(text, ["SciPy"]) == ["numpy==1", "ros-rclpy==7"]
    assert kept_pins(text, ["all"]) == ["ros-rclpy==7"]
    assert kept_pins(text, ["all", "ros_rclpy"]) == []


@pytest.mark.parametrize("lock", sorted(LOCKS))
def test_everything_required_is_pinned_once(lock):
    pins = [line for line in (ROOT / lock).read_text().splitlines() if not line.startswith("#")]
    names = {line.split("==")[0] for line in pins}
    assert all(re.fullmatch(r"[a-z0-9-]+==\S+( ; python_version == .*)?", line) for line in pins)
    for requirements in LOCKS[lock][0]:
        for line in (ROOT / requirements).read_text().splitlines():
            if not line.startswith("#"):
                assert normalise(re.split(r"[<>=\[]", line)[0]) in names
