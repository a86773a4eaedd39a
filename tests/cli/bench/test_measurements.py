"""Each measurement once, small: that it measures, not what."""

import math
import shutil

import pytest
from flights import components
from ros_domain import own_domain

from hsv.base.errors import RunError
from hsv.cli.bench.measure import against_imports, c_flight, graph_lap, ring_lap


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_loop_in_c_alone_flies_the_same_bits_every_time():
    # tests/cli/test_bench.py compares these bits with those of a flight from Python.
    in_c = c_flight(components("case1", duration=110.0))
    first = in_c().signals.copy()
    assert (in_c().signals == first).all()


def test_a_missing_compiler_or_command_is_reported(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(RunError, match="no C compiler cc on PATH"):
        c_flight(components("case1"))
    with pytest.raises(RunError, match="no hsv on the search path"):
        against_imports(1)


@pytest.mark.long
def test_the_start_of_commands_is_measured():
    figures = against_imports(1)
    assert [figure.name for figure in figures] == ["startup_help", "startup_simulate"]
    assert all(0.0 < figure.ratio < math.inf for figure in figures)


@pytest.mark.long
@pytest.mark.graph
def test_laps_of_the_ring_and_of_the_graph(monkeypatch):
    with own_domain() as number:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        assert 0.0 < ring_lap(100) < math.inf
        assert 0.0 < graph_lap(2.0) < math.inf
