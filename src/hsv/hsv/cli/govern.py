"""The command ``hsv govern``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.base.units import UnitSystem, in_words
from hsv.cli.options import JsonOption, ScenarioArgument, UnitsOption
from hsv.cli.output import console, new_table, print_json
from hsv.cli.targets import check_target, writing


def govern(
    scenario: ScenarioArgument = "case1",
    blend: Annotated[
        str, typer.Option(help="Half the time in which climb rate and acceleration change at a corner.")
    ] = "2 s",
    out: Annotated[Path | None, typer.Option(help="Scenario file to write, with the reference.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Turn the commands of a scenario into the fastest jerk-limited reference that its design permits.

    Steps, ramps and lists of points become ramps along climbing, accelerating trims with blended corners. They are as
    short as possible while the nominal trajectory stays inside U minus F Z and within the rate limits of the actuators.

    Example: hsv govern case1 --blend "2 s" --out governed.toml
    """
    from hsv.base.errors import ParameterError
    from hsv.base.units import parse_quantity
    from hsv.flight.governed import governed
    from hsv.model.dynamics import INPUT_NAMES, INPUT_UNITS

    if out:
        check_target(out, "out")
        if out.exists() and not force:
            raise ParameterError(f"out = {str(out)!r}: exists, expected a new file, or --force to overwrite it")
    found = governed(scenario, parse_quantity(blend, "s", "blend"))
    if out:
        with writing(out, "out"):
            out.write_text(found.text, encoding="utf-8")
    reference, plan = found.reference, found.reference.plan
    rates = abs(plan[1:] - plan[:-1]).max(axis=0)
    inputs = {
        name: (plan[:, i].min(), plan[:, i].max(), found.bounds.minimum[i], found.bounds.maximum[i], rates[i])
        for i, name in enumerate(INPUT_NAMES)
    }
    if json:
        print_json(
            {
                "corners": [{"time_s": t, "altitude_m": h, "velocity_m_s": v} for t, h, v, _ in reference.corners],
                "blend_s": reference.blend,
                "end_s": reference.end,
                "plan": {
                    f"{name}{'_rad' if unit == 'rad' else ''}": dict(
                        zip(("least", "largest", "lower_bound", "upper_bound", "largest_step"), values, strict=True)
                    )
                    for (name, values), unit in zip(inputs.items(), INPUT_UNITS, strict=True)
                },
            }
        )
        return
    corners = new_table("corner", "altitude", "velocity", right=("altitude", "velocity"))
    for t, h, v, _ in reference.corners:
        corners.add_row(f"{t:g} s", in_words(h, "m", units), in_words(v, "m/s", units))
    console.print(corners)
    console.print(f"corners blended over {reference.blend:g} s on either side; at rest from {reference.end:g} s on")
    heads = ("least", "largest", "lower bound", "upper bound", "largest step in a period")
    table = new_table("nominal input", *heads, right=heads)
    for (name, values), unit in zip(inputs.items(), INPUT_UNITS, strict=True):
        table.add_row(name.replace("_", " "), *(in_words(float(value), unit, units) for value in values))
    console.print(table)
    if out:
        console.print(f"written {out}", soft_wrap=True)
