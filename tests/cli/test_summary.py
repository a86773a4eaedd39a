"""Printed summaries: metrics in words and groups, one verdict, units, at most 80 columns, no markup."""

import io
import re

import pytest
from marking import long

from hsv.api import fly
from hsv.base.units import UnitSystem, duration_in_words, significant
from hsv.cli import output
from hsv.cli.output import console, print_section
from hsv.flight.metrics import Group, spaced


@pytest.mark.parametrize(
    ("words", "printed"),
    [
        (("simulate", "case1"), "control law  one step (law, vehicle, sensors) mean 0.0"),
        (
            ("simulate", "case1_no_notch", "--all"),
            "verdict within all 5 limits; not judged: elastic decay time (67.1 s)",
        ),
        (("simulate", "case1"), "verdict within all 6 limits"),
        (("linearise", "--model", "ECM", "--coupling", "derived"), "filtered_pitch_rate"),
        (("trim",), "angle of attack              1.6446  deg"),
        (("list", "scenarios"), "case1"),
        (("list", "faults", "sensor_runaway", "--units", "paper"), "rate"),
        (("resilience", "--list"), "elevator_loss"),
        long(("list", "equipment"), "elevator_50"),
        long(("list", "controllers"), "tube_mpc"),
        long(("verify", "baseline", "--quick"), ""),
        long(("export-controller", "baseline", "--out", "controller"), ""),
        long(("certify", "realistic", "--density", "1 %", "--units", "paper"), ""),
        long(("check", "tube_mpc"), "flown twice"),
        long(("bench", "--only", "in_process", "--scale", "0.01"), ""),
    ],
)
def test_what_is_printed_fits_80_columns_in_whole_words(hsv, monkeypatch, words, printed):
    texts = []
    for width in (80, 1000):
        monkeypatch.setattr(console, "width", width)
        texts.append(hsv(*words).out)
    narrow = texts[0].splitlines()
    assert max(len(line.rstrip()) for line in narrow) <= 80
    assert any(line.strip().startswith(printed) for line in narrow)
    # The two texts come from two runs, whose durations differ, so words with digits are left out.
    broken = set(texts[0].split()) - set(texts[1].split())
    assert [word for word in broken if not any(map(str.isdigit, word))] == []


@pytest.mark.parametrize("units", ["metric", "paper"])
def test_groups_come_in_the_order_of_reading_with_degrees_and_percent(hsv, units):
    lines = [line.strip() for line in hsv("simulate", "case1_no_notch", "--units", units).out.splitlines()]
    places = [lines.index(group) for group in (*Group, "run") if group is not Group.requirements]
    assert places == sorted(places)
    rows = {name: cells for name, *cells in (re.split(r"\s{2,}", line) for line in lines)}
    assert {*map(spaced, fly("case1_no_notch").metrics)} < {*rows}
    assert rows["altitude overshoot"][:2] == ["3.97", "%"]
    assert rows["elevator deflection maximum"][:2] == ["14.6", "deg"]


def test_a_number_has_three_digits_and_all_before_its_point():
    values = (0.0123456, 1.23456, 12.3456, 123.456, 26060.4, 1.23456e7, -99.96, 0.0)
    assert [significant(v) for v in values] == ["0.0123", "1.23", "12.3", "123", "26060", "1.23e+07", "-100", "0"]
    seconds = (0.42, 64.0, 97.0, 900.0, 20000.0)
    assert [duration_in_words(s) for s in seconds] == ["0.42 s", "64 s", "2 min", "15 min", "5 h 33 min"]


NAME = "run[old] [/x] :bug:"


def test_lines_of_nodes_and_titles_are_printed_as_they_are(capsys):
    output.report_line("plant", f"[WARN] {NAME}")
    output.report_error(NAME)
    output.report_line("hsv: warning", NAME)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"plant: [WARN] {NAME}", f"hsv: error: {NAME}", f"hsv: warning: {NAME}"]
    output.print_table(NAME, {"altitude": (1.0, "m")}, UnitSystem.si)
    assert capsys.readouterr().out.splitlines()[0].strip() == NAME
    print_section(NAME, {NAME: NAME})
    title, line = capsys.readouterr().out.splitlines()
    assert title == NAME and line.split("  ")[1:] == [NAME, NAME]


def test_control_characters_are_shown_and_not_sent_to_the_terminal(capsys):
    title = "\x1b[31mred\x1b]0;title\x07 \x9b2J \x08\r\x7f\u202e\u200b\u2028\u2066\tend"
    terminal = type(output.console)(file=io.StringIO(), force_terminal=True, highlight=False, width=200)
    terminal.print(title, soft_wrap=True)
    output.report_error(title)
    for shown in (terminal.file.getvalue(), capsys.readouterr().err):
        assert not set("\x1b\x07\x08\x9b\x7f\r\u202e\u200b\u2028\u2066") & set(shown)
        assert r"\x1b[31mred\x1b]0;title" in shown and r"\x9b2J" in shown
