"""The data of a flight that the live page receives."""

import numpy as np
from recorded_flight import record_flight

from hsv.bags.description import TOPICS, TUBE_STATUS
from hsv.pages.flights import flight_curves
from hsv.pages.live import hub as hub_module
from hsv.pages.panels import LIVE_CURVES

STEPS = 201
A_STEP = 9
"""Number of messages in a step."""


def offer(hub, messages, every=A_STEP):
    for number, message in enumerate(messages, 1):
        hub.offer(*message)
        if number % every == 0:
            hub.sample()


def test_rows_are_the_curves_of_the_report(hub, messages, bag):
    offer(hub, messages)
    rows = hub.history(0, 0)[2]
    drawn = flight_curves(bag)
    np.testing.assert_allclose(rows[:, 0], drawn.time, rtol=1e-6)
    assert len(rows) == STEPS
    for index, (panel, column) in enumerate(LIVE_CURVES, 1):
        [y] = [curve.y for curve in drawn.curves[panel.name] if curve.label == column.label]
        np.testing.assert_allclose(rows[:, index], np.broadcast_to(y if len(y) > 2 else y[0], STEPS), rtol=3e-7)


def test_a_controller_without_a_tube_is_shown_without(hub, messages):
    offer(hub, [message for message in messages if message[0] != TUBE_STATUS], A_STEP - 1)
    rows = hub.history(0, 0)[2]
    tube = np.array([False, *(curve.topic == TUBE_STATUS for _, curve in LIVE_CURVES)])
    assert len(rows) == STEPS and np.isnan(rows[:, tube]).all() and np.isfinite(rows[:, ~tube]).all()
    assert hub.status()["tau"] is None


def test_faults_come_and_the_end_is_told(hub, messages):
    offer(hub, messages[: 50 * A_STEP])
    assert hub.status()["faults"] == []
    offer(hub, messages[50 * A_STEP :])
    [fault] = hub.status()["faults"]
    assert (fault["channel"], fault["since"]) == ("elevator_deflection", 100)
    [event] = hub.status()["events"]
    assert (event["time"], event["words"]) == (2.0, f"{fault['words']} begins")
    hub.end(1, 200)
    assert hub.status()["ending"] == {"how": "finished", "time": 4.0}


def test_a_replaced_fault_is_one_event_and_every_fault_that_acted_is_shaded(hub, decode, tmp_path):
    flown = record_flight(
        tmp_path / "replaced",
        duration=4.0,
        fault=2.0,
        fault__channels=["elevator_deflection"] * 2,
        fault__types=["loss_of_effectiveness"] * 2,
        fault__parameters=["effectiveness=0.9", "effectiveness=0.8"],
        fault__starts=[1.0, 2.0],
        fault__stops=[2.0, 3.0],
    )
    by_step = {}
    for topic in TOPICS:
        for time, data in flown.messages(topic):
            by_step.setdefault(time, []).append((topic, time, data))
    offer(hub, [message for time in sorted(by_step) for message in by_step[time]])
    kind = "elevator_deflection", "loss_of_effectiveness"
    shades = [(shade["channel"], shade["type"], shade["from"], shade["to"]) for shade in hub.status()["shades"]]
    assert shades == [(*kind, 50, 100), (*kind, 100, 150)]
    first, second = (f"loss_of_effectiveness {share} of elevator_deflection" for share in (0.9, 0.8))
    events = [(event["step"], event["words"]) for event in hub.status()["events"]]
    assert events == [(50, f"{first} begins"), (100, f"{second} replaces {first}"), (150, f"{second} has ended")]


def test_a_long_flight_is_thinned_and_keeps_its_beginning(hub, messages, monkeypatch):
    monkeypatch.setattr(hub_module, "MAX_ROWS", 1024)
    hub.start_run("2f" * 16, 0.02, 200)
    period = 20_000_000
    [state] = [index for index, message in enumerate(messages[:A_STEP]) if message[0] == "hsv/state"]
    generation = hub.history(0, 0)[0]
    step = messages[state : state + 1] + [m for i, m in enumerate(messages[:A_STEP]) if i != state]
    for number in range(2500):
        for topic, _, data in step:
            # The bytes are always those of step 0, because only the number of rows matters here.
            hub.offer(topic, number * period, data)
        hub.sample()
    later, first, rows = hub.history(generation, 0)
    assert later > generation and first == 0 and len(hub._rows) >= len(rows) > len(hub._rows) // 2
