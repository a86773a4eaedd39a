"""Each measurement once, small: that it measures, not what."""

import math

import pytest
from ros_domain import own_domain

from hsv.base.errors import RunError
from hsv.bench.graph import graph_lap
from hsv.bench.in_process import against_scipy
from hsv.bench.ring import ring_lap
from hsv.bench.startup import against_imports
from hsv.bench.writing import against_mcap


def test_scipy_arrives_at_the_same_state():
    [measured] = against_scipy(1)
    assert 0.0 < measured.median < math.inf
    assert float(measured.note.split()[-1]) < 1e-3


def test_the_start_of_commands_is_measured():
    names = ["startup_help", "startup_trim", "startup_simulate"]
    figures = against_imports(1)
    assert [figure.name for figure in figures] == names
    assert all(0.0 < figure.median < math.inf for figure in figures)


def test_a_command_that_is_not_installed_cannot_be_measured(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(RunError, match="no hsv on the search path"):
        against_imports(1)


def test_writing_is_measured():
    [measured] = against_mcap(1)
    assert 0.0 < measured.median < math.inf


@pytest.fixture
def domain(monkeypatch):
    with own_domain() as number:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield


@pytest.mark.graph
@pytest.mark.parametrize(("loop", "composed"), [("events", False), ("wait_set", False), ("ordered", True)])
def test_a_lap_of_the_ring(domain, loop, composed):
    assert 0.0 < ring_lap(100, loop, composed=composed) < math.inf


@pytest.mark.graph
def test_a_lap_of_the_graph(domain):
    assert 0.0 < graph_lap(2.0) < math.inf
