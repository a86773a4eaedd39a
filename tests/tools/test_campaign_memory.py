"""The tool that flies a large campaign and says what it takes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[2] / "tools" / "campaign_memory.py"


def fly(*arguments):
    return subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True, check=False)


def rows_of(told):
    return [
        [float(cell) for cell in line.strip("| ").split("|")] for line in told.stdout.splitlines()[2:] if "|" in line
    ]


def test_a_campaign_has_a_row_at_the_first_batch_after_each_tenth():
    told = fly("100", "--workers", "1")
    assert told.returncode == 0, told.stderr
    rows = rows_of(told)
    # A batch of so few flights has 32 of them.
    assert [row[0] for row in rows] == [32, 64, 96, 100]
    assert all(own > 10.0 and worker == 0.0 for *_, own, worker in rows)
    *_, files, most = told.stdout.splitlines()
    sizes = re.fullmatch(r"batches: (\S+) MiB; result: (\S+) MiB, written in \S+ s", files)
    assert sizes and float(sizes[1]) > float(sizes[2]) > 0.0
    assert float(most.split()[-2]) >= max(row[3] for row in rows) - 1.0


@pytest.mark.parametrize(
    ("arguments", "refused"),
    [
        (("9",), "flights = 9: expected 10 to 10000000"),
        (("100000000",), "flights = 100000000: expected 10 to 10000000"),
        (("many",), "argument flights: 'many', expected a whole number"),
        (("10", "--workers", "-2"), "workers = -2: expected 0 to 4096"),
        (("10", "--workers", "two"), "argument --workers: 'two', expected a whole number"),
        (("10", "--scenario", "nosuch"), "'nosuch'"),
        (("10", "--scenario", "./missing.toml"), "missing.toml"),
        ((), "arguments are required: flights"),
    ],
)
def test_what_cannot_be_flown_is_refused_on_one_line(arguments, refused):
    told = fly(*arguments)
    assert told.returncode == 2
    [line] = told.stderr.splitlines()
    assert line.startswith("campaign_memory.py: error: ") and refused in line
    assert told.stdout == ""
