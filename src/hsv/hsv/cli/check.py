"""The command ``hsv check``."""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.cli.options import JsonOption
from hsv.cli.output import console, new_table, print_json, report_error


def check(
    flown: Annotated[
        str,
        typer.Argument(
            metavar="CONTROLLER|SCENARIO", help="A controller as a scenario names it, flown in case1, or a scenario."
        ),
    ],
    json: JsonOption = False,
) -> None:
    """Check that a controller is reproducible: fly it twice, after a reset, from a copied state and under load.

    Every byte is compared. On a difference, the first step and number that differ are printed, and the exit code is 1.

    Example: hsv check tube_mpc
    """
    from hsv.cli.progress import stages
    from hsv.flight.repeatability import findings, scenario_of

    scenario = scenario_of(flown)
    found = []
    with stages() as progress:
        for finding in findings(scenario):
            found.append(finding)
            progress(scenario.controller, len(found), 4)
    failing = [finding for finding in found if finding.difference]
    if json:
        checks = [vars(finding) | {"same": not finding.difference} for finding in found]
        print_json({"controller": scenario.controller, "scenario": scenario.name, "ok": not failing, "checks": checks})
    else:
        title = f"{scenario.controller} in {scenario.name}"
        table = new_table("check", "flights", "bytes", title=title, right=["flights"])
        for finding in found:
            style = "bold red" if finding.difference else None
            table.add_row(finding.check, str(finding.flights), finding.difference or "the same", style=style)
        console.print(table)
    if failing:
        report_error(f"{scenario.controller}, {failing[0].check}: {failing[0].difference}")
        raise typer.Exit(1)
