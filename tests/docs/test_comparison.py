"""The tables of docs/comparison.md: every row is what ``hsv simulate NAME --units paper --all`` prints."""

import re
from pathlib import Path

import pytest

from hsv.base.units import UnitSystem, in_system
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "comparison.md").read_text(encoding="utf-8")
METRICS = {
    "settled: h s": ("altitude_settling_time", "s"),
    "end error: h ft": ("altitude_end_error", "m"),
    "saturated steps": ("saturated_steps", "1"),
    "overshoot: h": ("altitude_overshoot", "%"),
}
"""Metric and SI unit by heading of altitude; the next column has that of velocity."""

# The row of the example regulator needs its package installed: tests/examples flies it.
ROWS = [line for line in PAGE.splitlines() if re.match(r"\| `?(case1|hsv simulate winged_cone`)", line)]


def numbers(metrics, heading, following):
    """Return the cells of a heading of the page, and of the one after it if that is of velocity."""
    name, unit = METRICS[heading]
    names = {name: unit}
    if following:
        names[name.replace("altitude", "velocity")] = "m/s" if unit == "m" else unit
    for metric, unit in names.items():
        value = metrics.get(metric)
        if value is None:
            yield "no"
        elif unit == "%":
            yield 100.0 * value
        else:
            yield in_system(value, unit, UnitSystem.paper)[0]


@pytest.mark.long
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.split("|")[1].strip(" `"))
def test_a_row_has_the_numbers_of_its_flight(row, monkeypatch):
    monkeypatch.chdir(ROOT)
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    before = PAGE[: PAGE.index(row)].splitlines()
    heading = next(line for line in reversed(before) if line.startswith(("| scenario", "| command")))
    heads = [cell.strip() for cell in heading.strip("|").split("|")]
    metrics = fly(assemble_flight(load_scenario(cells[0].strip("`").removeprefix("hsv simulate ")))).metrics
    for index, head in enumerate(heads):
        if head in METRICS:
            following = index + 1 < len(heads) and heads[index + 1].startswith("V")
            for cell, value in zip(cells[index:], numbers(metrics, head, following), strict=False):
                if value == "no":
                    assert cell == "no"
                else:
                    digits = len(cell.removesuffix(" %").partition(".")[2])
                    assert float(cell.removesuffix(" %")) == pytest.approx(value, abs=0.51 * 10.0**-digits)
