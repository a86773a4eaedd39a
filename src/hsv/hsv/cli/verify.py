"""The command ``hsv verify``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import JsonOption
from hsv.cli.output import console, print_json


def verify(
    file: Annotated[Path, typer.Argument(help="Parameter file of a design; its certificate lies beside it.")],
    quick: Annotated[bool, typer.Option("--quick", help="Without the vehicle, flights and random sequences.")] = False,
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
    from hsv.design.verification.verifier import load_subject, require
    from hsv.design.verification.verifier import verify as recompute
    from hsv.simulation.scenario import load_scenario

    subject = load_subject(file)
    with stages() as progress:
        claims = recompute(subject, quick or bool(scenario), progress)
        if scenario:
            loaded = load_scenario(scenario)
            over = bounding_corners(subject) if corners else [{}]
            claims += scenario_claims(subject, loaded, over, lambda done: progress("flights", done, len(over)))
    if json:
        print_json({"claims": [vars(claim) for claim in claims], "ok": all(claim.ok for claim in claims)})
    else:
        for claim in claims:
            console.print(f"{'ok  ' if claim.ok else 'FAIL'} {claim}", soft_wrap=True, markup=False)
    require(claims)
