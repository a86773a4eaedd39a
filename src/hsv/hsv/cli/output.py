"""Printing numbers with their units: a table for people, JSON with the unit in every key for programs."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from hsv.json_text import json_text
from hsv.units import UnitSystem, in_system, significant

# Paths, titles and what nodes say are printed as they stand: markup in them would be text of ours.
console = Console(highlight=False, markup=False, emoji=False)
errors = Console(stderr=True, highlight=False, markup=False, emoji=False)


class Interrupted(Exception):  # noqa: N818 - what the user did is no error
    """Ctrl-C in long work; the message says how it goes on."""


@contextmanager
def resumable(folder: Path) -> Iterator[None]:
    """Say after Ctrl-C, in one line, that what is finished is kept in ``folder``.

    Raises:
        Interrupted: After Ctrl-C.
    """
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted(
            f"interrupted; what is finished is in {folder}, the same command goes on from there"
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
"""How a unit is spelled at the end of a JSON key."""

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
    """Print on standard error what a node said."""
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
    width = max(map(len, titles))
    for name, title in titles.items():
        console.print(Text.assemble((f"{name:{width}}", "bold"), f"  {title}"))


def print_json(values: Mapping[str, Any]) -> None:
    """Print ``values`` as JSON on standard output; a number that is not finite, which JSON lacks, as null."""
    sys.stdout.write(json_text(values, indent=2) + "\n")


def print_rows(rows: Sequence[Mapping[str, str | float | None]]) -> None:
    """Print rows with the same keys, the headings; a line a row however wide, numbers at the right, none as ``-``."""
    columns = []
    for heading in rows[0]:
        values = [row[heading] for row in rows]
        texts = [v if isinstance(v, str) else "-" if v is None else f"{v:.5g}" for v in values]
        width = max(map(len, (heading, *texts)))
        align = str.ljust if any(isinstance(value, str) for value in values) else str.rjust
        columns.append([align(text, width) for text in (heading, *texts)])
    for number, line in enumerate(zip(*columns, strict=True)):
        console.print(Text("  ".join(line).rstrip(), style="" if number else "bold"), soft_wrap=True)


def print_table(title: str, quantities: Mapping[str, Quantity], units: UnitSystem, digits: int = 3) -> None:
    """Print name, value and unit of every quantity."""
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="bold")
    table.add_column("quantity", overflow="fold")
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("unit")
    for name, quantity in quantities.items():
        value, unit = in_system(*quantity, units)
        table.add_row(name.replace("_", " "), significant(value, digits), "" if unit == "1" else unit)
    console.print(table)
