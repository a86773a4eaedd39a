"""Graphs with namespaces and remapping, duplicate nodes, and parameters that are dumped and loaded again."""

import json
import re
import sys
from itertools import pairwise

import numpy as np
import parameter_dump
import pytest
from node_processes import last_line, recorded_steps, short_scenario
from waiting import output_of, wait_until

from hsv.bags.description import FAULT_INJECTOR, NOTCH_FILTER, PLANT, RECORDER, TUBE_MPC, graph
from hsv.bags.flight import flight_fingerprint, state_columns
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import complete_steps
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.graph.launcher import parameter_arguments
from hsv.graph.preparation import RunOptions, prepare

pytestmark = pytest.mark.graph

FUEL = "fuel_equivalence_ratio"

DURATION = 11.0
"""Seconds: a replay needs more than ten in which the controller acts."""

REMAPPED = [
    word
    for rule in (
        "hsv/state:=truth",
        "hsv/command:=/wish/command",
        "clock:=tick",
        "hsv/run:=announced",
        "hsv/actuator:=/faults/now",
        "hsv/inject_fault:=/faults/inject",
    )
    for word in ("-r", rule)
]
"""Remapping of some topics and services, given to every node; it has no effect on nodes that do not use them."""


def by_hand(processes, nodes, arguments):
    """Start nodes one by one, each with the arguments under its name."""
    return {
        node.name: processes.start("ros2", "run", node.package, node.executable, "--ros-args", *arguments[node.name])
        for node in nodes
    }


@pytest.mark.long
def test_two_graphs_in_one_domain(processes):
    scenario = short_scenario(processes.folder, DURATION, 3)
    words = ("hsv", "run", scenario, "--no-report", "--json", "--bag")
    first = processes.start(*words, processes.folder / "first", "--namespace", "/lab/veh1")
    second = processes.start(*words, processes.folder / "second", "--namespace", "veh2", "--composed")
    for run in (first, second):
        said = output_of(run)
        assert run.returncode == 0, said
    flight = fly(assemble(flight_parameters(load_scenario(str(scenario)))))
    bags = [Bag(processes.folder / name) for name in ("first", "second")]
    assert [flight_fingerprint(bag) for bag in bags] == [flight.fingerprint] * 2
    assert [bag.namespace for bag in bags] == ["/lab/veh1", "/veh2"]
    # Both graphs log to one topic, but each bag has only its own events; so the bags agree in every step.
    compared = processes.run("hsv", "diff", processes.folder / "first", processes.folder / "second")
    assert compared.returncode == 0 and "messages: identical\n" in compared.stdout, compared.stdout
    replayed = processes.run("hsv", "replay", processes.folder / "first", "--over-dds")
    assert replayed.returncode == 0, replayed.stdout


@pytest.mark.long
def test_remapped_by_hand_with_duplicates_and_parameters_dumped(processes):
    folder = processes.folder
    alone = processes.start("ros2", "run", "hsv_ctrl", "notch_filter", "--ros-args", "-r", "__ns:=/alone")
    # The flight is long enough that no change comes too late; it is interrupted.
    prepared = prepare(str(short_scenario(folder, 3600, 3)), RunOptions(real_time_factor=4.0), bag=folder / "remapped")
    files = parameter_arguments(prepared.parameter_files)
    arguments = {node.name: [*files, *REMAPPED] for node in graph()}
    arguments[NOTCH_FILTER.name] += ["-r", "__node:=nf2"]
    nodes = by_hand(processes, graph(), arguments)
    pids = [popen.pid for popen in nodes.values()]
    wait_until(lambda: recorded_steps(prepared.bag) > 10, pids)
    _refuse_duplicates(processes, files)
    _ask(processes)
    names = ["/nf2" if node is NOTCH_FILTER else f"/{node.name}" for node in graph()]
    (folder / "dumps").mkdir()
    dumped = processes.run(sys.executable, parameter_dump.__file__, folder / "dumps", *names)
    assert dumped.returncode == 0, dumped.stdout
    assert not [file.name for file in (folder / "dumps").iterdir() if "null" in file.read_text()]
    steps = recorded_steps(prepared.bag)
    wait_until(lambda: recorded_steps(prepared.bag) > steps, pids, lambda: recorded_steps(prepared.bag))
    processes.stop()
    bag = Bag(prepared.bag)
    roles = {"hsv/state": "/truth", "hsv/command": "/wish/command", "clock": "/tick", "hsv/nominal": "/hsv/nominal"}
    roles |= {"hsv/run": "/announced", "hsv/actuator": "/faults/now"}
    assert {role: bag.name_of(role) for role in roles} == roles
    scenario = load_scenario(str(short_scenario(folder, 0.02 * (complete_steps(bag) + 1), 3)))
    flown = fly(assemble(flight_parameters(scenario))).history.state
    recorded = state_columns(bag.columns("hsv/state"))
    assert np.array_equal(recorded[:steps], flown[:steps])
    # The waiting node logs once, then only every ten seconds.
    stamps = [float(found[1]) for found in re.finditer(r"\[(\d+\.\d+)\].*waiting for", output_of(alone))]
    assert stamps and all(later - earlier > 9.0 for earlier, later in pairwise(stamps))
    _fly_dumped(processes)


