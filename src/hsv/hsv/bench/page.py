"""The table of one run, in a page of the documentation."""

from __future__ import annotations

import datetime
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path

from hsv.bench.figure import Figure
from hsv.errors import QuantityError

BEGIN, END = "<!-- table: made by hsv bench -->", "<!-- end of table -->"


def cells(figure: Figure) -> tuple[str, ...]:
    """Return what, against, ours, theirs (medians), ratio, its spread, and how it stands to what is promised."""
    low, high = figure.spread
    spread = f"{low:.3g} to {high:.3g}" if len(figure.ours) > 1 else ""
    ours = _quantity(figure.ours, figure.unit)
    remark = "; ".join(filter(None, (figure.verdict, figure.note)))
    theirs = _quantity(figure.theirs, figure.unit) if figure.theirs else ""
    return figure.what, figure.against, ours, theirs, f"{figure.median:.3g}" if figure.theirs else "", spread, remark


def _quantity(values: Sequence[float], unit: str) -> str:
    value = sorted(values)[len(values) // 2]
    return f"{1e3 * value:.3g} ms" if unit == "s" and value < 1.0 else f"{value:.3g} {unit}"


def table(figures: Sequence[Figure]) -> str:
    """Return the figures as a Markdown table."""
    head = ("what", "against", "ours", "theirs", "ratio", "spread (10 to 90 %)", "promise")
    rows = [head, ("---",) * len(head), *map(cells, figures)]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def machine() -> str:
    """Return processor, cores, system, Python and how busy it is just now, in one line."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        name = models[0].split(":", 1)[1].strip() if models else name
    load = f", load average before {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{name}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}{load}"


def busy() -> str:
    """Return a warning if other programs keep this machine from showing what it can; else nothing."""
    cores = os.cpu_count() or 1
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    if load < 0.5 * cores:
        return ""
    return (
        f"load average {load:.1f} on {cores} cores: figures of several processes will be worse than on an idle machine"
    )


class Page:
    """A page of the documentation with marks, between which the table of a whole run is kept."""

    def __init__(self, path: Path) -> None:
        """Read ``path``.

        Raises:
            QuantityError: The page has no marks.
        """
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        self._path = path
        self._before, begin, rest = text.partition(BEGIN)
        _, end, self._after = rest.partition(END)
        if not (begin and end):
            raise QuantityError(f"out = {str(path)!r}: expected a page with the marks {BEGIN!r} and {END!r}")

    def write(self, measured_on: str, figures: Sequence[Figure], skipped: Mapping[str, str]) -> None:
        """Put the table of ``figures`` there, the machine above, what was not measured and why below."""
        day = datetime.datetime.now(datetime.UTC).date().isoformat()
        lines = [f"{day}, {measured_on}.", "", table(figures), ""]
        lines += [f"Not measured: {name}, {reason}." for name, reason in skipped.items()]
        text = "\n".join(lines).rstrip()
        self._path.write_text(f"{self._before}{BEGIN}\n{text}\n{END}{self._after}", encoding="utf-8")
