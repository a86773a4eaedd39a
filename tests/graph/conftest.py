"""Graphs of real node processes, each on a ROS domain of its own and on this machine only."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from domain_coordinator import domain_id
from node_processes import Processes


@pytest.fixture
def ros_environment() -> Iterator[dict[str, str]]:
    """Return the environment of processes on a domain that nobody else uses."""
    with domain_id() as number:
        yield os.environ | {"ROS_DOMAIN_ID": str(number), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


@pytest.fixture
def processes(ros_environment: dict[str, str], tmp_path: Path) -> Iterator[Processes]:
    """Start processes in a temporary folder, on a domain of their own."""
    started = Processes(ros_environment, tmp_path)
    yield started
    started.stop()
