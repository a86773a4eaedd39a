"""Output of the commands: numbers with their units as tables for people and as JSON for programs."""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import TextWrapper
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from hsv.base.errors import messages, visible
from hsv.base.units import UnitSystem, duration_in_words, in_system, significant, unit_in

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.table import Table

    from hsv.bags.reader import Bag

Quantity = tuple[float, str]
"""A number and its SI unit."""

MAX_ERROR = 1_900
"""Maximum length (characters) of an error message, so that a line with it has at most 2,000"""

_MISTAKES = 10
"""Number of mistakes in a file that are printed"""

_COLUMN = 12
"""Width (characters) of a column of a matrix, including the gap."""


# A shell without a terminal may say that it has no columns; rich would print nothing, or fail.
if not os.environ.get("COLUMNS", "0").strip("0"):
    os.environ.pop("COLUMNS", None)


class _Terminal(Console):
    """A console that shows hidden characters in texts from files and nodes as escapes."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the segments of the base class, with escapes for hidden characters."""
        for segment in super().render(renderable, options):
            yield Segment(segment.text if segment.control else visible(segment.text), segment.style, segment.control)


console = _Terminal(highlight=False, markup=False, emoji=False)
errors = _Terminal(stderr=True, highlight=False, markup=False, emoji=False)


class Interrupted(Exception):  # noqa: N818 - an interruption by the user is no error
    """Ctrl-C in a long computation or a flight; the message says where the results are, and how to continue."""


@contextmanager
def resumable(folder: Path) -> Iterator[Callable[[Path], None]]:
    """Turn Ctrl-C into an ``Interrupted`` with the place of the finished results, if ``folder`` exists.

    Yields a function to call with the path of the results once all flights are finished; the message then names it.
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
    """Return the suffix of a JSON key for a unit, such as ``ft_per_s`` or ``sqrt_slug_ft``; empty for ``1``."""
    words = re.sub(r"(\w+)\^0\.5", r"sqrt_\1", unit.replace("lbf/ft^2", "psf"))
    return "" if unit == "1" else words.replace("/", "_per_").replace(" ", "_")


def to_json(quantities: Mapping[str, Quantity], units: UnitSystem) -> dict[str, float]:
    """Return the numbers, with their units appended to keys, e.g. ``altitude_ft``; units as in :func:`json_system`."""
    values = {}
    for name, quantity in quantities.items():
        value, unit = in_system(*quantity, json_system(units))
        values["_".join(filter(None, (name, unit_key(unit))))] = value
    return values


def json_system(units: UnitSystem) -> UnitSystem:
    """Return the units to use in JSON: strict SI, unless the paper's units are requested."""
    return UnitSystem.si if units is UnitSystem.metric else units


def print_json(values: Mapping[str, Any]) -> None:
    """Print ``values`` as JSON on standard output; numbers that are not finite become null."""
    from hsv.base.files import json_text

    sys.stdout.write(json_text(values, indent=2) + "\n")


def say(*lines: object) -> None:
    """Print each line without inserting line breaks, so that a long path can be copied from the terminal."""
    for line in lines:
        console.print(line if isinstance(line, Text) else str(line), soft_wrap=True)


def print_bag_warnings(*bags: Bag) -> None:
    """Print one line for each bag with warnings: contradictory metadata, damage, no end, missing topics or steps."""
    from hsv.bags.steps import bag_warnings

    for bag in {bag.path: bag for bag in bags}.values():
        if words := bag_warnings(bag):
            report_line("hsv: warning", f"{bag.path}: {'; '.join(words)}", "bold yellow")


def print_estimate(seconds: float, as_json: bool, remark: str = "") -> None:
    """Print on standard error how long a computation takes on one processor, and a remark; nothing if ``as_json``."""
    if not as_json:
        errors.print(f"about {duration_in_words(seconds)} on one processor{remark}", soft_wrap=True)


