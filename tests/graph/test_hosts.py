"""The graph on two hosts with a network between them: vehicle and recorder on one, controllers on the other."""

import json
import os
import re
import subprocess
from pathlib import Path

import pytest
from waiting import output_of

pytestmark = pytest.mark.graph

PROFILE = Path(__file__).parents[2] / "ros_ws/src/hsv_bringup/config/lossy_network.xml"
VEHICLE_HOST = ("recorder", "fault_injector", "plant")
STEPS = 10_000
"""Steps of Case 1 after the first state."""

BOOT = "mount -t tmpfs tmpfs /dev/shm && ip link set lo up && echo up && exec sleep infinity"
"""Each host needs its own shared memory; otherwise the participants would find out that they share one machine."""


@pytest.fixture
def hosts(processes):
    """Return a function that sets up two networked hosts and returns, for each, the words that run a command on it."""

    def set_up(delay, loss):
        if os.geteuid() != 0:
            pytest.skip("two hosts need root, to make network namespaces")
        unshared = ("unshare", "--net", "--ipc", "--uts", "--mount", "sh", "-c", BOOT)
        pids = [processes.start(*unshared) for _ in range(2)]
        assert [host.stdout.readline() for host in pids] == ["up\n"] * 2
        first, second = (str(host.pid) for host in pids)
        run = ("nsenter", "--net", "--ipc", "--uts", "--mount", "--target")
        subprocess.run(
            ["ip", "link", "add", "hsv0", "netns", first, "type", "veth", "peer", "hsv0", "netns", second], check=True
        )
        for number, pid in enumerate((first, second), 1):
            script = f"ip addr add 10.213.0.{number}/24 dev hsv0 && ip link set hsv0 up multicast on"
            script += " && ip route add 224.0.0.0/4 dev hsv0"
            subprocess.run([*run, pid, "sh", "-c", script], check=True)
            network = ("tc", "qdisc", "add", "dev", "hsv0", "root", "netem", "delay", f"{delay}ms", "loss", f"{loss}%")
            if delay and subprocess.run([*run, pid, *network], capture_output=True).returncode:
                pytest.skip("this kernel does not emulate networks: tc has no netem")
        return [*run, first], [*run, second]

    return set_up


@pytest.mark.long
@pytest.mark.parametrize(("delay", "loss"), [(0, 0), (1, 0), (5, 1)], ids=["0 ms", "1 ms", "5 ms, 1 % lost"])
def test_case1_across_two_hosts_has_the_published_fingerprint(processes, hosts, delay, loss):
    vehicle, control = hosts(delay, loss)
    prepared = processes.run("hsv", "prepare", "case1", "--json", "--bag", "flown", "--folder", "flight")
    assert prepared.returncode == 0, prepared.stdout
    flight = json.loads(prepared.stdout)
    processes.environment |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILE)}
    files = [word for path in flight["parameter_files"] for word in ("--params-file", path)]
    started = {}
    for node in flight["nodes"]:
        host = vehicle if node["name"] in VEHICLE_HOST else control
        words = ("ros2", "run", node["package"], node["executable"], "--ros-args", *files)
        started[node["name"]] = processes.start(*host, *words)
    said = output_of(started["plant"])
    assert started["plant"].returncode == 0, said
    processes.stop()
    concluded = processes.run("hsv", "conclude", "flown", "--no-report", "--json")
    assert concluded.returncode == 0, concluded.stdout
    assert json.loads(concluded.stdout)["as_published"] is True
    begun, ended = re.search(
        r"\[([\d.]+)\] \[plant\]: starts run.*\[([\d.]+)\] \[plant\]: run \w+ finished", said, re.S
    ).groups()
    lap = (float(ended) - float(begun)) / STEPS
    print(f"delay {delay} ms, loss {loss} %: {1e3 * lap:.2f} ms a step")
    # A step uses the network twice: for the measurement, and for the command.
    assert 1e3 * lap > 2 * delay
