"""The nodes started one by one with ``ros2 run``, faults injected in flight, bad parameters refused."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import time

import pytest
from injected_fault import LONG, inject_and_land, last_line
from marking import long
from node_processes import Processes, recorded_steps
from ros_domain import own_domain
from waiting import exit_code_of, output_of, used, wait_until

from hsv.bags.description import graph
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import flown_parameters
from hsv.bags.replay.engine import replay, rerun
from hsv.bags.replay.processes import processes_of
from hsv.control.design import find_design
from hsv.graph.exclusive import is_published

pytestmark = pytest.mark.graph


def start(processes: Processes, extra: dict[str, list[str]]) -> dict[str, subprocess.Popen[str]]:
    """Start the nodes one by one, with these arguments."""
    return {
        node.name: processes.start(
            "ros2",
            "run",
            node.package,
            node.executable,
            *(["--ros-args", *extra[node.name]] if node.name in extra else []),
        )
        for node in graph()
    }


def test_nodes_by_hand_with_a_fault_injected_in_flight(processes: Processes) -> None:
    bag = processes.folder / "by_hand"
    nodes = start(processes, {"recorder": ["-p", f"bag.directory:={bag}"], "plant": LONG})
    inject_and_land(processes, nodes["plant"], bag)
    assert [popen.returncode for name, popen in nodes.items() if name != "plant"] == [0] * (len(nodes) - 1)
    said = {name: popen.communicate()[0] for name, popen in nodes.items()}
    assert re.search(r"run \w{8} broken off at t = [\d.]+ s, step \d+: SIGINT", said["plant"])
    for name in nodes.keys() - {"plant"}:
        assert "broken off by the plant at t = " in said[name], said[name]


@pytest.mark.long
def test_composed_by_hand_with_a_fault_injected_in_flight(processes: Processes) -> None:
    bag = processes.folder / "by_hand"
    words = ["-p", f"bag.directory:={bag}", *LONG]
    inject_and_land(processes, processes.start("ros2", "run", "hsv_bringup", "composed", "--ros-args", *words), bag)


@pytest.mark.long
def test_a_flight_by_hand_is_told_and_can_be_repeated(processes: Processes) -> None:
    bag = processes.folder / "by_hand"
    # Nodes need not have the same parameters, and each is repeated with its own.
    tube = ["--params-file", str(find_design("adjustable")), "-p", "feedback.tau:=[0.9]"]
    extra = {
        "recorder": ["-p", f"bag.directory:={bag}"],
        "plant": ["-p", "duration:=12.0", "-p", "seed:=7"],
        "tube_mpc": tube,
    }
    # Nor need they be in one namespace, where the topics are in one.
    topics = ("measurement", "filtered_state", "run", "ready", "last_state")
    back = [word for topic in topics for word in ("-r", f"hsv/{topic}:=/hsv/{topic}")]
    nodes = start(processes, extra | {"notch_filter": ["-r", "__ns:=/elsewhere", *back]})
    assert exit_code_of(nodes["plant"]) == 0
    over = processes.run("hsv", "topic", "/hsv/state")
    assert over.returncode == 1 and "error: topic /hsv/state: nobody publishes it" in last_line(over)
    processes.start("ros2", "run", "hsv_plant", "plant")
    assert exit_code_of(nodes["recorder"]) == 1
    processes.stop()
    said = {name: popen.communicate()[0] for name, popen in nodes.items()}
    refused = said["recorder"].partition("a new run was announced: expected one recorder per run")[2]
    assert "closed the bag" in refused and "waiting for" not in refused, said["recorder"]
    run_id = re.search(r"starts run (\w{8}): 601 steps, 12 s", said["plant"])[1]
    for name in nodes.keys() - {"plant"}:
        assert f"ready for run {run_id}: 601 steps, 12 s" in said[name]
        assert f"run {run_id} finished at t = 12.00 s, step 600" in said[name], said[name]
    assert said["recorder"].count(f" {bag}") == 2 and f"closed the bag {bag}: 601 steps" in said["recorder"]
    assert "parameter design.hash differs: " in said["recorder"]

    opened = Bag(bag)
    assert sorted(opened.attachments) == ["certificate.json", "design.yaml", "scenario.yaml"]
    assert opened.custom_data["run_id"].startswith(run_id) and opened.custom_data["design"] == "adjustable"
    assert opened.custom_data["seed"] == "7"
    values = flown_parameters(opened)
    assert values.of("tube_mpc")["feedback.tau"] == [0.9] and values.of("nominal_trajectory")["feedback.tau"] == [1.0]
    assert [values.of(name)["design.name"] for name in ("tube_mpc", "nominal_trajectory")] == ["adjustable", "baseline"]
    results = [replay(opened, process, values, lambda *_: None) for process in processes_of("tube_mpc").values()]
    results += rerun(opened, "tube_mpc", values, lambda *_: None)
    assert len(results) == 10 and all(result.identical for result in results)
    done = processes.run("hsv", "replay", bag, "--over-dds", "--rerun")
    assert done.stdout.count("identical in every byte") == 5, done.stdout


@pytest.mark.parametrize(
    ("words", "code", "expected"),
    [
        (("fault", "list"), 1, "hsv fault: error: no run in ROS_DOMAIN_ID="),
        long(("topic",), 1, "hsv topic: error: no node of the graph in ROS_DOMAIN_ID="),
        long(
            ("set", "tua", "0.8"),
            2,
            "hsv set: error: name = 'tua': expected a parameter that may change in flight, feedback.tau",
        ),
        long(("set", "tau", "0.8 m"), 2, "feedback.tau = '0.8 m': wrong unit"),
        long(("topic", "--every", "0"), 2, "--every"),
        long(("topic", "bad name"), 2, "hsv topic: error: name = 'bad name': expected the name of a topic"),
        long(("topic", "/hsv//state"), 2, "(topic name must not contain repeated '/')"),
        long(("topic", "hsv/9x"), 2, "(topic name token must not start with a number)"),
        long(("fault", "list", "--namespace", "a b"), 2, "namespace = 'a b'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_commands_refuse_in_one_line(processes: Processes, words: tuple[str, ...], code: int, expected: str) -> None:
    done = processes.run("hsv", *words)
    assert done.returncode == code and expected in last_line(done), done.stdout


@pytest.mark.parametrize(
    ("number", "after"),
    [long(number, after) for number in (signal.SIGINT, signal.SIGTERM) for after in (0.2, 2.0)],
)
def test_a_command_is_interrupted_in_one_line(processes: Processes, number: int, after: float) -> None:
    # However early it comes: on a fast machine 2 s is in the middle of the waiting, on a slow one in the imports.
    # Somebody is there and silent, or the command might end by itself before it has used so much.
    silent = processes.start("ros2", "run", "hsv_ctrl", "notch_filter")
    domain = int(processes.environment["ROS_DOMAIN_ID"])
    wait_until(lambda: is_published(domain, "/hsv/filtered_state"), [silent.pid])
    popen = processes.start("hsv", "topic", "/hsv/filtered_state")
    wait_until(lambda: used([popen.pid]) > min(after, 0.6), [popen.pid], pause=lambda _: time.sleep(0.02))
    popen.send_signal(number)
    output = output_of(popen)
    assert popen.returncode == 130 and output.splitlines()[-1].endswith("error: interrupted"), output


@pytest.mark.long
def test_topics_are_listed_and_printed_with_units(processes: Processes) -> None:
    bag = processes.folder / "flown"
    flight = processes.start("hsv", "run", "case1", "--real-time-factor", "0.5", "--no-report", "--bag", bag)
    wait_until(lambda: recorded_steps(bag), [flight.pid])
    listed = [json.loads(line) for line in _lines(processes.run("hsv", "topic", "--json"))]
    rows = {row["topic"]: row for row in listed}
    command = rows["/hsv/command"]
    assert command["type"] == "hsv_msgs/msg/ControlInput" and command["publishers"] == ["/tube_mpc"]
    assert command["subscribers"] == ["/fault_injector", "/recorder"]
    state = json.loads(_lines(processes.run("hsv", "topic", "/hsv/state", "--once", "--json"))[-1])
    assert state["altitude [m]"] == pytest.approx(26100, abs=300)
    assert state["header.stamp [ns]"] == state["step"] * 20_000_000 and state["status"] == 0
    printed = _lines(processes.run("hsv", "topic", "hsv/command", "--once"))
    assert printed[0] == "/hsv/command"
    assert ["elevator_deflection", "rad"] in [line.split()[::2] for line in printed]
    wrong = processes.run("hsv", "topic", "/hsv/stat")
    assert wrong.returncode == 2 and last_line(wrong).endswith("no node publishes it, expected /hsv/state?")
    flight.send_signal(signal.SIGINT)
    assert exit_code_of(flight) == 130


def _lines(done: subprocess.CompletedProcess[str]) -> list[str]:
    assert done.returncode == 0, done.stdout
    # DDS says on standard error where another process of the machine holds a lock of its shared memory.
    return [line for line in done.stdout.splitlines() if not line.startswith("waiting for ") and "RTPS_" not in line]


def test_who_does_not_answer_is_given_up_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    import rclpy

    from hsv_bringup import peer_parameters

    monkeypatch.setattr(peer_parameters, "GIVE_UP_AFTER", 1.0)
    with own_domain() as number:
        rclpy.init(domain_id=number)
        try:
            asking, mute = rclpy.create_node("asking"), rclpy.create_node("mute")
            peers = peer_parameters.PeerParameters(asking, {"nobodys_executable": "/mute"})

            def gave_up() -> bool:
                rclpy.spin_once(asking, timeout_sec=0.05)
                assert peers.silent() == {"nobodys_executable": "/mute/list_parameters"}
                return peers.gave_up

            wait_until(gave_up)
            assert peers.values() == {}
            mute.destroy_node()
        finally:
            rclpy.shutdown()


@pytest.mark.parametrize(
    ("package", "executable", "arguments", "words"),
    [
        long(
            "hsv_plant",
            "plant",
            ["-p", "initial.altitude:=30000.0"],
            ["initial.altitude = 30000.0", "25908 to 26365.2 m"],
        ),
        long(
            "hsv_plant",
            "fault_injector",
            ["-p", "fault.types:=[bias, bias]", "-p", "fault.channels:=[elevator_deflection]"],
            ["fault."],
        ),
        long("hsv_ctrl", "tube_mpc", ["-p", "feedback.gain:=[1.0, 2.0]"], ["feedback.gain", "2 values, expected 18"]),
        long("hsv_ctrl", "tube_mpc", ["-p", "input.minimum:=[.nan, 0.0]"], ["input.minimum[0] = nan"]),
        (
            "hsv_ctrl",
            "tube_mpc",
            ["-p", "tube.centre:=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]"],
            ["design 'baseline': check fails: tube.centre["],
        ),
        long(
            "hsv_ctrl", "notch_filter", ["-p", "notch.zero_frequency:=[15.0, 20.0]"], ["notch.zero_damping", "1 values"]
        ),
        long(
            "hsv_ctrl", "nominal_trajectory", ["-p", "reference.velocities:=[1.0]"], ["reference.velocities[0] = 1.0"]
        ),
        long("hsv_bringup", "recorder", ["-p", "bag.attachments:=[nowhere.txt]"], ["bag.attachments = 'nowhere.txt'"]),
    ],
)
def test_bad_parameters_are_refused_in_one_line(
    processes: Processes, package: str, executable: str, arguments: list[str], words: list[str]
) -> None:
    done = processes.run("ros2", "run", package, executable, "--ros-args", *arguments)
    assert done.returncode == 2, done.stdout
    lines = [line for line in done.stdout.splitlines() if line.startswith(f"{executable}: error: ")]
    assert len(lines) == 1, done.stdout
    for word in words:
        assert word in lines[0]
    assert not list(processes.folder.iterdir())
