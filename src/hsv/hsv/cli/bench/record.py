"""Runs of the bench as JSON, and the changes from a recorded run to another one."""

from __future__ import annotations

import os
import platform
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pydantic

from hsv.base.errors import DocumentError, QuantityError
from hsv.base.files import parse_json, read_text
from hsv.cli.bench.figure import Figure
from hsv.graph.preparation import commit

RESOLUTION = 0.05
"""Largest relative change that the same commit shows from run to run on an idle machine."""


class RecordedFigure(pydantic.BaseModel):
    """Data of a figure in a recorded run that are needed for a comparison."""

    name: str
    group: str
    spread: tuple[float, float]
    ratio: float = pydantic.Field(gt=0.0)


class RecordedRun(pydantic.BaseModel):
    """A run of the bench as ``hsv bench --json`` prints it."""

    commit: str
    figures: list[RecordedFigure]


@dataclass(frozen=True)
class Change:
    """Relative change of a figure since the recorded run; positive if it became slower."""

    figure: Figure
    before: float
    slower: float


def as_json(measured: Mapping[str, Sequence[Figure]], skipped: Mapping[str, str]) -> dict[str, Any]:
    """Return a run for :func:`read_run`: commit, machine, figures with all samples, and the groups not measured.

    Args:
        measured: Figures by their group.
        skipped: The reasons why groups were not measured.
    """
    return {
        "commit": commit(),
        "machine": machine(),
        "figures": [
            {
                **asdict(figure),
                "group": group,
                "ratio": figure.ratio,
                "spread": figure.spread,
                "verdict": figure.verdict,
            }
            for group, figures in measured.items()
            for figure in figures
        ],
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
    """Return the changes of the figures contained in a recorded run.

    A change counts where it is more than :data:`RESOLUTION` and the percentiles do not overlap; else it is zero.
    """
    before = {figure.name: figure for figure in run.figures}
    found = []
    for figure in figures:
        if old := before.get(figure.name):
            slower = figure.ratio / old.ratio - 1.0
            apart = figure.spread[0] > old.spread[1] or figure.spread[1] < old.spread[0]
            found.append(Change(figure, old.ratio, slower if apart and abs(slower) > RESOLUTION else 0.0))
    return found


def not_measured(figures: Sequence[Figure], run: RecordedRun, only: Collection[str] | None) -> list[str]:
    """Return the names of recorded figures that are missing among ``figures``, of the groups in ``only``, or of all."""
    names = {figure.name for figure in figures}
    return [old.name for old in run.figures if old.name not in names and (not only or old.group in only)]


def machine() -> str:
    """Return processor, cores, system, Python and the load of the machine, in one line."""
    info = Path("/proc/cpuinfo").read_text().splitlines()
    models = [line.partition(": ")[2] for line in info if line.startswith("model name")]
    processor = models[0] if models else platform.machine()
    system = f"{platform.system()}, Python {platform.python_version()}"
    return f"{processor}, {os.cpu_count()} cores, {system}, load average {os.getloadavg()[0]:.1f}"
