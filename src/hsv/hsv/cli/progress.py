"""Progress of long work, on a terminal only."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from hsv.base.units import UnitSystem
from hsv.cli.output import errors
from hsv.graph.snapshot import Snapshot


def _bar() -> Progress:
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f}%"),
        TextColumn("{task.fields[note]}", markup=False),
        TimeElapsedColumn(),
        console=errors,
        transient=True,
        disable=not errors.is_terminal,
    )


@contextmanager
def stages() -> Iterator[Callable[[str, int, int], None]]:
    """Yield a callback (stage, done, total) that shows one bar a stage."""
    with _bar() as bar:
        tasks: dict[str, int] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total, note="")
            bar.update(tasks[stage], completed=done, total=total)  # type: ignore[arg-type]

        yield report


class FlightLine:
    """A line that shows how far a flight is, and where."""

    def __init__(self, bar: Progress, title: str, steps: int, units: UnitSystem) -> None:
        self._bar, self._steps, self._units = bar, steps, units
        self._task = bar.add_task(title, total=steps, note="starting the nodes")

    def step(self, number: int) -> None:
        """Show that a step has been flown."""
        self._bar.update(self._task, completed=number)

    def snapshot(self, snapshot: Snapshot) -> None:
        """Show numbers of the flight."""
        self._bar.update(self._task, note=snapshot.in_words(self._units))


@contextmanager
def flight(title: str, steps: int, units: UnitSystem = UnitSystem.metric) -> Iterator[FlightLine]:
    """Yield the line of a flight of so many ``steps``."""
    columns = (
        TextColumn("{task.description}", markup=False),
        TextColumn("{task.percentage:>3.0f}%"),
        TextColumn("{task.fields[note]}", markup=False),
    )
    with Progress(*columns, console=errors, transient=True, disable=not errors.is_terminal) as bar:
        yield FlightLine(bar, title, steps, units)


@contextmanager
def flights(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """Yield a callback (flights finished) that shows flights per second and the remaining time."""
    import time

    with _bar() as bar:
        task = bar.add_task(title, total=total, note="starting the workers")
        begun: list[tuple[float, int]] = []

        def report(finished: int) -> None:
            # What an interrupted campaign had finished before says nothing of the pace now.
            begun[:1] = begun[:1] or [(time.monotonic(), finished)]
            start, before = begun[0]
            rate = (finished - before) / max(time.monotonic() - start, 1e-9)
            left = f", {_clock((total - finished) / rate)} left" if finished > before else ""
            bar.update(task, completed=finished, note=f"{finished} of {total} flights, {rate:.1f} / s{left}")

        yield report


def _clock(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes}:{seconds:02}"
