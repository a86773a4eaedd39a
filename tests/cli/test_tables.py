"""What commands print in tables: 80 columns, also into a pipe, whole words, and the units that were asked for."""

from __future__ import annotations

from pathlib import Path

import pytest
from node_processes import short_scenario

from hsv.base.units import UnitSystem
from hsv.cli.bench.figure import Figure
from hsv.cli.design import HALF_WIDTHS, _steps
from hsv.cli.know import _print_figures
from hsv.cli.output import console, quantity_table
from hsv.control.checks import load_subject

DESIGNS = Path(__file__).parents[2] / "offline_design"

COMMANDS = [
    ("list", "scenarios"),
    ("list", "equipment", "fine", "--units", "paper"),
    ("list", "faults"),
    ("list", "faults", "sensor_runaway", "--units", "paper"),
    ("trim",),
    ("linearise", "--model", "ECM", "--coupling", "derived"),
    ("simulate", "case1"),
    ("resilience", "--list"),
]

SLOW = [
    ("list", "vehicles"),
    ("list", "equipment"),
    ("list", "controllers"),
    ("verify", str(DESIGNS / "baseline.yaml"), "--quick"),
    ("export-controller", "baseline", "--out", "controller"),
    ("certify", str(DESIGNS / "baseline.yaml")),
    ("certify", str(DESIGNS / "realistic.yaml"), "--density", "1 %", "--units", "paper"),
    ("check", "tube_mpc"),
    ("bench", "--only", "in_process", "--scale", "0.01"),
]


@pytest.fixture
def pair(monkeypatch, capsys):
    """Return what something prints on 80 columns and on 1000, neither of them a terminal."""

    def both(prints) -> tuple[list[str], list[str]]:
        texts = []
        for width in (80, 1000):
            monkeypatch.setattr(console, "width", width)
            prints()
            texts.append(capsys.readouterr().out.splitlines())
        return texts[0], texts[1]

    return both


def check(narrow: list[str], wide: list[str]) -> None:
    """Check that nothing is wider than 80 columns, and that every word is as whole as where there is room."""
    assert narrow
    assert [line for line in narrow if len(line.rstrip()) > 80] == []
    broken = set(" ".join(narrow).split()) - set(" ".join(wide).split())
    # Numbers are those of two runs: of how long each took, too.
    assert {word for word in broken if not any(map(str.isdigit, word))} == set()


@pytest.fixture
def printed(hsv, monkeypatch):
    """Return what a command prints on 80 columns and on 1000, neither of them a terminal."""

    def both(*words: str) -> tuple[list[str], list[str]]:
        texts = []
        for width in (80, 1000):
            monkeypatch.setattr(console, "width", width)
            texts.append(hsv(*words).out.splitlines())
        return texts[0], texts[1]

    return both


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_command_prints_whole_words_on_80_columns(printed, words) -> None:
    check(*printed(*words))


@pytest.mark.long
@pytest.mark.parametrize("words", SLOW, ids=" ".join)
def test_a_command_that_takes_long_does_so_too(printed, words) -> None:
    check(*printed(*words))


@pytest.mark.long
def test_campaigns_do_so_too(hsv, printed, tmp_path) -> None:
    short_scenario(tmp_path, duration=6, fault=2)
    names = ["a_long_name.toml", *(f"{n}_of_several.toml" for n in range(5))]
    for name in names:
        (tmp_path / name).write_text('extends = "short.toml"\n')
    assert hsv("montecarlo", "short.toml", "--samples", "4", "--workers", "1", "--out", "a.parquet").code == 0
    check(*printed("montecarlo", "summary", "a.parquet"))
    flown = ("resilience", "--controllers", ",".join(names), "--faults", "elevator_loss", "--workers", "1")
    hsv(*flown)
    check(*printed(*flown))


def test_the_steps_of_a_design_and_the_figures_of_a_machine_do_so_too(pair) -> None:
    report = load_subject(DESIGNS / "adjustable.yaml").certificate
    check(*pair(lambda: console.print(_steps(report, UnitSystem.paper))))
    figure = Figure("name", "what is measured, in a sentence " * 3, "another", (1.0, 1.1), (2.0, 2.1), 3.0)
    check(*pair(lambda: _print_figures([figure])))


@pytest.mark.parametrize(
    ("units", "expected"),
    [("metric", ("12.9", "1.99", "deg/s")), ("si", ("12.9", "0.0347", "rad/s")), ("paper", ("42.5", "1.99", "deg/s"))],
)
def test_half_widths_of_a_set_are_in_the_units_asked_for(capsys, units, expected) -> None:
    system = UnitSystem(units)
    rows = [("as certified", (12.95, 3.67, 0.0347, 0.0335, 0.0614, 0.194, 0.229))]
    console.print(quantity_table("set", HALF_WIDTHS, rows, system))
    assert {*expected} <= set(capsys.readouterr().out.split())
    console.print(_steps(load_subject(DESIGNS / "adjustable.yaml").certificate, system))
    [line] = [line for line in capsys.readouterr().out.splitlines() if "gains, |u_n|" in line]
    assert line.rstrip().endswith("rad" if units == "si" else "deg")
