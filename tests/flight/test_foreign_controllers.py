"""Custom Python controllers in the loop."""

import numpy as np
import pytest

from hsv.base.errors import HsvError, RunError, ScenarioError
from hsv.base.parameters import Parameter, validate
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.flight import step_statistics, step_times_in_words
from hsv.flight.scenario import parse_scenario
from hsv.model.vehicle import load_vehicle
from hsv.plugins.controllers import controller_class

LIMITS = load_vehicle().decoupled

SCENARIO = """
title = "Case 1 by another controller"
design = "{design}"
controller = "{controller}"
duration = "{duration}"
[initial]
altitude = "85500 ft"
velocity = "7900 ft/s"
[[command]]
altitude_change = "60 ft"
[{table}]
{settings}
"""


def flight(controller="Mine", design="", settings="", table="mine", duration="4 s"):
    if controller in globals():
        controller = f"{__name__}:{controller}"
    text = SCENARIO.format(controller=controller, design=design, settings=settings, table=table, duration=duration)
    return assemble_flight(parse_scenario(text, "own"))


class Mine:
    """A controller that commands the reference's trim input; its parameters have ranges and units."""

    PARAMETERS = (
        Parameter("mine.gain", 1.0, "times the feedback", "", 0.0, 10.0),
        Parameter("mine.time", 2.0, "of the leak", "s", 0.1, 100.0),
    )

    @classmethod
    def from_parameters(cls, values, design):
        made = cls()
        made.own = validate(cls.PARAMETERS, values)
        return made

    def reset(self):
        pass

    def step(self, inputs):
        return inputs.reference_input


class Late(Mine):
    """A controller with a wrong answer from step 20 on."""

    answer = np.nan, 0.0

    def step(self, inputs):
        return super().step(inputs) if inputs.step < 20 else self.answer


class Leaving(Mine):
    def reset(self):
        raise SystemExit(5)


class Raising(Mine):
    def step(self, inputs):
        raise ZeroDivisionError("no gain")


def test_answers_are_limited_and_the_limits_are_told(monkeypatch):
    monkeypatch.setattr(Late, "answer", (5.0, -3.0))
    flown = fly(flight("Late"))
    assert flown.history.u_unsaturated[20].tolist() == [5.0, -3.0]
    assert flown.history.command[20].tolist() == [LIMITS.input_maximum[0], LIMITS.input_minimum[1]]
    assert flown.saturated[20].all() and not flown.saturated[19].any()


def test_a_flight_has_the_wall_times_of_a_law_in_python_step_by_step():
    assert {name: len(times) for name, times in fly(flight()).law_times.items()} == {"controller": 201}
    assert not fly(flight("tube_mpc", "baseline", table="tube")).law_times


def test_the_times_of_steps_are_told_by_node_beside_the_period():
    times = step_statistics(1e-3 * np.arange(1, 102))
    told = step_times_in_words({"nodes": {"tube_mpc": times}, "period_ms": 20.0})
    assert told == "tube_mpc median 51, p99 100, max 101 ms; period 20 ms"


def test_settings_reach_the_controller_in_si_units():
    parts = flight(design="baseline", settings='time = "1.5 min"', duration="1 s")
    assert parts.controller._controller.own["mine.time"] == 90.0
    assert fly(parts).history.deviation.any()  # a design provides a nominal trajectory, too


@pytest.mark.parametrize(
    ("controller", "answer", "message"),
    [
        ("Late", (np.nan, 0.0), r"Late, step 20: answered \[nan, 0.0\], expected 2 finite"),
        ("Late", (0.3,), r"Late, step 20: answered \(0.3,\), expected 2 finite numbers: fuel"),
        ("Late", np.array([1j, 0.0]), r"Late, step 20: answered array\(\[0\.\+1\.j, 0\.\+0\.j\]\), expected 2 finite"),
        ("Leaving", None, r"Leaving, reset: SystemExit: 5"),
        ("Raising", None, r"Raising, step 0: ZeroDivisionError: no gain \(test_foreign_controllers.py:\d+\)$"),
    ],
)
def test_a_controller_that_fails_is_named_with_its_step(controller, answer, message, monkeypatch):
    monkeypatch.setattr(Late, "answer", answer)
    parts = flight(controller)
    with pytest.raises(RunError, match=message):
        fly(parts)


class JunkKernel(Mine):
    kernel = 5


def test_a_kernel_of_another_type_and_an_end_on_import_are_named(tmp_path, monkeypatch):
    with pytest.raises(HsvError, match=r"JunkKernel': kernel = 5: expected a StepKernel"):
        flight("JunkKernel")
    (tmp_path / "ends_on_import.py").write_text("import sys\nsys.exit(0)\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(HsvError, match="cannot be loaded, ends_on_import ends the program on import"):
        controller_class("ends_on_import:Own")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"controller": "7"}, r"controller = '7': expected one of .*package.module:Class, path/lib.so:symbol or"),
        ({"controller": "7:lqr"}, r"controller = '7:lqr': '7' is no module, expected package.module:Class or path/"),
        ({"controller": "./build/lqr"}, r"controller = './build/lqr': no symbol, expected path/lib.so:symbol"),
        ({"controller": "./7:lqr"}, r"controller = '\./7:lqr': cannot be read \(No such .*expected a shared library"),
        ({"controller": "tube_mcp"}, r"controller = 'tube_mcp': expected one of .*did you mean 'tube_mpc'"),
        ({"controller": "nowhere:Class"}, r"No module named 'nowhere' \(PYTHONPATH=FOLDER:\$PYTHONPATH finds"),
        ({"controller": "math:cos"}, r"has no PARAMETERS, from_parameters, expected a class of a controller"),
        ({"settings": "gian = 1.0"}, r"mine.gian: unknown key, expected one of gain, time"),
        ({"settings": "gain = -1.0"}, r"mine.gain = -1.0: expected from 0 to 10"),
        ({"table": "lucky", "settings": "gain = 1.0"}, r"lucky: unknown key, expected one of mine"),
        ({"controller": "tube_mpc", "table": "tube"}, r"design = '': expected one, tube_mpc flies with its gains"),
    ],
)
def test_what_cannot_be_flown_is_named(changes, message):
    with pytest.raises(ScenarioError, match=message):
        flight(**changes)
