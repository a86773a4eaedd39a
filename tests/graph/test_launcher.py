"""Conditions under which the launcher refuses to start anything."""

import os
import subprocess
import sys

import pytest

from hsv.bags.description import COMPOSED, ROOT, TUBE_MPC
from hsv.base.errors import ParameterError
from hsv.graph.exclusive import claim
from hsv.graph.launcher import Launcher

# Not a valid domain, and used by no other test run: only the lock on its name matters here.
DOMAIN = 10**9 + os.getpid()


def launcher(namespace=ROOT, *nodes):
    """Return a launcher that has no processes to start, or that is refused before it starts them."""
    return Launcher(nodes, [], lambda step: None, lambda node, text: None, namespace=namespace)


@pytest.fixture
def domain(monkeypatch):
    """Make this process use :data:`DOMAIN`."""
    monkeypatch.setattr("hsv.graph.exclusive.LAST_DOMAIN", DOMAIN)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))


@pytest.mark.usefixtures("domain")
@pytest.mark.parametrize("namespace", [ROOT, "/veh1", "/a" * 90])
def test_domain_and_namespace_belong_to_one_run(namespace):
    with launcher(namespace):
        with pytest.raises(ParameterError, match=f"another run has ROS_DOMAIN_ID={DOMAIN}"), launcher(namespace):
            pass
        with launcher("/other"):
            pass


@pytest.mark.usefixtures("domain")
@pytest.mark.parametrize("node", [TUBE_MPC, COMPOSED], ids=lambda node: node.name)
def test_a_node_that_runs_by_hand_is_named(node):
    held = claim("topic", DOMAIN, "/veh1/hsv/command")
    assert held is not None and claim("topic", DOMAIN, "/veh1/hsv/command") is None
    refused = "publishes /veh1/hsv/command already: expected no other tube_mpc there"
    with held, pytest.raises(ParameterError, match=refused), launcher("/veh1", node):
        pass
    # The refused run has released the names that it claimed.
    with launcher("/veh1"):
        pass


def test_a_run_takes_a_free_domain_if_none_is_set_and_the_first_one_is_busy(monkeypatch):
    monkeypatch.setattr("hsv.graph.launcher._DOMAINS", range(DOMAIN, DOMAIN + 3))
    monkeypatch.setattr("hsv.graph.launcher.ros_domain", lambda: int(os.environ.get("ROS_DOMAIN_ID", DOMAIN)))
    monkeypatch.setenv("ROS_DOMAIN_ID", "")
    monkeypatch.delenv("ROS_DOMAIN_ID")
    lines = []

    def run():
        return Launcher([], [], print, lambda node, text: lines.append(text), any_domain=True)

    held = claim("domain", DOMAIN, "")
    with held, run() as first:
        assert lines[0] == f"export ROS_DOMAIN_ID={DOMAIN + 1}" == f"export ROS_DOMAIN_ID={os.environ['ROS_DOMAIN_ID']}"
        assert first
        # A domain that the user has set is not changed.
        with pytest.raises(ParameterError, match="another run has"), run():
            pass


@pytest.mark.parametrize("text", ["seven", "-1", "300", "025", "1.0"])
def test_a_domain_is_a_decimal_number_that_dds_has(monkeypatch, text):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(ParameterError, match=f"ROS_DOMAIN_ID='{text}': expected a whole number from 0 to"), launcher():
        pass


def test_discovery_must_be_on(monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
    with pytest.raises(ParameterError, match="ROS_AUTOMATIC_DISCOVERY_RANGE='OFF': expected LOCALHOST"), launcher():
        pass


def test_a_network_is_needed():
    isolated = ("unshare", "--map-root-user", "--net")
    if subprocess.run([*isolated, "true"], check=False).returncode:
        pytest.skip("this machine permits no network of its own")
    words = [sys.executable, "-c", "from hsv.graph.exclusive import ros_domain; ros_domain()"]
    done = subprocess.run([*isolated, *words], capture_output=True, text=True, check=False)
    assert "ParameterError: network interface lo: down, expected up" in done.stderr
