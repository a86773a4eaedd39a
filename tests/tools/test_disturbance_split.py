"""tools/disturbance_split.py: the less disturbances may do, the less they attain, and the page has what it prints."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_less_attains_less_and_the_page_says_how_much():
    ran = subprocess.run(
        [sys.executable, ROOT / "tools" / "disturbance_split.py", "baseline"], capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    page = (ROOT / "docs" / "certified_bounds.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (?:anything|the fault|and two|constant)[^|]*\| ([\d.]+); ([\d.]+) \|", page, re.MULTILINE)
    for column, name in enumerate(("pitch angle", "elevator feedback")):
        line = next(line for line in ran.stdout.splitlines() if line.strip().startswith(name))
        certified, *attained = [float(number) for number in re.findall(r"[a-z] ([\d.]+)(?:,|$)", line)]
        assert attained == [float(row[column]) for row in rows]
        assert certified > attained[0] and attained == sorted(attained, reverse=True)
