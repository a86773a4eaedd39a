"""Nodes started one by one with ``ros2 run``; faults injected in flight; bad parameters refused."""

import json
import re
import signal
import time

import pytest
from marking import long
from node_processes import fly_until, last_line, recorded_steps
from waiting import exit_code_of, output_of, used, wait_until

from hsv.bags.description import graph
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import complete_steps, flown_parameters
from hsv.control.design_file import find_design
from hsv.graph.exclusive import is_published

pytestmark = pytest.mark.graph


def start(processes, extra):
    """Start the nodes one by one, with these arguments."""
    words = {name: ["--ros-args", *given] for name, given in extra.items()}
    return {
        node.name: processes.start("ros2", "run", node.package, node.executable, *words.get(node.name, []))
        for node in graph()
    }


def test_nodes_by_hand_with_a_fault_injected_in_flight(processes):
    path, fuel = processes.folder / "by_hand", "fuel_equivalence_ratio"
    # Long enough that the flight does not end before the commands, even on a slow machine; it is interrupted.
    endless = ["-p", "duration:=600.0", "-p", "real_time_factor:=2.0"]
    nodes = start(processes, {"recorder": ["-p", f"bag.directory:={path}"], "plant": endless})
    plant = nodes["plant"]

    def asked(*words):
        done = processes.run("hsv", "fault", *words, "--json")
        assert done.returncode == 0, done.stdout
        return json.loads(last_line(done))

    for words, said in (
        (("rudder", "loss_of_effectiveness", "0.5"), "fault.channel = 'rudder': expected one of"),
        ((fuel, "loss_of_effectiveness", "-0.5"), "fault.effectiveness = '-0.5': expected from 0 to 1"),
        ((fuel, "loss_of_effectiveness", "0.5", "--duration", "-1 s"), "duration = '-1 s': expected from 0 to"),
    ):
        refused = processes.run("hsv", "fault", "inject", *words)
        assert refused.returncode == 2 and said in last_line(refused)
    first = asked("inject", fuel, "loss_of_effectiveness", "95 %", "--duration", "900 s")["step"]
    fly_until(plant, path, first + 1)
    acting = asked("list")
    assert acting["active"] == [
        {"channel": fuel, "type": "loss_of_effectiveness", "parameters": {"effectiveness": 0.95}}
    ]
    assert first <= acting["step"] and acting["time_s"] == pytest.approx(acting["step"] * 0.02)
    end = asked("clear", fuel)["step"]
    fly_until(plant, path, end + 1)
    plant.send_signal(signal.SIGINT)
    assert exit_code_of(plant) == 0
    processes.stop()

    bag = Bag(path)
    steps = complete_steps(bag)
    assert bag.complete and first < end < steps
    active = [message.step for _, message in bag.decode("/hsv/actuator") if message.active]
    assert active == list(range(first, end))
    actuator, command = (bag.columns(topic)[fuel][:steps] for topic in ("/hsv/actuator", "/hsv/command"))
    assert (actuator / command)[active] == pytest.approx(0.95)
    assert [popen.returncode for name, popen in nodes.items() if name != "plant"] == [0] * (len(nodes) - 1)
    said = {name: popen.communicate()[0] for name, popen in nodes.items()}
    assert re.search(r"run \w{8} broken off at t = [\d.]+ s, step \d+: SIGINT", said["plant"])
    for name in nodes.keys() - {"plant"}:
        assert "broken off by the plant at t = " in said[name], said[name]


@pytest.mark.long
def test_a_flight_by_hand_is_told_and_can_be_repeated(processes):
    bag = processes.folder / "by_hand"
    # Nodes may have different parameters; each is replayed with its own.
    tube = ["--params-file", str(find_design("adjustable")), "-p", "feedback.tau:=[0.9]"]
    extra = {
        "recorder": ["-p", f"bag.directory:={bag}"],
        "plant": ["-p", "duration:=12.0", "-p", "seed:=7"],
        "tube_mpc": tube,
    }
    # Nodes may be in different namespaces, as long as their topics are in one.
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
    for words in ((), ("--rerun",), ("--over-dds",)):
        done = processes.run("hsv", "replay", bag, *words)
        assert done.stdout.count("identical in every byte") == 5, done.stdout


@pytest.mark.parametrize(
    ("words", "code", "expected"),
    [
        ("fault list", 1, "hsv: error: no run in ROS_DOMAIN_ID="),
        long("topic", 1, "hsv: error: no node of the graph in ROS_DOMAIN_ID="),
        long("watch", 1, "hsv: error: no run in ROS_DOMAIN_ID="),
        long("set tua 0.8", 2, "name = 'tua': expected a parameter that may change in flight, feedback.tau"),
        long("topic --every 0", 2, "every = '0': expected a number"),
        long("topic /hsv//state", 2, "(topic name must not contain repeated '/')"),
        long("fault list --namespace 9x", 2, "namespace = '9x'"),
    ],
)
def test_commands_refuse_in_one_line(processes, words, code, expected):
    done = processes.run("hsv", *words.split())
    assert done.returncode == code and expected in last_line(done), done.stdout


@pytest.mark.long
@pytest.mark.parametrize(("number", "after"), [(signal.SIGINT, 0.2), (signal.SIGTERM, 2.0)])
def test_a_command_is_interrupted_in_one_line(processes, number, after):
    # Interrupt it early: after 2 s a fast machine is waiting, a slow one still importing. The silent node keeps the
    # command from ending by itself before it has used so much processor time.
    silent = processes.start("ros2", "run", "hsv_ctrl", "notch_filter")
    domain = int(processes.environment["ROS_DOMAIN_ID"])
    wait_until(lambda: is_published(domain, "/hsv/filtered_state"), [silent.pid])
    popen = processes.start("hsv", "topic", "/hsv/filtered_state")
    wait_until(lambda: used([popen.pid]) > min(after, 0.6), [popen.pid], pause=lambda _: time.sleep(0.02))
    popen.send_signal(number)
    output = output_of(popen)
    assert popen.returncode == 130 and output.splitlines()[-1].endswith("error: interrupted"), output


@pytest.mark.long
def test_topics_are_listed_and_printed_with_units(processes):
    bag = processes.folder / "flown"
    flight = processes.start("hsv", "run", "case1", "--real-time-factor", "0.5", "--no-report", "--bag", bag)
    wait_until(lambda: recorded_steps(bag), [flight.pid])
    listed = [json.loads(line) for line in _lines(processes.run("hsv", "topic", "--json"))]
    rows = {row["topic"]: row for row in listed}
    assert not any("/_" in topic for topic in rows)  # the topics of an action are hidden, as in ros2 topic
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


def _lines(done):
    assert done.returncode == 0, done.stdout
    # DDS prints a line on standard error if another process of the machine holds a lock of its shared memory.
    return [line for line in done.stdout.splitlines() if not line.startswith("waiting for ") and "RTPS_" not in line]
