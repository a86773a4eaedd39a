"""Printing numbers with their units: a table for people, JSON with the unit in every key for programs."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from hsv.base.json_text import json_text
from hsv.base.units import UnitSystem, in_system, significant, unit_in

_UNPRINTABLE = {code: repr(chr(code))[1:-1] for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t"}
"""Control characters, with which a title could tell a terminal to do things, and how they are shown."""


class _Terminal(Console):
    """A console on which a text is only text, whatever a file or a node has in it."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the output of the base class, with control characters made visible."""
        for segment in super().render(renderable, options):
            text = segment.text if segment.control else segment.text.translate(_UNPRINTABLE)
            yield Segment(text, segment.style, segment.control)


# Paths, titles and what nodes say are printed as they stand: markup in them would be text of ours.
console = _Terminal(highlight=False, markup=False, emoji=False)
errors = _Terminal(stderr=True, highlight=False, markup=False, emoji=False)


class Interrupted(Exception):  # noqa: N818 - what the user did is no error
    """Ctrl-C in a long computation or a flight; the message says where its results are, and how to continue."""


@contextmanager
def resumable(folder: Path) -> Iterator[None]:
    """Report after Ctrl-C, in one line, that finished results are stored in ``folder``.

    Raises:
        Interrupted: After Ctrl-C.
    """
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted(
            f"interrupted; finished results are in {folder}, the same command continues from there"
        ) from None


UNIT_KEYS = {
    "1": "",
    "m": "m",
    "ft": "ft",
    "m/s": "m_per_s",
    "ft/s": "ft_per_s",
    "rad": "rad",
    "deg": "deg",
    "rad/s": "rad_per_s",
    "deg/s": "deg_per_s",
    "s": "s",
    "m s": "m_s",
    "ft s": "ft_s",
    "N": "N",
    "lbf": "lbf",
    "N m": "N_m",
    "lbf ft": "lbf_ft",
    "Pa": "Pa",
    "lbf/ft^2": "psf",
    "kg^0.5 m": "sqrt_kg_m",
    "kg^0.5 m/s": "sqrt_kg_m_per_s",
    "slug^0.5 ft": "sqrt_slug_ft",
    "slug^0.5 ft/s": "sqrt_slug_ft_per_s",
}
"""Spelling of units at the end of JSON keys."""

Quantity = tuple[float, str]
"""A number and its SI unit."""


def to_json(quantities: Mapping[str, Quantity], units: UnitSystem) -> dict[str, float]:
    """Return the numbers, SI but for the paper's units, with the unit appended to every key, e.g. ``altitude_ft``."""
    values = {}
    for name, quantity in quantities.items():
        value, unit = in_system(*quantity, json_system(units))
        values["_".join(filter(None, (name, UNIT_KEYS[unit])))] = value
    return values


def json_system(units: UnitSystem) -> UnitSystem:
    """Return the units of JSON: programs read strict SI, unless the paper's units are asked for."""
    return UnitSystem.si if units is UnitSystem.metric else units


def warn(text: str) -> None:
    """Print a warning on one line of standard error."""
    errors.print(Text.assemble(("hsv: warning:", "bold yellow"), f" {text}"), soft_wrap=True)


def report_error(problem: object) -> None:
    """Print an error on standard error, a single line if ``problem`` is one."""
    errors.print(Text.assemble(("hsv: error:", "bold red"), f" {problem}"), soft_wrap=True)


def report_line(node: str, text: str) -> None:
    """Print a log line of a node on standard error."""
    errors.print(Text.assemble((f"{node}:", "dim"), f" {text}"), soft_wrap=True)


def print_written(paths: Sequence[Path], as_json: bool) -> None:
    """Print which files were written; as JSON with their sizes."""
    if as_json:
        print_json({"written": [{"path": str(path), "size_bytes": path.stat().st_size} for path in paths]})
        return
    for path in paths:
        console.print(f"written {path}", soft_wrap=True)


def print_titles(titles: Mapping[str, str], as_json: bool) -> None:
    """Print titles by name, a line each, or as JSON."""
    if as_json:
        print_json(titles)
        return
    table = new_table("name", "title", head=False)
    for name, title in titles.items():
        table.add_row(Text(name, "bold"), title)
    console.print(table)


