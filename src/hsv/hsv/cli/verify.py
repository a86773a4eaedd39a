"""The command ``hsv verify``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from hsv.cli.options import JsonOption
from hsv.cli.output import console, new_table, print_json, report_error
from hsv.units import significant

if TYPE_CHECKING:
    from rich.table import Table

    from hsv.design.verification.claims import Claim


def verify(
    file: Annotated[Path, typer.Argument(help="Parameter file of a design; its certificate lies beside it.")],
    quick: Annotated[bool, typer.Option("--quick", help="Without flights and random sequences.")] = False,
    scenario: Annotated[
        str, typer.Option(help="Fly this scenario instead, and check level, disturbances and plan of its flight.")
    ] = "",
    corners: Annotated[
        bool, typer.Option("--corners", help="With --scenario: at the corners that set a bound, too.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Recompute every claim of a design; fails naming the first that does not hold. No hash is relied on.

    Example: hsv verify offline_design/baseline.yaml --scenario case1_qp
    """
    from hsv.cli.progress import stages
    from hsv.design.verification.scenario import bounding_corners, scenario_claims
    from hsv.design.verification.verifier import load_subject
    from hsv.design.verification.verifier import verify as recompute
    from hsv.errors import QuantityError
    from hsv.simulation.scenario import load_scenario

    if corners and not scenario:
        raise QuantityError("corners: expected with --scenario, whose flights they are")
    subject = load_subject(file)
    with stages() as progress:
        claims = recompute(subject, quick or bool(scenario), progress)
        if scenario:
            loaded = load_scenario(scenario)
            over = bounding_corners(subject) if corners else [{}]
            flights = scenario_claims(subject, loaded, over, lambda done: progress("flights", done, len(over)))
            claims["scenario"] = list(flights)
    failing = [(part, claim) for part, made in claims.items() for claim in made if not claim.ok]
    if json:
        rows = [{"part": part, **vars(claim)} for part, made in claims.items() for claim in made]
        print_json({"claims": rows, "ok": not failing})
    else:
        console.print(_table(claims))
    if failing:
        part, claim = failing[0]
        report_error(f"{part}: claim fails: {claim}")
        raise typer.Exit(1)


def _table(claims: dict[str, list[Claim]]) -> Table:
    table = new_table("", "claim", "came out", "expected")
    for part, made in claims.items():
        if not made:
            continue
        table.add_row("", Text(part, "bold"), "", "")
        for claim in made:
            cells = ("ok" if claim.ok else "FAIL", f"  {claim.name}", _came_out(claim), claim.expected)
            table.add_row(*cells, style=None if claim.ok else "bold red")
    total, held = sum(len(made) for made in claims.values()), sum(c.ok for made in claims.values() for c in made)
    table.add_row("", Text(f"{held} of {total} claims hold", "bold"), "", "")
    return table


def _came_out(claim: Claim) -> str:
    """Return what came out to three digits, unless these hide which side of a bound it is on, as 0.9999 would be 1."""
    if isinstance(claim.value, str) or not claim.ok or significant(claim.value) in ("1", "-1"):
        return claim.shown
    return significant(claim.value)
