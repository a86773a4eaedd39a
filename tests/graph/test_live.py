"""Viewers of every kind do not change a flight, and the commands that they send are recorded."""

import json
import os
import re
import signal
import socket
import threading

import numpy as np
import pytest
from live_clients import FoxgloveClient, PageClient, addresses, assert_as_recorded, assert_without_gap
from node_processes import children, fly_until, short_scenario
from waiting import exit_code_of, output_of, wait_until

from hsv.bags.flight import flight_fingerprint
from hsv.bags.reader import Bag
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.pages.panels import LIVE_CURVES

pytestmark = pytest.mark.graph

LIVE = ("--live", "--live-port", "0", "--no-report")


class Watched:
    """A flight with the live view, and its output so far."""

    def __init__(self, processes, *words):
        self.log = processes.folder / "live.txt"
        with self.log.open("w") as output:
            self.popen = processes.start("hsv", "run", *words, *LIVE, output=output)
        wait_until(lambda: "live data" in self.text or self.popen.poll() is not None, [self.popen.pid])
        self.page, self.port = addresses(self.text)

    @property
    def text(self):
        return self.log.read_text()

    def land(self):
        """Wait until the flight has ended, which must be with exit code 0."""
        wait_until(lambda: self.popen.poll() is not None, [self.popen.pid])
        assert self.popen.returncode == 0, self.text


@pytest.mark.long
def test_five_viewers_one_of_whom_never_reads_change_no_bit(processes, tmp_path):
    scenario = short_scenario(tmp_path, duration=20)
    watched = Watched(processes, scenario, "--bag", tmp_path / "bag", "--real-time-factor", "10")
    readers = [FoxgloveClient(watched.port) for _ in range(2)]
    leaves = FoxgloveClient(watched.port)
    idle = FoxgloveClient(watched.port, reads=False)
    page = PageClient(watched.page)
    threading.Thread(target=lambda: all(iter(page.read, False)), daemon=True).start()
    wait_until(lambda: len(leaves.messages["/hsv/state"]) > 50, [watched.popen.pid])
    leaves.leave()
    late = PageClient(watched.page)
    while late.read():
        pass
    watched.land()
    idle.leave()
    bag = Bag(tmp_path / "bag")
    assert flight_fingerprint(bag) == fly(assemble_flight(load_scenario(str(scenario)))).fingerprint
    for reader in readers:
        reader.wait()
        # At ten times real time, a reader on a busy machine may miss messages.
        assert_as_recorded(reader, bag)
    # A late viewer gets the flight from its start to its end, and how it ended.
    times = late.times(len(LIVE_CURVES))
    assert times[0] < 10.0 and times[-1] == pytest.approx(20.0) and np.all(np.diff(times) > 0)
    assert late.status["ending"] == {"how": "finished", "time": 20.0}
    assert late.status["bag"] == str(tmp_path / "bag")
    assert late.status["limits"]["fuel_equivalence_ratio"] == [0.0, 1.5]


def test_what_the_page_asks_is_acknowledged_and_recorded(processes, tmp_path):
    scenario = short_scenario(tmp_path, duration=3600, fault=3000)
    watched = Watched(processes, scenario, "--bag", tmp_path / "bag", "--real-time-factor", "2")
    page = PageClient(watched.page)
    while len(page.data) < 5_000:
        assert page.read()
    loss = {"channel": "elevator_deflection", "type": "loss_of_effectiveness"}
    refused = page.ask("inject", **loss, parameters="1.8")
    assert refused["accepted"] is False and "fault.effectiveness = '1.8': expected from 0 to 1" in refused["message"]
    refused = page.ask("tau", tau="0.5")
    assert refused["accepted"] is False and "expected 1: no other factor is certified" in refused["message"]
    injected = page.ask("inject", **loss, parameters="0.9")
    assert injected["accepted"], injected
    paused = page.ask("pause", paused="true")
    # No step is flown from the acknowledged step on.
    assert paused["message"].startswith(f"paused = true from step {paused['step']} on")
    while not page.status["settings"].get("paused"):
        assert page.read()
    resumed = page.ask("pause", paused="false")
    assert resumed["step"] == paused["step"]
    faster = page.ask("pace", real_time_factor="0")
    cleared = page.ask("clear")
    assert faster["accepted"] and cleared["accepted"] and cleared["step"] > injected["step"]
    fault = "loss_of_effectiveness 0.9 of elevator_deflection"
    while f"{fault} has ended" not in [event["words"] for event in page.status["events"]]:
        assert page.read()
    assert (f"{fault} begins", injected["step"]) in [(e["words"], e["step"]) for e in page.status["events"]]
    fly_until(watched.popen, tmp_path / "bag", cleared["step"] + 50)
    watched.popen.send_signal(signal.SIGINT)
    wait_until(lambda: watched.popen.poll() is not None, [watched.popen.pid])
    active = [message.step for _, message in Bag(tmp_path / "bag").decode("/hsv/actuator") if message.active]
    assert active == list(range(injected["step"], cleared["step"]))


