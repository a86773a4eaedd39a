"""What the launcher refuses before it starts anything."""

from __future__ import annotations

import os

import pytest

from hsv.bags.description import COMPOSED, ROOT, TUBE_MPC, NodeDescription
from hsv.base.errors import ParameterError, RunError
from hsv.graph.exclusive import claim_topic
from hsv.graph.launcher import Launcher

# A number that no graph can have and no other test run takes: only its name is held.
DOMAIN = 10**9 + os.getpid()


def launcher(namespace: str = ROOT, *nodes: NodeDescription) -> Launcher:
    """Return a launcher that has nothing to start, or is refused before it starts it."""
    return Launcher(nodes, [], lambda step: None, lambda node, text: None, namespace=namespace)


@pytest.mark.parametrize("spelling", ["{}", " 0{}"])
@pytest.mark.parametrize("namespace", [ROOT, "/veh1", "/a" * 90])
def test_domain_and_namespace_belong_to_one_run_however_they_are_written(
    monkeypatch: pytest.MonkeyPatch, spelling: str, namespace: str
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    with launcher(namespace):
        monkeypatch.setenv("ROS_DOMAIN_ID", spelling.format(DOMAIN))
        with pytest.raises(RunError, match=f"another run has ROS_DOMAIN_ID={DOMAIN}"), launcher(namespace):
            pass
        with launcher("/other"):
            pass


@pytest.mark.parametrize("node", [TUBE_MPC, COMPOSED], ids=lambda node: node.name)
def test_a_node_that_runs_by_hand_is_named(monkeypatch: pytest.MonkeyPatch, node: NodeDescription) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    held = claim_topic(DOMAIN, "/veh1/hsv/command")
    assert held is not None and claim_topic(DOMAIN, "/veh1/hsv/command") is None
    refused = "publishes /veh1/hsv/command already: expected no other tube_mpc there"
    with held, pytest.raises(RunError, match=refused), launcher("/veh1", node):
        pass
    # What a refused run has claimed itself is free again.
    with launcher("/veh1"):
        pass


def test_a_domain_is_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "seven")
    with pytest.raises(ParameterError, match="ROS_DOMAIN_ID='seven': expected a whole number"), launcher():
        pass