def report_error(problem: object) -> None:
    """Print an error and its notes on standard error, a line each; the middle of a long one is left out."""
    texts = messages(problem)
    more = [f"and {len(texts) - _MISTAKES} more"] if len(texts) > _MISTAKES else []
    for text in texts[:_MISTAKES] + more:
        if len(text) > MAX_ERROR:
            text = f"{text[: MAX_ERROR // 2]} [...] {text[-(MAX_ERROR // 2 - 20) :]}"
        report_line("hsv: error", text, "bold red")


def report_line(source: str, text: object, style: str = "dim") -> None:
    """Print on standard error a line with the name of its source, a node or this command."""
    errors.print(Text.assemble((f"{source}:", style), f" {text}"), soft_wrap=True)


def print_written(paths: Sequence[Path], as_json: bool, **others: Any) -> None:
    """Print the paths of written files; ``as_json`` prints JSON with their sizes and with ``others``."""
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
    """Return ``text`` wrapped between words to the width of the terminal, or 80 columns; paths are not broken.

    The first line begins with ``first`` spaces, the others with ``indent``.
    """
    wrapper = TextWrapper(console.width, " " * first, " " * indent, break_long_words=False, break_on_hyphens=False)
    return wrapper.fill(text)


def print_section(title: str, lines: Mapping[str, object]) -> None:
    """Print named texts under a title, wrapped between words; paths are not broken, so that they can be copied.

    The part of a text after a line break is printed below, without its name.
    """
    console.print(Text(title, "bold"))
    width = max(map(len, lines)) + 4
    for name, text in lines.items():
        first, *others = str(text).split("\n")
        words = first if isinstance(text, Path) else folded(first, width, first=width)[width:]
        say(f"  {name:{width - 2}}{words}", *(f"  {other}" for other in others))


def new_table(*headings: str, title: str = "", right: Collection[str] = (), head: bool = True) -> Table:
    """Return an empty table without rules, as wide as the terminal at most; text in cells wraps between words.

    ``right`` are the headings of the columns of numbers, which are aligned on the right and do not wrap. The headings
    are printed if ``head`` is true.
    """
    from rich.table import Table

    style: dict[str, Any] = {"title_justify": "left", "box": None, "pad_edge": False, "header_style": "bold"}
    table = Table(title=title or None, show_header=head, **style)
    for heading in headings:
        number = heading in right
        table.add_column(heading, justify="right" if number else "left", no_wrap=number, overflow="fold")
    return table


def print_rows(rows: Sequence[Mapping[str, str | float | None]]) -> None:
    """Print a table of ``rows``, each with its cells by heading; numbers have five digits, and None prints a dash.

    If the rows are wider than the terminal, the cell in the last column is printed below its row.
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
    """Print ``cells``, a list of rows, as one table or several narrow ones; column names break at underscores."""
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

    ``columns`` has the SI units by heading. A row has the name of an item and its values (SI); None prints dashes.
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
    """Yield a callback (stage, done, total) that shows one progress bar per stage, on a terminal only."""
    with _progress() as bar:
        tasks: dict[str, Any] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total, note="")
            bar.update(tasks[stage], completed=done, total=total)

        yield report


@contextmanager
def flights(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """Yield a callback (number of finished flights) that shows progress, flights per second and the remaining time."""
    with _progress() as bar:
        task = bar.add_task(title, total=total, note="starting the workers")
        begun: list[tuple[float, int]] = []

        def report(finished: int) -> None:
            # Flights that were finished before this start of the command do not count in the rate.
            begun[:1] = begun[:1] or [(time.monotonic(), finished)]
            start, before = begun[0]
            rate = (finished - before) / max(time.monotonic() - start, 1e-9)
            left = f", {duration_in_words((total - finished) / rate)} left" if finished > before else ""
            bar.update(task, completed=finished, note=f"{finished} of {total} flights, {rate:.1f} / s{left}")

        yield report
