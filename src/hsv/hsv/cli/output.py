"""Output of the commands: numbers with their units as tables for people and as JSON for programs."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import TextWrapper
from typing import TYPE_CHECKING, Any
from unicodedata import category

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from hsv.base.files import json_text
from hsv.base.units import UnitSystem, duration_in_words, in_system, significant, unit_in

if TYPE_CHECKING:
    from rich.progress import Progress

    from hsv.bags.reader import Bag

Quantity = tuple[float, str]
"""A number and its SI unit."""

_COLUMN = 12
"""Width (characters) of a column of a matrix, including the gap."""


def _visible(text: str) -> str:
    """Return ``text`` with control, bidirectional and invisible characters escaped, which could fool a reader."""
    if text.isprintable():
        return text
    hidden = (character not in "\n\t" and category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp") for character in text)
    return "".join(repr(character)[1:-1] if hide else character for character, hide in zip(text, hidden, strict=True))


class _Terminal(Console):
    """A console that prints every text as it stands, whatever a file or a node has put into it."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the output of the base class, with hidden characters made visible."""
        for segment in super().render(renderable, options):
            yield Segment(segment.text if segment.control else _visible(segment.text), segment.style, segment.control)


console = _Terminal(highlight=False, markup=False, emoji=False)
errors = _Terminal(stderr=True, highlight=False, markup=False, emoji=False)


class Interrupted(Exception):  # noqa: N818 - an interruption by the user is no error
    """Ctrl-C in a long computation or a flight; the message says where the results are, and how to continue."""


@contextmanager
def resumable(folder: Path) -> Iterator[Callable[[Path], None]]:
    """Report after Ctrl-C, in one line, where the results are: finished ones in ``folder``, if it exists.

    Yields a function to be called with the path of the results once all flights are finished.
    """
    complete: list[Path] = []
    try:
        yield complete.append
    except KeyboardInterrupt:
        if complete:
            words = f"all flights are finished, their results are in {complete[0]}; the same command shows them"
        elif folder.exists():
            words = f"finished results are in {folder}, the same command continues from there"
        else:
            raise
        raise Interrupted(f"interrupted; {words}") from None


def unit_key(unit: str) -> str:
    """Return how JSON keys spell a unit at their end: ``ft_per_s``, ``sqrt_slug_ft``; nothing for 1."""
    words = re.sub(r"(\w+)\^0\.5", r"sqrt_\1", unit.replace("lbf/ft^2", "psf"))
    return "" if unit == "1" else words.replace("/", "_per_").replace(" ", "_")


def to_json(quantities: Mapping[str, Quantity], units: UnitSystem) -> dict[str, float]:
    """Return the numbers with the unit appended to every key, e.g. ``altitude_ft``; units as in :func:`json_system`."""
    values = {}
    for name, quantity in quantities.items():
        value, unit = in_system(*quantity, json_system(units))
        values["_".join(filter(None, (name, unit_key(unit))))] = value
    return values


def json_system(units: UnitSystem) -> UnitSystem:
    """Return the units of JSON: strict SI, unless the paper's units are requested."""
    return UnitSystem.si if units is UnitSystem.metric else units


def print_json(values: Mapping[str, Any]) -> None:
    """Print ``values`` as JSON on standard output; a number that is not finite, which JSON lacks, as null."""
    sys.stdout.write(json_text(values, indent=2) + "\n")


def say(*lines: object) -> None:
    """Print each line as it stands; only the terminal folds it, so that a path can be copied."""
    for line in lines:
        console.print(line if isinstance(line, Text) else str(line), soft_wrap=True)


def print_bag_warnings(*bags: Bag) -> None:
    """Print one line per incomplete bag: damage, missing files, topics and steps, or that the bag is truncated."""
    from hsv.bags.steps import bag_warnings

    for bag in {bag.path: bag for bag in bags}.values():
        if words := bag_warnings(bag):
            report_line("hsv: warning", f"{bag.path}: {'; '.join(words)}", "bold yellow")


def print_estimate(seconds: float, as_json: bool, remark: str = "") -> None:
    """Print on standard error how long a computation takes on one processor; nothing for a program."""
    if not as_json:
        errors.print(f"about {duration_in_words(seconds)} on one processor{remark}", soft_wrap=True)


def report_error(problem: object) -> None:
    """Print an error on standard error, on one line if ``problem`` is one line."""
    report_line("hsv: error", problem, "bold red")


def report_line(source: str, text: object, style: str = "dim") -> None:
    """Print a line of a node, or of the command itself, on standard error."""
    errors.print(Text.assemble((f"{source}:", style), f" {text}"), soft_wrap=True)


def print_written(paths: Sequence[Path], as_json: bool, **others: Any) -> None:
    """Print the names of written files; as JSON with their sizes, and with ``others``."""
    if as_json:
        print_json({"written": [{"path": str(path), "size_bytes": path.stat().st_size} for path in paths], **others})
    else:
        say(*(f"written {path}" for path in paths))


def print_titles(titles: Mapping[str, str], as_json: bool) -> None:
    """Print titles by name, a line each, or as JSON."""
    if as_json:
        print_json(titles)
        return
    table = new_table("name", "title", head=False)
    for name, title in titles.items():
        table.add_row(Text(name, "bold"), title)
    console.print(table)


