"""Parameters and metrics of several runs side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from hsv.pages.report.run import DECLARED, ReportedRun
from hsv.pages.report.values import Value


@dataclass(frozen=True)
class Row:
    """A parameter; ``values`` holds one value if all runs agree, else one per run, None if a run does not have it."""

    name: str
    description: str
    values: tuple[Value | None, ...]


def comparisons(runs: Sequence[ReportedRun]) -> dict[str, list[Row]]:
    """Return the rows of each part of the parameters: scenario, design."""
    return {part: list(_rows(part, runs)) for part in ("scenario", "design")}


def differing_metrics(runs: Sequence[ReportedRun]) -> set[str]:
    """Return the metrics that are not the same number in all runs."""
    names = {name for run in runs for name in run.metrics}
    return {name for name in names if len({run.metrics.get(name) for run in runs}) > 1}


def _rows(part: str, runs: Sequence[ReportedRun]) -> Iterator[Row]:
    for name in dict.fromkeys(name for run in runs for name in run.parameters[part]):
        values = tuple(run.parameters[part].get(name) for run in runs)
        if all(value == values[0] for value in values):
            values = values[:1]
        yield Row(name, DECLARED[name].description if name in DECLARED else "", values)
