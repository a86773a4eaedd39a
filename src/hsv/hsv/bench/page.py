"""The tables of one run and of all runs, in a page of the documentation."""

from __future__ import annotations

import datetime
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from hsv.base.errors import QuantityError
from hsv.bench.figure import Figure
from hsv.bench.machine import hardware
from hsv.graph.preparation import commit

TABLE = "<!-- table: made by hsv bench -->", "<!-- end of table -->"
HISTORY = "<!-- history: made by hsv bench -->", "<!-- end of history -->"

FOLLOWED = {
    "in_process": "flight from Python / loop in C",
    "graph": "lap / bare ring",
    "composed": "composed lap / bare loop",
    "montecarlo": "flights a second, all workers / as many times one",
    "corners": "1024 corners [s]",
}
"""Figures that the table of all runs has, by name, and what it calls them."""


def cells(figure: Figure) -> tuple[str, ...]:
    """Return what, against, ours, theirs (medians), ratio, its percentiles, and how it compares with the promise."""
    ours = _quantity(figure.ours, figure.unit)
    theirs = _quantity(figure.theirs, figure.unit) if figure.theirs else ""
    # A ratio is a pure number; what has no other side has the unit of what was measured.
    scale = 1.0 if figure.theirs else _readable(figure.median, figure.unit)[0]
    low, high = (scale * end for end in figure.percentiles)
    percentiles = f"{low:.3g} to {high:.3g}" if len(figure.ours) > 1 else ""
    remark = "; ".join(filter(None, (figure.verdict, figure.note)))
    return (
        figure.what,
        figure.against,
        ours,
        theirs,
        f"{figure.median:.3g}" if figure.theirs else "",
        percentiles,
        remark,
    )


def _quantity(values: Sequence[float], unit: str) -> str:
    value = sorted(values)[len(values) // 2]
    scale, name = _readable(value, unit)
    return f"{scale * value:.3g} {name}"


def _readable(value: float, unit: str) -> tuple[float, str]:
    """Return the factor to the unit in which people read ``value``, and that unit."""
    if unit != "s" or value >= 1.0:
        return 1.0, unit
    return (1e3, "ms") if value >= 1e-3 else (1e6, "us")


def table(figures: Sequence[Figure]) -> str:
    """Return the figures as a Markdown table."""
    head = ("what", "against", "ours", "theirs", "ratio", "10th to 90th percentile", "promise")
    return "\n".join(map(_row, (head, ("---",) * len(head), *map(cells, figures))))


class Page:
    """A page of the documentation with marks, between which the table of a whole run and that of all runs are kept."""

    def __init__(self, path: Path) -> None:
        """Read ``path``.

        Raises:
            QuantityError: The page has no marks.
        """
        self._path = path
        self._text = path.read_text(encoding="utf-8") if path.exists() else ""
        for begin, end in (TABLE, HISTORY):
            if not re.search(f"{begin}.*{end}", self._text, re.DOTALL):
                raise QuantityError(f"out = {str(path)!r}: expected a page with the marks {begin!r} and {end!r}")

    def write(self, measured_on: str, figures: Sequence[Figure], skipped: Mapping[str, str]) -> None:
        """Write the table of ``figures`` into the page, the machine above it, omissions below, and a row of history.

        The row goes to the table of all runs, in place of one of the same commit on the same hardware.
        """
        day = datetime.datetime.now(datetime.UTC).date().isoformat()
        lines = [f"{day}, {measured_on}.", "", table(figures), ""]
        lines += [f"Not measured: {name}, {reason}." for name, reason in skipped.items()]
        self._replace(TABLE, "\n".join(lines).rstrip())
        medians = {figure.name: f"{figure.median:.3g}" for figure in figures}
        run = f"| {commit()} | {hardware()} |"
        head = ("day", "commit", "machine", *FOLLOWED.values())
        before = [line for line in self._between(HISTORY).splitlines()[2:] if run not in line]
        rows = [_row(head), _row(("---",) * len(head)), *before]
        rows.append(f"| {day} {run} {' | '.join(medians.get(name, '') for name in FOLLOWED)} |")
        self._replace(HISTORY, "\n".join(rows))
        self._path.write_text(self._text, encoding="utf-8")

    def _between(self, marks: tuple[str, str]) -> str:
        begin, end = marks
        return self._text.partition(begin)[2].partition(end)[0].strip()

    def _replace(self, marks: tuple[str, str], text: str) -> None:
        begin, end = marks
        before, _, rest = self._text.partition(begin)
        self._text = f"{before}{begin}\n{text}\n{end}{rest.partition(end)[2]}"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
