"""Runs of the bench as JSON, and what became slower or faster from one to another."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pydantic

from hsv.base.errors import DocumentError, QuantityError
from hsv.base.files import parse_json, read_text
from hsv.bench.figure import Figure
from hsv.bench.machine import hardware, machine
from hsv.graph.preparation import commit

RESOLUTION = 0.05
"""Relative change that is none: what the same commit shows from run to run on an idle machine."""


class RecordedFigure(pydantic.BaseModel):
    """Data of a figure in a recorded run that are needed for a comparison."""

    name: str
    group: str = ""
    """What ``--only`` calls the figures measured together; empty in runs of earlier versions."""
    spread: tuple[float, float]
    ratio: float | None = None
    value: float | None = None


class RecordedRun(pydantic.BaseModel):
    """A run of the bench as ``hsv bench --json`` prints it."""

    commit: str
    hardware: str
    figures: list[RecordedFigure]


@dataclass(frozen=True)
class Change:
    """Relative change of a figure since the recorded run; positive if it became slower."""

    figure: Figure
    before: float
    slower: float


def as_json(measured: Mapping[str, Sequence[Figure]], skipped: Mapping[str, str]) -> dict[str, Any]:
    """Return a run for :func:`read_run`: commit, machine, figures with all samples, what was not measured and why.

    Args:
        measured: Figures by their group.
        skipped: Why groups were not measured.
    """
    return {
        "commit": commit(),
        "hardware": hardware(),
        "machine": machine(),
        "figures": [_as_json(figure, group) for group, figures in measured.items() for figure in figures],
        "skipped": dict(skipped),
    }


def read_run(path: Path) -> RecordedRun:
    """Return the run in a file.

    Raises:
        QuantityError: It cannot be read, or is no output of ``hsv bench --json``.
    """
    expected = "expected the output of hsv bench --json"
    try:
        return RecordedRun.model_validate(parse_json(read_text(path)))
    except DocumentError as error:
        raise QuantityError(f"compare = {str(path)!r}: {error}, {expected}") from error
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        field = ".".join(map(str, first["loc"])) or "all of it"
        raise QuantityError(f"compare = {str(path)!r}: {field}: {first['msg']}, {expected}") from error


def changes(figures: Sequence[Figure], run: RecordedRun) -> list[Change]:
    """Return the changes of figures since a recorded run, for those that can be compared.

    Ratios of two sides hold on any machine; a figure of one side alone is compared on the same hardware only. A change
    counts as one where it is more than :data:`RESOLUTION` and the percentiles do not overlap; else it is zero.
    """
    before = {figure.name: figure for figure in run.figures}
    found = []
    for figure in figures:
        old = before.get(figure.name)
        if old is None or not (figure.theirs or run.hardware == hardware()):
            continue
        value = old.ratio if figure.theirs else old.value
        if value is None or not value > 0.0:
            continue
        apart = figure.percentiles[0] > old.spread[1] or figure.percentiles[1] < old.spread[0]
        # Of a rate the smaller number is the slower one.
        relation = value / figure.median if figure.is_rate else figure.median / value
        counts = apart and abs(relation - 1.0) > RESOLUTION
        found.append(Change(figure, value, relation - 1.0 if counts else 0.0))
    return found


def not_measured(figures: Sequence[Figure], run: RecordedRun, only: Collection[str] | None) -> list[str]:
    """Return the names of recorded figures that are missing among ``figures``, of the groups in ``only``, or of all."""
    names = {figure.name for figure in figures}
    return [old.name for old in run.figures if old.name not in names and (not only or old.group in only)]


def _as_json(figure: Figure, group: str) -> dict[str, Any]:
    return {
        "name": figure.name,
        "group": group,
        "what": figure.what,
        "against": figure.against or None,
        "unit": figure.unit,
        "ours": list(figure.ours),
        "theirs": list(figure.theirs),
        "ratio" if figure.theirs else "value": figure.median,
        "spread": figure.percentiles,
        "bound": figure.bound or None,
        "limit": figure.limit,
        "goal": figure.goal,
        "verdict": figure.verdict or None,
        "note": figure.note or None,
    }
