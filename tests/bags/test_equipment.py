"""Bags of flights with imperfect sensors, links, actuators and air: their description and their report."""

import math

import numpy as np
import pytest
from core_calls import written
from recorded_flight import record_flight

from hsv.bags.info import describe
from hsv.base.units import UnitSystem
from hsv.cli.look import info
from hsv.core import lib
from hsv.pages.events import flight_events
from hsv.pages.flights import reported_runs

EQUIPPED = """
extends = "case1"
seed = 7
[[fault]]
channel = "elevator_deflection"
type = "oscillation"
start = "2 s"
stop = "3 s"
amplitude = "0.5 deg"
frequency = "2 Hz"
[actuator.elevator_deflection]
set = "elevator_50"
[sensors.pitch_rate]
noise = "0.01 deg/s"
[wind]
up = "3 ft/s"
"""


@pytest.fixture(scope="module")
def equipped(tmp_path_factory):
    folder = tmp_path_factory.mktemp("equipped")
    (folder / "equipped.toml").write_text(EQUIPPED)
    return record_flight(folder / "bag", str(folder / "equipped.toml"), duration=4.0, fault=1.0)


def test_what_is_not_ideal_is_described(equipped):
    described = describe(equipped)["equipment"]
    [(channel, rms)] = described["measurement_error_rms"].items()
    assert channel == "pitch_rate"
    assert rms == pytest.approx(math.radians(0.01), rel=0.25)
    [(effector, largest)] = described["effector_largest_difference"].items()
    assert effector == "elevator_deflection"
    # The difference is the oscillation plus the lag of the actuator.
    assert math.radians(0.4) < largest < math.radians(10.0)
    assert described["air_range"] == {"wind_up": [pytest.approx(0.9144)] * 2}


def test_steps_in_which_a_link_held_are_counted(tmp_path):
    (tmp_path / "linked.toml").write_text(
        'extends = "case1"\n[link.measurement]\nloss = 0.2\n[link.command]\nloss = 0.1\ndelay = 1\n'
    )
    bag = record_flight(tmp_path / "bag", str(tmp_path / "linked.toml"), duration=4.0, fault=1.0)
    # In step 1 the command of step 0 is due; all other commands differ from the ones before them.
    assert describe(bag)["equipment"]["held_steps"] == {
        name: sum(
            written(lib.hsv_uniforms, 2, 0, step, lib.LINK_LOSS + channel, 0)[0] < share for step in range(1, 201)
        )
        for channel, (name, share) in enumerate([("measurement", 0.2), ("command", 0.1)])
    }


def test_the_report_plots_measured_less_true_effector_and_wind(equipped):
    [run] = reported_runs([equipped])
    curves = run.curves.curves
    errors = curves["measurement_error_pitch_rate"][0].y
    truth, measured = equipped.columns("/hsv/state"), equipped.columns("/hsv/measurement")
    np.testing.assert_array_equal(errors, measured["state.pitch_rate"] - truth["pitch_rate"])
    [effector] = [curve.y for curve in curves["elevator_deflection"] if curve.kind == "effector"]
    # The value over the period that begins with step 10 is reported in step 11.
    assert effector[10] == equipped.columns("/hsv/forces")["effector.elevator_deflection"][11]
    assert np.isnan(effector[-1]) and np.isfinite(effector[:-1]).all()
    np.testing.assert_allclose(curves["wind_up"][0].y[:-1], 0.9144)
    assert {panel.group for panel in run.curves.panels.values()} >= {"sensors", "air"}


def test_faults_have_all_parameters_with_units(equipped, capsys):
    [text] = [event.text for event in flight_events(equipped, describe(equipped)) if event.kind == "fault"]
    assert text.startswith("elevator deflection: oscillation amplitude ")
    assert 'paper">0.5&nbsp;deg</span>' in text and "frequency 2&nbsp;Hz" in text
    info([equipped.path], UnitSystem.paper, False)
    out = capsys.readouterr().out
    said = " ".join(out.split())  # on a terminal the text is folded
    assert "oscillation amplitude 0.5 deg, frequency 2 Hz of elevator_deflection, from 2 s to 3 s" in said
    assert "sensors      rms error pitch_rate 0.0" in out and " deg/s\n" in out
    assert "air          wind_up 3 ft/s to 3 ft/s" in out