def _ask(processes):
    """Find the nodes by their roles; the changed settings get the values that they already have."""
    injected = processes.run("hsv", "fault", "inject", FUEL, "loss_of_effectiveness", "1")
    assert injected.returncode == 0 and f"1 of {FUEL} from step " in last_line(injected), injected.stdout
    changed = processes.run("hsv", "set", "tau", "1")
    assert changed.returncode == 0 and "feedback.tau = [1.0] from step " in last_line(changed), changed.stdout
    listed = processes.run("hsv", "fault", "list", "--json")
    assert listed.returncode == 0, listed.stdout
    assert FUEL in [fault["channel"] for fault in json.loads(last_line(listed))["active"]]


def _refuse_duplicates(processes, files):
    """Start all nodes a second time during the flight; each duplicate ends by itself with one line."""
    second = [
        processes.start("ros2", "run", node.package, node.executable, "--ros-args", *files, *REMAPPED, *words)
        for node, words in (
            (PLANT, []),
            (TUBE_MPC, ["-r", "__node:=another"]),
            (FAULT_INJECTOR, []),
            (RECORDER, ["-p", "bag.directory:=other"]),
        )
    ]
    second.append(processes.start("ros2", "run", "hsv_bringup", "composed", "--ros-args", *files))
    for refused in second:
        said = output_of(refused)
        errors = [line for line in said.splitlines() if not line.startswith("[ros2run]")]
        assert refused.returncode == 2 and len(errors) == 1, said
        assert re.search("another node (publishes|is called) /", errors[0]), said
    run = processes.run("hsv", "run", "case1", "--no-report", "--bag", processes.folder / "other")
    assert run.returncode == 2 and "expected no other" in run.stdout and len(run.stdout.splitlines()) == 1, run.stdout
    assert not (processes.folder / "other").exists()


def _fly_dumped(processes):
    """Fly with the dumped parameters. Simulated time for all nodes changes no bit."""
    folder = processes.folder
    arguments = {
        node.name: ["--params-file", str(folder / "dumps" / f"{'nf2' if node is NOTCH_FILTER else node.name}.yaml")]
        for node in graph()
    }
    for name in arguments:
        arguments[name] += ["-p", "use_sim_time:=true"]
    arguments[PLANT.name] += ["-p", f"duration:={DURATION}", "-p", "real_time_factor:=0.0"]
    arguments[NOTCH_FILTER.name] += ["-r", "__node:=nf2"]
    arguments[RECORDER.name] += ["-p", f"bag.directory:={folder / 'again'}", "-p", "bag.attachments:=['']"]
    nodes = by_hand(processes, graph(), arguments)
    wait_until(lambda: any(popen.poll() is not None for popen in nodes.values()), [p.pid for p in nodes.values()])
    for popen in nodes.values():
        assert popen.poll() in (None, 0), output_of(popen)
    processes.stop()
    scenario = load_scenario(str(short_scenario(folder, DURATION, 3)))
    expected = fly(assemble(flight_parameters(scenario))).fingerprint
    assert flight_fingerprint(Bag(folder / "again")) == expected
