"""Wrong tables of faults, actuators, air, sensors and links, and wrong seeds: one line with the expected value."""

import pytest

from hsv.base.errors import ScenarioError
from hsv.flight.scenario import parse_scenario

FLIGHT = """
title = "a flight with equipment"
duration = "20 s"
{seed}
[initial]
altitude = "85000 ft"
velocity = "7900 ft/s"

{tables}
"""

FAULT = '[[fault]]\nchannel = "elevator_deflection"\nstart = "10 s"\n'
ELEVATOR = "[actuator.elevator_deflection]\n"
PITCH_RATE = "[sensors.pitch_rate]\n"
GUST = '[gust]\nstarts = ["5 s", "8 s"]\n'

WRONG = [
    (FAULT + 'type = "baias"', "sensor_freeze (did you mean 'bias'?)"),
    (FAULT, "fault[0].type: missing"),
    (FAULT.replace("_deflection", "") + 'type = "bias"\noffset = "1 deg"', "fault[0].channel = 'elevator': expected"),
    (FAULT + 'type = "bias"', "fault[0].offset: missing, expected offset for bias"),
    (FAULT + 'type = "bias"\noffset = "1 m"', "fault[0].offset = '1 m': wrong unit, expected a finite quantity"),
    (FAULT + 'type = "bias"\noffset = { uniform = ["0 deg", "90 deg"] }', "expected all values from -30 to 30 deg"),
    (FAULT + 'type = "delay"\nsteps = { uniform = [1.5, 4] }', "expected uniform = [least, largest], both whole num"),
    (FAULT + 'type = "delay"\nsteps = 1.5', "fault[0].steps = 1.5: expected a whole number from 1 to 50"),
    (FAULT + 'type = "stop_limit"\nlower = "10 deg"\nupper = "-10 deg"', "expected at most upper, -10 deg"),
    (FAULT + 'type = "lock_in_place"\nrandom_on = "1 s"', "fault[0].random_off = 0 s: expected above 0 s where random"),
    (FAULT + 'type = "lock_in_place"\nstop = "5 s"', "fault[0].stop = 5 s: expected a time after its start, 10 s"),
    (FAULT + 'type = "hard_over"\nrate = "0 deg/s"', "fault[0].rate = 0: expected a rate whose sign selects the stop"),
    (FAULT + 'type = "reversal"\nintermittent_duty = "25 %"', "no effect, expected an intermittent_period above 0 s"),
    ('[fault]\ntype = "lock_in_place"', "fault = {'type': 'lock_in_place'}: expected a list of tables"),
    (ELEVATOR + 'set = "elevator_500"', "expected one of ideal, elevator_50, elevator_150, elevator_20, "),
    (ELEVATOR + "order = 1", "actuator.elevator_deflection.natural_frequency: none given, expected one for an order"),
    (ELEVATOR + 'set = "elevator_50"\nstop = ["10 deg", "20 deg"]', "elevator_deflection.stop: 2 values, expected one"),
    (
        ELEVATOR + 'order = 1\nnatural_frequency = "50 rad/s"\ndamping_ratio = 0.7',
        "actuator.elevator_deflection.damping_ratio: expected none for an order of 1",
    ),
    ('[winds]\nforward = "10 m/s"', "winds: unknown key, expected one of title, "),
    ('[wind]\nforward = ["1 m/s", "2 m/s"]', "wind.forward = ['1 m/s', '2 m/s']: expected one value, not a list"),
    (GUST + 'up = "1 m/s"\nlengths = "500 m"', "gust.up: 1 values, expected as many as gust.starts, 2"),
    (GUST.replace("8 s", "20 s") + 'lengths = ["500 m", "500 m"]', "gust.starts[1] = 20 s: expected a time before the"),
    (PITCH_RATE + 'noise = { sigma = "1 deg/s" }', "expected a number or { uniform = [least, largest] } or "),
    (PITCH_RATE + "noise = []", "sensors.pitch_rate.noise = []: expected one value at least"),
    (PITCH_RATE + 'minimum = "25 deg/s"\nmaximum = "20 deg/s"', "expected less than maximum, 20 deg/s"),
    (PITCH_RATE + 'drift_sigma = "1 deg/s"', "sensors.pitch_rate.drift_sigma: expected with a drift_time only"),
    (PITCH_RATE + 'drift_time = "10 s"', "sensors.pitch_rate.drift_time: expected with a drift_sigma only"),
    ("[link]\ncommand = 1", "link.command = 1: expected a table of delay, jitter, loss, burst, corruption, checksum"),
    ("[link.command]\ndelay = 51", "link.command.delay = 51: expected a whole number from 0 to 50"),
    ('[link.measurement]\nloss = "90 %"\nburst = 2', "link.measurement.burst = 2.0: expected 0, or at least 9"),
    ("[link.measurement]\nburst = 3", "link.measurement.burst: has no effect without link.measurement.loss, expected"),
    ("[link.measurement]\nchecksum = true", "link.measurement.checksum: has no effect without link.measurement.corr"),
    ("[link.measurement]\nchecksum = 1", "link.measurement.checksum = 1: expected bool"),
    ('[link]\ncomputational_delay = "-5 ms"', "link.computational_delay = '-5 ms': expected from 0 to 1000 ms"),
    ('[estimator.noise]\naltitude = "1 ft"', "estimator.noise.altitude: has no effect without estimator.enabled"),
    ('[effectiveness]\ntime = "2 s"', "effectiveness.time: has no effect without effectiveness.enabled, expected both"),
    ('seed = "1"', "seed = '1': expected a whole number"),
    ("seed = 9007199254740993", "seed = 9007199254740993: expected at most 9007199254740992"),
]


def flight(text):
    """Return a scenario with these tables, or with a line before all tables."""
    own = {"tables": text, "seed": ""} if text.startswith("[") else {"tables": "", "seed": text}
    return FLIGHT.format(**own)


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_what_is_wrong_is_refused_with_one_line_that_names_it(text, message):
    with pytest.raises(ScenarioError) as refused:
        parse_scenario(flight(text), "flight")
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith("scenario 'flight': ") and message in str(refused.value)


def test_the_flight_is_right_without_what_is_wrong():
    right = flight(GUST + 'up = ["1 m/s", "2 ft/s"]\nlengths = ["500 m", "1000 ft"]')
    assert parse_scenario(right, "flight").settings == {
        "gust.starts": [5.0, 8.0],
        "gust.up": [1.0, 0.6096],
        "gust.lengths": [500.0, 304.8],
    }
