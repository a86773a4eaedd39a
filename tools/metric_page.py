"""Write docs/metrics.md. Usage, after "source env.sh": python3 tools/metric_page.py."""

from __future__ import annotations

from pathlib import Path

from hsv.flight.metrics import METRICS, spaced

_HEADER = """# Metrics
Made by `python3 tools/metric_page.py` from the table in `hsv.flight.metrics`. Values in files are in SI units. Pages
and the terminal write the name with spaces, or the title in brackets.

Symbols: e = h - h_r or V - V_r, the error of altitude or velocity; r = 1 - e / e(0), the response to the step at t = 0,
before the fault; t_f, the time of the first fault, if it starts after step 0; x_r and x_n, reference and nominal state;
u, the commands Phi and delta_e.

A metric that does not apply to a flight has no value (null in a file), and its limit is not judged. The times of a
response that the flight does not reach have no value either, break their limits, and are named in the column
`not_reached` of a campaign's file and in `missing` of a flight, with the time in which they were not reached. A flight
that is lost has the metrics of its part before the loss; campaigns leave them out.

| metric | unit | meaning | formula | needs |
| --- | --- | --- | --- | --- |
"""


def page() -> str:
    """Return the text of the page."""
    rows = []
    for name, metric in METRICS.items():
        title = "" if spaced(name) == name.replace("_", " ") else f" ({spaced(name)})"
        cells = f"`{name}`{title}", metric.unit, metric.meaning, metric.formula, metric.needs or "-"
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n")
    return _HEADER + "".join(rows)


if __name__ == "__main__":
    (Path(__file__).parents[1] / "docs" / "metrics.md").write_text(page(), encoding="utf-8")
