"""Fixtures for graphs of real node processes, each on its own ROS domain and limited to this machine."""

import pytest
from node_processes import Processes
from ros_domain import own_environment
from short_campaigns import planned, results, short  # noqa: F401 (fixtures)


@pytest.fixture
def ros_environment():
    """Return an environment for processes on a ROS domain that no other process uses."""
    with own_environment() as environment:
        yield environment


@pytest.fixture(scope="module")
def shared_processes(tmp_path_factory):
    """Start processes for all tests of a module, in one folder and on their own domain."""
    with own_environment() as environment:
        started = Processes(environment, tmp_path_factory.mktemp("graph"))
        yield started
        started.stop()


@pytest.fixture
def processes(ros_environment, tmp_path):
    """Start processes in a temporary folder, on their own domain."""
    started = Processes(ros_environment, tmp_path)
    yield started
    started.stop()
