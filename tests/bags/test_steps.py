"""Rows of the same step, and warnings about bags that lack steps."""

import time
import tracemalloc

import numpy as np
import pytest

from hsv.bags.description import INTERFACE_VERSION
from hsv.bags.info import describe
from hsv.bags.reader import Bag
from hsv.bags.steps import bag_warnings, completeness, expected_stamps, irregularities, joined
from hsv.bags.writer import BagWriter
from hsv.base.errors import ParameterError, RecordingError
from hsv.flight.assembly import flight_parameters
from hsv.flight.scenario import load_scenario
from hsv.model.plant import MAX_STEPS, PLANT_PARAMETERS, Plant

STATE, FORCES = "/hsv/state", "/hsv/forces"
KINDS = {STATE: "hsv_msgs/msg/VehicleState", FORCES: "hsv_msgs/msg/VehicleForces"}
PERIOD = 20_000_000
LACKS = " lacks 1 of 3 steps, the first at t ="


def _bag(kit, path, state, forces, **custom):
    writer = BagWriter(path / "bag", [kit.topic(name, kind) for name, kind in KINDS.items()], custom)
    for topic, steps in ((STATE, state), (FORCES, forces)):
        for step in steps:
            time = step * PERIOD
            writer.write(topic, time, kit.messages.stamped(KINDS[topic], time, step))
    writer.close()
    return Bag(path / "bag")


def test_a_whole_bag_is_joined_as_it_is(kit, tmp_path):
    bag = _bag(kit, tmp_path, list(range(5)), list(range(5)))
    rows = joined(bag, (STATE, FORCES))
    assert rows[STATE] is bag.columns(STATE) and rows[FORCES] is bag.columns(FORCES)
    assert irregularities(bag) == []


@pytest.mark.parametrize(
    ("state", "forces", "common", "said"),
    [
        ([0, 1, 2, 3, 4], [0, 1, 3, 4], [0, 1, 3, 4], [f"{FORCES} lacks 1 of 5 steps, the first at t = 0.04 s"]),
        ([0, 1, 2, 3, 4], [0, 1, 2], [0, 1, 2], [f"{FORCES} lacks 2 of 5 steps, the first at t = 0.06 s"]),
        ([0, 1, 2, 3], [0, 2, 1, 3], [0, 1, 2, 3], []),  # MCAP does not require an order
        ([0, 1, 1, 2], [0, 1, 2], [0, 1, 2], [f"{STATE} is out of order at t = 0.02 s"]),
        ([0, 1], [1, 2], [1], [f"{STATE}{LACKS} 0.04 s", f"{FORCES}{LACKS} 0.00 s"]),
    ],
    ids=["hole", "end", "swapped", "twice", "both"],
)
def test_rows_are_joined_by_their_steps(kit, tmp_path, state, forces, common, said):
    bag = _bag(kit, tmp_path, state, forces)
    rows = joined(bag, (STATE, FORCES))
    for topic in KINDS:
        assert rows[topic]["step"].tolist() == common
        assert rows[topic]["header.stamp"].tolist() == [step * PERIOD for step in common]
    steps = bag.columns(FORCES)["step"].tolist()
    drag = [bag.columns(FORCES)["drag"][steps.index(step)] for step in common]
    np.testing.assert_array_equal(rows[FORCES]["drag"], drag)
    assert irregularities(bag) == said


def test_no_common_step_is_refused(kit, tmp_path):
    with pytest.raises(RecordingError, match="holds no complete step"):
        joined(_bag(kit, tmp_path, [0], [1]), (STATE, FORCES))


def announced_bag(kit, folder, **announced):
    """Return a bag of three steps whose run announces more."""
    kinds = {STATE: KINDS[STATE], "/hsv/run": "hsv_msgs/msg/Run"}
    writer = BagWriter(folder / "bag", [kit.topic(name, kind) for name, kind in kinds.items()])
    values = {"last_step": 2, "period": 0.02, "interface_version": INTERFACE_VERSION, **announced}
    writer.write("/hsv/run", 0, kit.messages.serialize(kit.messages.make(kinds["/hsv/run"], **values)))
    for step in range(3):
        writer.write(STATE, step * PERIOD, kit.messages.stamped(kinds[STATE], step * PERIOD, step, status=0))
    writer.close()
    return Bag(folder / "bag")


def test_a_bag_that_ends_before_its_run_is_incomplete_in_text_and_in_json(kit, tmp_path):
    described = describe(announced_bag(kit, tmp_path, last_step=4))
    assert described["complete"] is False and "ends at t = 0.04 s of 0.08 s" in described["warnings"]


@pytest.mark.parametrize("announced", [{"last_step": 400_000_000}, {"period": -1.0}, {"period": float("nan")}])
def test_a_bag_that_tells_of_more_steps_than_any_flight_has_is_not_believed(kit, tmp_path, announced):
    bag = announced_bag(kit, tmp_path, **announced)
    tracemalloc.start()
    with pytest.raises(RecordingError, match=r"tells of \d+ steps of \S+ s, expected at most 5000000 of at most 1 s"):
        expected_stamps(bag)
    peak = tracemalloc.get_traced_memory()[1]  # the definitions of the messages, if nothing has read them before
    tracemalloc.stop()
    assert peak < 8 * MAX_STEPS
    assert "expected at most 5000000" in bag_warnings(bag)[-1]


def test_work_follows_the_messages_not_the_number_of_steps_that_a_bag_tells(kit, tmp_path):
    """A bag may announce as many steps as our own recorder can write, and lack nearly all of them."""
    bag = announced_bag(kit, tmp_path, last_step=MAX_STEPS - 1)
    begun = time.process_time()
    assert "ends at t = 0.04 s of 99999.98 s" in bag_warnings(bag)
    assert completeness(bag) == "3 of 5000000 steps"
    assert time.process_time() - begun < 3.0


def test_no_flight_has_more_steps_than_a_bag_may_tell():
    period, duration = 0.02, {p.name: p for p in PLANT_PARAMETERS}["duration"].maximum
    assert duration / period <= MAX_STEPS
    values = flight_parameters(load_scenario("case1"))
    with pytest.raises(ParameterError, match=r"duration = 100000 s: 1000000000 periods, expected at most 5000000"):
        Plant.from_parameters(values | {"duration": duration, "period": 1e-4})
