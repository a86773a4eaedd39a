"""The command ``hsv bench``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from hsv.base.units import significant
from hsv.cli.options import JsonOption
from hsv.cli.output import console, errors, folded, print_json
from hsv.cli.targets import check_target

if TYPE_CHECKING:
    from hsv.bench.figure import Figure
    from hsv.bench.record import Change


def bench(
    only: Annotated[list[str] | None, typer.Option(help="Measure only this group; can be repeated.")] = None,
    scale: Annotated[float, typer.Option(help="Factor on the number of repetitions.")] = 1.0,
    out: Annotated[Path | None, typer.Option(help="Page whose table to replace, e.g. docs/benchmarks.md.")] = None,
    compare: Annotated[
        Path | None, typer.Option(help="Report what became slower or faster since this run, saved with --json > FILE.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Measure the performance of this machine, as ratios whose two sides are measured alternately.

    The exit code is 1 if a group of --only could not be measured, and with --compare if anything became slower.

    Example: hsv bench --only in_process --only mcap
    """
    from hsv.base.errors import QuantityError, RunError
    from hsv.bench.machine import busy, machine
    from hsv.bench.page import Page
    from hsv.bench.record import as_json, changes, not_measured, read_run
    from hsv.bench.suite import groups
    from hsv.cli.progress import stages

    if not 0.0 < scale <= 100.0:
        raise QuantityError(f"scale = {scale}: expected above 0, at most 100")
    if out and only:
        raise QuantityError(f"out = {str(out)!r}: expected no --only with it, the page has the table of a complete run")
    page = None
    if out:
        check_target(out, "out")
        page = Page(out)
    recorded = read_run(compare) if compare else None
    available = groups(scale)
    for name in only or ():
        if name not in available:
            raise QuantityError(f"only = {name!r}: expected one of {', '.join(available)}")
    chosen = [name for name in available if not only or name in only]
    measured_on = machine()
    if warning := busy():
        errors.print(warning, style="yellow", soft_wrap=True)
    measured: dict[str, list[Figure]] = {}
    skipped: dict[str, str] = {}
    with stages() as progress:
        for number, name in enumerate(chosen):
            progress("measuring", number, len(chosen))
            try:
                measured[name] = available[name]()
            except RunError as error:
                # Without a compiler or a built workspace, the rest can still be measured.
                skipped[name] = str(error)
                continue
            if not measured[name]:
                skipped[name] = "not installed"
    figures = [figure for found in measured.values() for figure in found]
    since = changes(figures, recorded) if recorded else []
    absent = not_measured(figures, recorded, only) if recorded else []
    if json:
        slower = {change.figure.name: change.slower for change in since}
        compared = {"slower_than_recorded": slower, "recorded_but_not_measured": absent} if recorded else {}
        print_json(as_json(measured, skipped) | compared)
    else:
        _print(figures)
        if not only:
            for name, reason in skipped.items():
                errors.print(f"{name}: not measured: {reason}", soft_wrap=True)
        if recorded:
            _print_changes(since, recorded.commit, len(figures), absent)
    if page:
        page.write(measured_on, figures, skipped)
    if only and skipped:
        raise RunError("; ".join(f"only = {name!r}: not measured: {reason}" for name, reason in skipped.items()))
    if any(change.slower > 0.0 for change in since):
        raise typer.Exit(1)


def _print(figures: list[Figure]) -> None:
    """Print one paragraph per figure: the table of all figures, as in the documentation, is wider than a terminal."""
    from hsv.bench.page import cells

    for figure in figures:
        what, against, ours, theirs, ratio, spread, promise = cells(figure)
        compared = f" against {theirs} of {against}: ratio {ratio}" if theirs else ""
        said = f"{ours}{compared}{f' ({spread})' if spread else ''}"
        console.print(Text(folded(what), "bold"), soft_wrap=True)
        console.print(folded(said, 4, first=4), soft_wrap=True)
        if promise:
            style = "bold red" if "WORSE" in promise else ""
            console.print(Text(folded(promise, 4, first=4), style), soft_wrap=True)


def _print_changes(since: list[Change], commit: str, measured: int, absent: list[str]) -> None:
    """Print what became slower or faster since a recorded run of a ``commit``, and what could not be compared."""
    console.print(Text(f"since {commit}", "bold"))
    for change in since:
        if change.slower:
            word, style = ("SLOWER", "bold red") if change.slower > 0.0 else ("faster", "green")
            said = f"{word} by {abs(change.slower):.0%}, {significant(change.before)} before: {change.figure.what}"
            console.print(Text(folded(said, 4, first=4), style), soft_wrap=True)
    same = sum(not change.slower for change in since)
    alone = measured - len(since)
    said = f"as before: {same} of {measured}{f'; {alone} not in that run, or of other hardware' if alone else ''}"
    console.print(folded(said, 4, first=4), soft_wrap=True)
    if absent:
        console.print(
            Text(folded(f"recorded there, not measured here: {', '.join(absent)}", 4, first=4)), soft_wrap=True
        )