def print_json(values: Mapping[str, Any]) -> None:
    """Print ``values`` as JSON on standard output; a number that is not finite, which JSON lacks, as null."""
    sys.stdout.write(json_text(values, indent=2) + "\n")


def folded(text: str, indent: int = 0, first: int = 0) -> str:
    """Return ``text`` as lines no wider than the terminal, or 80 columns, folded between words, which stay whole.

    Args:
        text: Text to fold.
        indent: Spaces before each line.
        first: Spaces before the first line.
    """
    return fill(
        text,
        console.width,
        initial_indent=" " * first,
        subsequent_indent=" " * indent,
        break_long_words=False,  # paths are copied
        break_on_hyphens=False,
    )


def new_table(*headings: str, title: str = "", right: Collection[str] = (), head: bool = True) -> Table:
    """Return an empty table as all commands print it: without lines, folded between words to the terminal's width.

    Args:
        headings: Headings of the columns.
        title: Above the table.
        right: Headings of the columns that stand at the right and are not folded, as numbers do.
        head: Whether the headings are shown.
    """
    table = Table(
        title=title or None,
        title_justify="left",
        box=None,
        pad_edge=False,
        show_header=head,
        header_style="bold",
    )
    for heading in headings:
        number = heading in right
        table.add_column(heading, justify="right" if number else "left", no_wrap=number, overflow="fold")
    return table


def print_rows(rows: Sequence[Mapping[str, str | float | None]]) -> None:
    """Print rows with the same keys, the headings: numbers at the right, as given to five digits, none as ``-``.

    Where they are wider than the terminal, the last column stands below the others, a paragraph a row.
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
        console.print(Text("  ".join(line).rstrip(), style="" if number else "bold"), soft_wrap=True)
        if below and number and (text := below[number].strip()):
            console.print(folded(text, 4, first=4), soft_wrap=True)


def print_matrix(
    title: str, rows: Sequence[str], columns: Sequence[str], cells: Sequence[Sequence[RenderableType]]
) -> None:
    """Print a matrix with as many columns side by side as fit on the terminal; names fold at their underscores.

    Args:
        title: Above the matrix.
        rows: Names of the rows.
        columns: Names of the columns.
        cells: Cells by row.
    """
    label = max(map(len, rows))
    count = max(1, (console.width - label) // _COLUMN)
    for first in range(0, len(columns), count):
        shown = columns[first : first + count]
        headings = [column.replace("_", "\n") for column in shown]
        table = new_table("", *headings, title="" if first else title, right=headings)
        table.columns[0].no_wrap = True
        for column in table.columns[1:]:
            column.min_width = _COLUMN - 2
        for name, row in zip(rows, cells, strict=True):
            table.add_row(name, *row[first : first + count])
        console.print(table)


_COLUMN = 12
"""Characters of a column of a matrix, the gap included."""


def quantity_table(
    title: str,
    columns: Mapping[str, str],
    rows: Sequence[tuple[str, list[float] | None]],
    units: UnitSystem,
) -> Table:
    """Return a table of quantities with one row per item and the unit of each column below its heading.

    Args:
        title: Above the table.
        columns: The SI unit by heading.
        rows: Name and values (SI) of each; ``None`` where it has no values.
        units: Units of what is shown.
    """
    named = {name: unit_in(units, unit) for name, unit in columns.items()}
    headings = [f"{name}\n{'' if unit == '1' else unit}" for name, unit in named.items()]
    table = new_table("", *headings, title=title, right=headings)
    for name, values in rows:
        cells = ["-"] * len(columns)
        if values is not None:
            pairs = zip(values, columns.values(), strict=True)
            cells = [significant(in_system(float(value), unit, units)[0]) for value, unit in pairs]
        table.add_row(name, *cells)
    return table


def print_table(title: str, quantities: Mapping[str, Quantity], units: UnitSystem, digits: int = 3) -> None:
    """Print name, value and unit of every quantity."""
    table = new_table("quantity", "value", "unit", title=title, right=["value"])
    for name, quantity in quantities.items():
        value, unit = in_system(*quantity, units)
        table.add_row(name.replace("_", " "), significant(value, digits), "" if unit == "1" else unit)
    console.print(table)
