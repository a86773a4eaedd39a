"""What the page is told of a flight."""

import numpy as np
import pytest

from hsv.bags.description import TUBE_STATUS
from hsv.pages.flights import flight_curves
from hsv.pages.live import hub as hub_module
from hsv.pages.panels import LIVE_CURVES

STEPS = 201
A_STEP = 9
"""Messages."""


def offer(hub, messages, every=A_STEP):
    for number, message in enumerate(messages, 1):
        hub.offer(*message)
        if number % every == 0:
            hub.sample()
            hub.decode()


def test_rows_are_the_curves_of_the_report(hub, messages, bag):
    offer(hub, messages)
    rows = hub.history(0, 0).rows
    drawn = flight_curves(bag)
    np.testing.assert_allclose(rows[:, 0], drawn.time, rtol=1e-6)
    assert len(rows) == STEPS
    for index, (panel, column) in enumerate(LIVE_CURVES, 1):
        [y] = [curve.y for curve in drawn.curves[panel.name] if curve.label == column.label]
        np.testing.assert_allclose(rows[:, index], np.broadcast_to(y if len(y) > 2 else y[0], STEPS), rtol=3e-7)


@pytest.mark.parametrize("every", [1, 4, 7, 100])
def test_only_whole_steps_are_sampled_whenever_it_is_looked(hub, messages, every):
    offer(hub, messages, every)
    whole = Exact(messages)
    rows = hub.history(0, 0).rows
    assert 1 < len(rows) <= STEPS
    assert np.all(np.diff(rows[:, 0]) > 0)
    labels = [(panel.name, curve.label) for panel, curve in LIVE_CURVES]
    command = rows[:, 1 + labels.index(("elevator_deflection", "command"))]
    np.testing.assert_allclose(command, whole.command[np.rint(rows[:, 0] / 0.02).astype(int)], rtol=1e-6)


class Exact:
    """What was commanded, by step."""

    def __init__(self, messages):
        from recorded_flight import message_types

        types = message_types()
        self.command = np.array(
            [
                types.deserialize_cdr(data, "hsv_msgs/msg/ControlInput").elevator_deflection
                for topic, _, data in messages
                if topic == "hsv/command"
            ]
        )


def test_a_controller_without_a_tube_is_shown_without(hub, messages):
    offer(hub, [message for message in messages if message[0] != TUBE_STATUS], A_STEP - 1)
    rows = hub.history(0, 0).rows
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


def test_status_changes_when_something_has_changed(hub, messages):
    offer(hub, messages[: 50 * A_STEP])
    version = hub.version
    offer(hub, messages[50 * A_STEP : 90 * A_STEP])
    assert hub.version == version
    hub.diagnose("plant", 0, "running", {"step": "90"})
    hub.diagnose("plant", 0, "running", {"step": "90"})
    assert hub.version == version + 1


def test_a_reader_gets_what_it_lacks(hub, messages):
    offer(hub, messages[: 50 * A_STEP])
    first = hub.history(-1, 7)
    assert first.first == 0 and len(first.rows) == 50
    offer(hub, messages[50 * A_STEP :])
    rest = hub.history(first.generation, 50)
    assert rest.first == 50 and rest.generation == first.generation and len(rest.rows) == STEPS - 50
    hub.start_run("2e" * 16, 0.02, 200)
    anew = hub.history(first.generation, STEPS)
    assert anew.generation != first.generation and len(anew.rows) == 0


def test_a_long_flight_is_thinned_and_keeps_its_beginning(hub, messages, monkeypatch):
    monkeypatch.setattr(hub_module, "MAX_ROWS", len(hub._rows))
    period = 20_000_000
    [state] = [index for index, message in enumerate(messages[:A_STEP]) if message[0] == "hsv/state"]
    generation = hub.history(0, 0).generation
    step = messages[state : state + 1] + [m for i, m in enumerate(messages[:A_STEP]) if i != state]
    for number in range(2500):
        for topic, _, data in step:
            # The bytes are those of step 0: what is looked at here is how many rows are kept.
            hub.offer(topic, number * period, data)
        hub.sample()
        hub.decode()
    history = hub.history(generation, 0)
    assert history.generation > generation and len(hub._rows) >= len(history.rows) > len(hub._rows) // 2
