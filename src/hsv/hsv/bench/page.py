"""The table of one run, in a page of the documentation."""

from __future__ import annotations

import datetime
import os
import platform
from collections.abc import Sequence
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
    """Return processor, cores, system and Python, in one line."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        name = models[0].split(":", 1)[1].strip() if models else name
    load = f", load average {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{name}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}{load}"


def replace_table(page: Path, figures: Sequence[Figure]) -> None:
    """Put the table of ``figures`` between the marks of ``page``.

    Raises:
        QuantityError: The page has no marks.
    """
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise QuantityError(f"out = {str(page)!r}: expected a page with the marks {BEGIN!r} and {END!r}")
    day = datetime.datetime.now(datetime.UTC).date().isoformat()
    page.write_text(f"{before}{BEGIN}\n{day}, {machine()}.\n\n{table(figures)}\n{END}{after}", encoding="utf-8")