@pytest.mark.long
def test_at_real_time_pace_nothing_is_missed(processes, tmp_path):
    watched = Watched(processes, short_scenario(tmp_path, duration=20), "--bag", tmp_path / "bag")
    client = FoxgloveClient(watched.port)
    watched.land()
    client.wait()
    assert re.search(r" in [\d.]+ s, (1|0\.\d+) x real time", watched.text)
    assert_without_gap(client, Bag(tmp_path / "bag"))


@pytest.mark.long
@pytest.mark.parametrize("composed", [(), ("--composed",)], ids=["separate", "composed"])
def test_at_full_speed_a_stopped_live_node_delays_no_other_node(processes, tmp_path, composed):
    scenario = short_scenario(tmp_path, duration=120)
    words = [scenario, "--bag", tmp_path / "bag", "--real-time-factor", "0", *composed]
    watched = Watched(processes, *words)
    client = FoxgloveClient(watched.port)
    wait_until(lambda: len(client.messages["/hsv/state"]) > 10, [watched.popen.pid])
    os.kill(children(watched.popen.pid)["live"], signal.SIGSTOP)
    watched.land()
    bag = Bag(tmp_path / "bag")
    assert flight_fingerprint(bag) == fly(assemble_flight(load_scenario(str(scenario)))).fingerprint
    assert 0 < len(client.messages["/hsv/state"]) < len(bag.times("/hsv/state"))


def test_a_port_in_use_ends_it_before_anything_has_begun(processes, tmp_path):
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        held.listen()
        port = held.getsockname()[1]
        refused = processes.start("hsv", "run", "case1", "--bag", tmp_path / "bag", "--live", "--live-port", str(port))
        said = output_of(refused)
    assert refused.returncode == 2 and said.count("\n") == 1
    assert f"live-port = {port}: port {port}: address already in use, expected two free ports" in said
    assert not (tmp_path / "bag").exists()


@pytest.mark.long
def test_a_live_node_that_is_killed_takes_no_flight_with_it(processes, tmp_path):
    watched = Watched(processes, short_scenario(tmp_path), "--bag", tmp_path / "bag")
    os.kill(children(watched.popen.pid)["live"], signal.SIGKILL)
    watched.land()
    assert "live: [WARN] was killed by SIGKILL" in watched.text
    assert len(Bag(tmp_path / "bag").times("/hsv/state")) == 251


@pytest.mark.long
def test_a_flight_is_watched_to_its_end_and_its_bits_are_the_same(processes, tmp_path):
    scenario, bag, said = short_scenario(tmp_path, duration=16, fault=1), tmp_path / "bag", tmp_path / "watched"
    words = ("--real-time-factor", "0.02", "--no-report", "--bag", bag, "--composed")
    flying = processes.start("hsv", "run", scenario, *words)
    fly_until(flying, bag, 1)
    with said.open("w") as output:
        watching = processes.start("hsv", "watch", "--json", output=output)
    # The flight is slow until the viewer shows it, however long the viewer takes to start.
    wait_until(lambda: "{" in said.read_text(), [watching.pid])
    assert processes.run("hsv", "set", "real_time_factor", "2").returncode == 0
    assert exit_code_of(watching) == 0 == exit_code_of(flying), said.read_text()
    rows = [json.loads(line) for line in said.read_text().splitlines() if line.startswith("{")]
    times = [row["time"] for row in rows]
    assert len(rows) > 2 and times == sorted(set(times)) and times[-1] <= 16.0
    last = rows[-1]
    assert last["faults"] == ["elevator_deflection loss_of_effectiveness"]
    assert 0.0 <= last["tube_level"] <= 1.0 and 26000.0 < last["altitude"] < 26400.0 and last["velocity_error"] < 0.0
    assert flight_fingerprint(Bag(bag)) == fly(assemble_flight(load_scenario(str(scenario)))).fingerprint
