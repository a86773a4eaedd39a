"""The tool that flies a large campaign and says what it takes."""

import subprocess
import sys
from pathlib import Path

TOOL = Path(__file__).parents[2] / "tools" / "campaign_memory.py"


def fly(*arguments):
    return subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True, check=False)


def test_every_tenth_of_a_campaign_has_a_row_with_its_memory():
    told = fly("20", "--workers", "1")
    assert told.returncode == 0, told.stderr
    rows = [
        [float(cell) for cell in line.strip("| ").split("|")] for line in told.stdout.splitlines()[2:] if "|" in line
    ]
    assert [row[0] for row in rows] == sorted({row[0] for row in rows})
    assert rows[-1][0] == 20
    assert all(own > 10.0 and worker == 0.0 for *_, own, worker in rows)
    assert "ten times as many flights" in told.stdout


def test_too_few_flights_are_refused():
    told = fly("9")
    assert told.returncode == 2
    assert "flights = 9: expected at least 10" in told.stderr