def folded(text: str, indent: int = 0, first: int = 0) -> str:
    """Return ``text`` folded between words to the width of the terminal, or 80 columns; paths stay whole.

    The first line begins with ``first`` spaces, the others with ``indent``.
    """
    wrapper = TextWrapper(console.width, " " * first, " " * indent, break_long_words=False, break_on_hyphens=False)
    return wrapper.fill(text)


def print_section(title: str, lines: Mapping[str, object]) -> None:
    """Print named texts under a title, a line each, folded between words; paths stay whole, to be copied.

    After a line break, a text continues on a line of its own.
    """
    console.print(Text(title, "bold"))
    width = max(map(len, lines)) + 4
    for name, text in lines.items():
        first, *others = str(text).split("\n")
        words = first if isinstance(text, Path) else folded(first, width, first=width)[width:]
        say(f"  {name:{width - 2}}{words}", *(f"  {other}" for other in others))


def new_table(*headings: str, title: str = "", right: Collection[str] = (), head: bool = True) -> Table:
    """Return an empty table without lines, folded between words to the terminal's width.

    ``right`` are the headings of the columns of numbers, which are aligned at the right and not folded; ``head`` shows
    the headings.
    """
    style: dict[str, Any] = {"title_justify": "left", "box": None, "pad_edge": False, "header_style": "bold"}
    table = Table(title=title or None, show_header=head, **style)
    for heading in headings:
        number = heading in right
        table.add_column(heading, justify="right" if number else "left", no_wrap=number, overflow="fold")
    return table


def print_rows(rows: Sequence[Mapping[str, str | float | None]]) -> None:
    """Print rows whose keys are the headings: numbers at the right, to five digits; ``-`` for none.

    If the rows are wider than the terminal, the last column stands below the others, a paragraph a row.
    """
    columns = []
    for heading in rows[0]:
        values = [row[heading] for row in rows]
        texts = [v if isinstance(v, str) else "-" if v is None else f"{v:.5g}" for v in values]
        width = max(map(len, (heading, *texts)))
        align = str.ljust if any(isinstance(value, str) for value in values) else str.rjust
        columns.append([align(text, width) for text in (heading, *texts)])
    wide = sum(len(column[0]) + 2 for column in columns) - 2 > console.width
    below = columns.pop() if wide else []
    for number, line in enumerate(zip(*columns, strict=True)):
        say(Text("  ".join(line).rstrip(), style="" if number else "bold"))
        if below and number and (text := below[number].strip()):
            say(folded(text, 4, first=4))


def print_matrix(
    title: str, rows: Sequence[str], columns: Sequence[str], cells: Sequence[Sequence[RenderableType]]
) -> None:
    """Print a matrix of ``cells`` by row, as many columns side by side as fit; names fold at their underscores."""
    count = max(1, (console.width - max(map(len, rows))) // _COLUMN)
    for first in range(0, len(columns), count):
        headings = [column.replace("_", "\n") for column in columns[first : first + count]]
        table = new_table("", *headings, title="" if first else title, right=headings)
        table.columns[0].no_wrap = True
        for column in table.columns[1:]:
            column.min_width = _COLUMN - 2
        for name, row in zip(rows, cells, strict=True):
            table.add_row(name, *row[first : first + count])
        console.print(table)


def quantity_table(
    title: str, columns: Mapping[str, str], rows: Sequence[tuple[str, Sequence[float] | None]], units: UnitSystem
) -> Table:
    """Return a table of quantities with the unit of each column below its heading.

    ``columns`` are SI units by heading, ``rows`` name and values (SI) of each item, or None in place of the values.
    """
    named = {name: unit_in(units, unit) for name, unit in columns.items()}
    headings = [f"{name}\n{'' if unit == '1' else unit}" for name, unit in named.items()]
    table = new_table("", *headings, title=title, right=headings)
    for name, values in rows:
        pairs = zip(values, columns.values(), strict=True) if values is not None else ()
        cells = [significant(in_system(float(value), unit, units)[0]) for value, unit in pairs]
        table.add_row(name, *(cells or ["-"] * len(columns)))
    return table


def print_table(
    title: str, quantities: Mapping[str, Quantity], units: UnitSystem, digits: int = 3, shares: Collection[str] = ()
) -> None:
    """Print name, value and unit of every quantity; those named in ``shares`` are in percent except in strict SI."""
    table = new_table("quantity", "value", "unit", title=title, right=["value"])
    for name, quantity in quantities.items():
        value, unit = in_system(*quantity, units, share=name in shares)
        table.add_row(name.replace("_", " "), significant(value, digits), "" if unit == "1" else unit)
    console.print(table)


def _progress() -> Progress:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

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
    """Yield a callback (stage, done, total) that shows one bar a stage, on a terminal only."""
    with _progress() as bar:
        tasks: dict[str, Any] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total, note="")
            bar.update(tasks[stage], completed=done, total=total)

        yield report


@contextmanager
def flights(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """Yield a callback (flights finished) that shows flights per second and the remaining time."""
    with _progress() as bar:
        task = bar.add_task(title, total=total, note="starting the workers")
        begun: list[tuple[float, int]] = []

        def report(finished: int) -> None:
            # Flights of an interrupted campaign do not count in the pace.
            begun[:1] = begun[:1] or [(time.monotonic(), finished)]
            start, before = begun[0]
            rate = (finished - before) / max(time.monotonic() - start, 1e-9)
            left = f", {duration_in_words((total - finished) / rate)} left" if finished > before else ""
            bar.update(task, completed=finished, note=f"{finished} of {total} flights, {rate:.1f} / s{left}")

        yield report
