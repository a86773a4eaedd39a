"""The command ``hsv verify``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from hsv.base.units import significant
from hsv.cli.options import JsonOption
from hsv.cli.output import console, new_table, print_json, report_error

if TYPE_CHECKING:
    from rich.table import Table

    from hsv.design.verification.checks import Check


def verify(
    file: Annotated[
        str,
        typer.Argument(
            help="Parameter file of a design, with its certificate in the same folder, or the name of a shipped design."
        ),
    ],
    quick: Annotated[bool, typer.Option("--quick", help="Omit flights and random sequences.")] = False,
    scenario: Annotated[
        str, typer.Option(help="Fly this scenario instead, and check level, disturbances and nominal inputs.")
    ] = "",
    corners: Annotated[
        bool, typer.Option("--corners", help="With --scenario: also at the corners that determine a bound.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Recompute everything that a design and its certificate state, and name the first item that fails.

    No hash is relied on.

    Example: hsv verify offline_design/baseline.yaml --scenario case1_qp
    """
    from hsv.base.errors import QuantityError
    from hsv.cli.progress import stages
    from hsv.control.design_file import find_design
    from hsv.design.verification.scenario import bounding_corners, scenario_checks
    from hsv.design.verification.verifier import load_subject
    from hsv.design.verification.verifier import verify as recompute
    from hsv.flight.scenario import load_scenario

    if corners and not scenario:
        raise QuantityError("corners: expected with --scenario only")
    subject = load_subject(find_design(file))
    with stages() as progress:
        checks = recompute(subject, quick or bool(scenario), progress)
        if scenario:
            loaded = load_scenario(scenario)
            over = bounding_corners(subject) if corners else [{}]
            flights = scenario_checks(subject, loaded, over, lambda done: progress("flights", done, len(over)))
            checks["scenario"] = list(flights)
    failing = [(part, check) for part, made in checks.items() for check in made if not check.ok]
    if json:
        rows = [{"part": part, **vars(check)} for part, made in checks.items() for check in made]
        print_json({"claims": rows, "ok": not failing})
    else:
        console.print(_table(checks))
    if failing:
        part, check = failing[0]
        report_error(f"{part}: check fails: {check}")
        raise typer.Exit(1)


def _table(checks: dict[str, list[Check]]) -> Table:
    table = new_table("", "check", "found", "expected")
    for part, made in checks.items():
        if not made:
            continue
        table.add_row("", Text(part, "bold"), "", "")
        for check in made:
            cells = ("ok" if check.ok else "FAIL", f"  {check.name}", _found(check), check.expected)
            table.add_row(*cells, style=None if check.ok else "bold red")
    total, held = sum(len(made) for made in checks.values()), sum(c.ok for made in checks.values() for c in made)
    table.add_row("", Text(f"{held} of {total} checks pass", "bold"), "", "")
    return table


def _found(check: Check) -> str:
    """Return the value found to three digits, or in full if they hide on which side of a bound it is."""
    if isinstance(check.value, str) or not check.ok or significant(check.value) in ("1", "-1"):
        return check.shown
    return significant(check.value)
