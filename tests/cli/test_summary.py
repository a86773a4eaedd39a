"""What a command prints for people: metrics in words and groups, one verdict, units, at most 80 columns."""

from __future__ import annotations

import math
import re

import pytest
from rich.text import Text

from hsv.api import fly
from hsv.base.units import UnitSystem, duration_in_words, in_system, significant
from hsv.cli.output import console
from hsv.flight.limits import verdict_sentence, verdicts
from hsv.flight.metrics import METRICS, Group
from hsv.flight.scenario import load_scenario

DECAY = {"elastic_decay_time": 67.1, "altitude_overshoot": 0.04}


def test_every_group_has_metrics_and_a_share_has_no_unit() -> None:
    assert {metric.group for metric in METRICS.values()} == {*Group}
    assert all(metric.unit == "1" for metric in METRICS.values() if metric.share)


@pytest.mark.parametrize(
    ("words", "printed"),
    [
        (("simulate", "case1"), "control law  a step of law, vehicle and sensors 0.0"),
        (
            ("simulate", "case1_no_notch", "--all"),
            "verdict within all 5 limits; not judged: elastic decay time (67.1 s), 17 others",
        ),
        (("simulate", "case1"), "verdict within all 6 limits"),
        (("linearise", "--model", "ECM"), "filtered_pitch_rate"),
        (("trim",), "angle of attack              1.6446  deg"),
    ],
)
def test_what_is_printed_fits_80_columns(hsv, monkeypatch, words, printed) -> None:
    monkeypatch.setattr(console, "_width", 80)
    monkeypatch.setattr(console, "_force_terminal", True)
    lines = [Text.from_ansi(line).plain for line in hsv(*words).out.splitlines()]
    assert max(map(len, lines)) <= 80
    assert any(line.strip().startswith(printed) for line in lines)


def test_groups_come_in_the_order_of_reading_with_degrees_and_percent(hsv) -> None:
    lines = [line.strip() for line in hsv("simulate", "case1_no_notch").out.splitlines()]
    places = [lines.index(group) for group in (*Group, "run")]
    assert places == sorted(places)
    rows = {name: cells for name, *cells in (re.split(r"\s{2,}", line) for line in lines)}
    assert {name.replace("_", " ") for name in fly("case1_no_notch").metrics} < {*rows}
    assert rows["altitude overshoot"][:2] == ["3.97", "%"]
    assert rows["elevator deflection maximum"][:2] == ["14.6", "deg"]


def test_units_of_json_are_strict_si_unless_the_papers_are_asked_for(hsv) -> None:
    default, si, paper = (
        hsv("trim", *options, "--json").json for options in ((), ("--units", "si"), ("--units", "paper"))
    )
    assert default == si
    assert paper["angle_of_attack_deg"] == pytest.approx(math.degrees(si["angle_of_attack_rad"]))
    assert "rad" in hsv("trim", "--units", "si").out and "rad" not in hsv("trim").out
    matrices = [hsv("linearise", *options, "--json").json["A_si"] for options in ((), ("--units", "si"))]
    assert matrices[0] == matrices[1]


def test_a_number_has_three_digits_and_all_before_its_point() -> None:
    values = (0.0123456, 1.23456, 12.3456, 123.456, 26060.4, 1.23456e7, -99.96, 0.0)
    assert [significant(v) for v in values] == ["0.0123", "1.23", "12.3", "123", "26060", "1.23e+07", "-100", "0"]
    seconds = (0.42, 64.0, 97.0, 900.0, 20000.0)
    assert [duration_in_words(s) for s in seconds] == ["0.42 s", "64 s", "2 min", "15 min", "5 h 33 min"]


def test_the_metric_system_is_si_but_for_degrees_and_percent() -> None:
    metric = UnitSystem.metric
    assert in_system(math.pi, "rad", metric) == (pytest.approx(180.0), "deg")
    assert in_system(math.pi, "rad/s", metric) == (pytest.approx(180.0), "deg/s")
    assert in_system(0.5, "1", metric, share=True) == (50.0, "%")
    assert in_system(0.5, "1", metric) == (0.5, "1")
    assert in_system(0.5, "1", UnitSystem.paper, share=True) == (0.5, "1")
    for unit in ("m", "m/s", "N", "Pa", "kg^0.5 m"):
        assert in_system(2.0, unit, metric) == (2.0, unit)


@pytest.mark.parametrize(
    ("metrics", "ended", "sentence"),
    [
        ({"saturated_steps": 0.0}, True, "within its limit"),
        (
            {"saturated_steps": 0.0, **DECAY},
            True,
            "within its limit; not judged: elastic decay time (67.1 s), 1 other",
        ),
        ({"saturated_steps": 3.0}, True, "1 of 1 limits not kept: saturated steps 3 (limit 0)"),
        ({}, True, "1 of 1 limits not kept: saturated steps not reached"),
        ({"saturated_steps": 0.0}, False, "not flown to the end"),
        ({"saturated_steps": 3.0}, False, "not flown to the end; 1 of 1 limits not kept: saturated steps 3 (limit 0)"),
    ],
)
def test_the_verdict_is_one_sentence(metrics, ended, sentence) -> None:
    judged = verdicts(load_scenario("case1_rmpc"), metrics, ended=ended)
    assert verdict_sentence(judged, metrics, UnitSystem.metric) == sentence


def test_a_scenario_without_limits_is_not_judged() -> None:
    assert verdict_sentence({}, DECAY, UnitSystem.metric) == "not judged: the scenario has no limits"


def test_colours_are_for_terminals_and_not_where_they_are_not_wanted(hsv, monkeypatch) -> None:
    assert "\x1b" not in hsv("simulate", "case1").out
    monkeypatch.setattr(console, "_force_terminal", True)
    monkeypatch.setattr(console, "_color_system", 1)
    assert "\x1b[32m" in hsv("simulate", "case1").out
    monkeypatch.setattr(console, "no_color", True)
    assert "\x1b[32m" not in hsv("simulate", "case1").out
