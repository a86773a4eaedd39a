"""The result that is shipped."""

import re
from pathlib import Path

import pytest

from hsv.flight.resilience.campaign import plan
from hsv.flight.resilience.faults import TRIED, Moment
from hsv.flight.resilience.flights import SubjectRunner

PAGE = Path(__file__).parents[3] / "docs/resilience_result.md"


def rows(heading):
    """Return the rows of the table under a heading: by fault, the entries by controller."""
    section = PAGE.read_text(encoding="utf-8").partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    table = [[entry.strip() for entry in line.strip("|").split("|")] for line in section.splitlines() if "|" in line]
    _, *controllers = table[0]
    faults = {row[0].partition(":")[0].replace(" ", "_"): row[1:] for row in table[2:]}
    return {fault: dict(zip(controllers, entries, strict=True)) for fault, entries in faults.items()}


@pytest.mark.parametrize("heading", ["Flights survived", "Largest severity survived"])
def test_every_fault_and_at_least_five_controllers_are_there(heading):
    found = rows(heading)
    assert found.keys() == TRIED.keys() and all(len(entries) >= 5 for entries in found.values())


def test_the_baseline_is_lost_where_the_table_says():
    [subject] = plan(("case1",), ("elevator_loss",)).subjects
    runner = SubjectRunner(subject, Moment.during)
    for name, entries in rows("Largest severity survived").items():
        fault, first = TRIED[name], entries["case1"].split("; ")[0]
        said = float(re.search(r"to (\S+)", first)[1])
        # The table's digits are fewer than the flight's.
        severity = fault.severity(said)
        if first.startswith("all"):
            assert said == pytest.approx(fault.worst) and runner.survives(fault, 1.0)
        else:
            assert runner.survives(fault, severity - 0.005)
            assert not runner.survives(fault, severity + fault.resolution + 0.005)
