"""Campaigns over the distributions of a scenario, and single flights of such campaigns."""

import pytest

from hsv.base.errors import ScenarioError
from hsv.flight.assembly import assemble_flight
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import parse_scenario
from hsv.graph.campaign_replay import replay_in_process

SCENARIO = """
extends = "case1"
duration = "3 s"
[[command]]
altitude_change = { normal = ["60 ft", "5 ft"] }
start = { uniform = ["0.5 s", "1 s"] }
[initial]
velocity = { uniform = ["7890 ft/s", "7910 ft/s"] }
[integral]
rate = { uniform = ["0 / s", "0.1 / s"] }
[vehicle.perturbation]
mass = { normal = ["0 %", "2 %"] }
[notch]
zero_damping = { uniform = [0.04, 0.06] }
[[fault]]
channel = "elevator_deflection"
type = "loss_of_effectiveness"
effectiveness = { uniform = [0.8, 1.0] }
start = "2 s"
[limits]
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenario") / "drawn.toml"
    path.write_text(SCENARIO)
    return str(path)


@pytest.fixture(scope="module")
def flown(scenario, tmp_path_factory):
    campaign = plan(scenario, samples=20, seed=5, scale=0.0)
    out = tmp_path_factory.mktemp("campaign") / "drawn.parquet"
    run_campaign(campaign, ResultStore(out, campaign), Executor())
    return Results(out)


def test_every_distribution_is_a_factor_beside_those_of_the_command(scenario):
    own = {"initial.velocity", "command[0].altitude_change", "command[0].start", "integral.rate", "notch.zero_damping"}
    assert {f.name for f in plan(scenario, scale=0.0).factors} == own | {"mass", "fault[0].effectiveness"}
    everything = {f.name: f for f in plan(scenario, factors={"fault[0].effectiveness": (0.9, 1.0)}).factors}
    assert len(everything) == 10 + len(own) + 1
    # A distribution in the file replaces the bounds of all parameters; one in the command replaces both.
    assert (everything["mass"].kind, everything["mass"].high) == ("normal", 0.06)
    assert everything["fault[0].effectiveness"].low == 0.9


def test_a_flight_written_as_a_scenario_flies_by_itself_as_recorded_in_every_bit(flown):
    alone = fly(assemble_flight(parse_scenario(flown.file(7), "alone")))
    assert alone.fingerprint == flown.row(7)["fingerprint"]
    assert replay_in_process(flown, 7).differing == []


def test_every_number_drawn_is_flown(flown):
    for flight in range(3):
        sample, scenario = flown.sample(flight), parse_scenario(flown.file(flight), "alone")
        assert scenario.initial.velocity == sample["initial.velocity"]
        # Before the sampled changes stands the change that leads to the same target from another start.
        assert scenario.command[1].altitude_change == sample["command[0].altitude_change"]
        assert scenario.command[1].start == scenario.command[1].end == sample["command[0].start"]
        assert scenario.settings["integral.rate"] == sample["integral.rate"]
        assert scenario.vehicle.perturbation == {"mass": sample["mass"]}
        assert scenario.settings["notch.zero_damping"] == [sample["notch.zero_damping"]]
        assert scenario.fault[0].parameters["effectiveness"] == sample["fault[0].effectiveness"]
    assert flown.frame()["fingerprint"].nunique() == 20


def test_values_that_do_not_go_together_are_told_with_their_flight(tmp_path, out):
    path = tmp_path / "drawn.toml"
    ends = 'end = { uniform = ["0.8 s", "1.4 s"] }\naltitude_change'
    path.write_text(SCENARIO.replace("altitude_change", ends, 1))
    campaign = plan(str(path), samples=40, scale=0.0)
    with pytest.raises(ScenarioError, match=r"^flight \d+: scenario 'drawn': command\[0\].end = .*expected a time"):
        run_campaign(campaign, ResultStore(out, campaign), Executor())
