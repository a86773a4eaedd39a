"""The description of a bag reports the events in it."""

import json
import math

import numpy as np
import pytest

from hsv.bags.info import describe
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter

PERIOD = 10**7


@pytest.fixture
def described(kit, tmp_path):
    actuator, command, tube = (f"hsv_msgs/msg/{name}" for name in ("Actuator", "ControlInput", "TubeStatus"))
    topics = {"/hsv/actuator": actuator, "/hsv/command": command, "/hsv/tube_status": tube}
    writer = BagWriter(
        tmp_path / "bag", [kit.topic(name, kind) for name, kind in topics.items()], {"scenario": "case1", "seed": "3"}
    )
    writer.attach("scenario.toml", "application/toml", b"12345")
    elevator, fuel = kit.messages.fault(0.9), kit.messages.fault(0.5, "fuel_equivalence_ratio")
    for step in range(100):
        time = step * PERIOD
        outside = 70 <= step < 75
        given = {
            actuator: {"active": [fuel] * (20 <= step < 30 or 40 <= step < 50) + [elevator] * (step >= 60)},
            command: {"saturated": np.array([80 <= step < 90, step == 85])},
            tube: {
                "status": 1 if step < 10 else 2 if outside else 0,
                "level": math.nan if step < 10 else 1.5 if outside else 0.5,
                "inside": step >= 10 and not outside,
            },
        }
        for name, kind in topics.items():
            writer.write(name, time, kit.messages.stamped(kind, time, step, **given[kind]))
    writer.close()
    return describe(Bag(tmp_path / "bag"))


def test_description(described):
    described = json.loads(json.dumps(described, allow_nan=False))
    assert described["messages"] == 300
    assert not described["complete"] and described["warnings"][0].startswith("no topic /clock")
    assert described["duration_s"] == pytest.approx(0.99)
    assert described["custom_data"] == {"scenario": "case1", "seed": "3"}
    assert described["attachments"] == [{"name": "scenario.toml", "media_type": "application/toml", "size_bytes": 5}]
    assert [topic["name"] for topic in described["topics"]] == ["/hsv/actuator", "/hsv/command", "/hsv/tube_status"]
    assert all(topic["rate_hz"] == pytest.approx(100) and topic["messages"] == 100 for topic in described["topics"])
    loss = {"type": "loss_of_effectiveness", "parameters": {"effectiveness": 0.5}}
    assert described["faults"] == [
        {"channel": "fuel_equivalence_ratio", "start_s": 0.2, "end_s": 0.3} | loss,
        {"channel": "fuel_equivalence_ratio", "start_s": 0.4, "end_s": 0.5} | loss,
        {"channel": "elevator_deflection", "start_s": 0.6, "end_s": None}
        | loss
        | {"parameters": {"effectiveness": 0.9}},
    ]
    assert described["saturation"] == {"steps": 10, "fuel_equivalence_ratio_steps": 10, "elevator_deflection_steps": 1}
    assert described["tube"] == {
        "checked_steps": 90,
        "outside_steps": 5,
        "largest_level": 1.5,
        "excursions": [{"start_s": 0.7, "end_s": 0.75}],
        "uncertified_steps": 0,
        "uncertified_hardware_steps": 0,
        "uncertified_rate_steps": 0,
        "uncertified_disturbance_steps": 0,
    }
    assert described["not_covered"] is None  # without parameters there is nothing to compare
