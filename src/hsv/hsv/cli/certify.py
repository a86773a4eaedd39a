"""The command ``hsv certify``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from hsv.base.units import UnitSystem
from hsv.cli.options import JsonOption, UnitsOption
from hsv.cli.output import console, folded, print_json, quantity_table, report_error

if TYPE_CHECKING:
    from rich.table import Table

    from hsv.design.verification.verdict import Verdict


HALF_WIDTHS = {
    "h": "m",
    "V": "m/s",
    "alpha": "rad",
    "theta": "rad",
    "q": "rad/s",
    "FZ fuel": "1",
    "FZ elevator": "rad",
}
"""Columns of a table of invariant sets, with SI units: half-widths of the rigid states, and of the feedback on them."""


def certify(
    file: Annotated[
        str,
        typer.Argument(
            help="Parameter file of a design, with its certificate in the same folder, or the name of a shipped design."
        ),
    ],
    sensors: Annotated[str, typer.Option(help="Published sensors by name, with their noise and bias.")] = "ideal",
    bias: Annotated[
        list[str],
        typer.Option(help="Constant bias of a rigid state, e.g. 'angle_of_attack=0.05 deg'; can be repeated."),
    ] = [],  # noqa: B006
    actuators: Annotated[
        str,
        typer.Option(
            help="Published actuators by name, with commas between, or ideal; "
            "default: the scenario's, without a scenario those the design knows."
        ),
    ] = "",
    gust: Annotated[str, typer.Option(help="Wind from below and from behind of at most this velocity.")] = "0 ft/s",
    turbulence: Annotated[str, typer.Option(help="Standard deviation of turbulence, both ways.")] = "0 ft/s",
    density: Annotated[str, typer.Option(help="Largest difference of the density from the model's.")] = "0 %",
    scenario: Annotated[
        str,
        typer.Option(
            help="Also the actuators, sensors and air of this scenario, by name or path, beside what else is given."
        ),
    ] = "",
    reach: Annotated[
        float, typer.Option(help="Standard deviations that bound noise and turbulence; 8.572 is beyond all of ours.")
    ] = 3.0,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Check whether a design remains certified with given hardware and air, and with which margin.

    Each model is added to the disturbances of the certificate separately, and then all together. A new invariant set is
    computed, and the nominal trajectory must fit into the input bounds that remain. For actuators, the last line tells
    whether their limits are reached in that set. For a scenario, everything that the certificate does not cover is
    listed. The exit code is 1 if the design is not certified.

    Example: hsv certify offline_design/realistic.yaml --sensors fine --turbulence "2 ft/s"
    """
    from hsv.cli.progress import stages
    from hsv.control.design_file import find_design
    from hsv.design.verification.declared import declared, declared_actuators, described
    from hsv.design.verification.verdict import certified_with
    from hsv.design.verification.verifier import load_subject
    from hsv.flight.coverage import uncovered_of
    from hsv.flight.scenario import load_scenario

    subject = load_subject(find_design(file))
    models, unbounded = described(
        subject, sensor_set=sensors, bias=bias, gust=gust, turbulence=turbulence, density=density, reach=reach
    )
    uncovered: list[str] = []
    if scenario:
        loaded = load_scenario(scenario)
        uncovered = uncovered_of(loaded, subject.design, subject.certificate)
        own, further = declared(subject, loaded, reach)
        models, unbounded = models | own, unbounded + further
        actuators = actuators or declared_actuators(loaded)
    with stages() as progress:
        verdicts = certified_with(subject, models, actuators, progress, unbounded)
    if json:
        found = {"verdicts": [verdict.as_dict() for verdict in verdicts], "not_covered": uncovered}
        print_json({"design": subject.design.name, **found})
    else:
        for thing in uncovered:
            console.print(folded(f"not covered by the certificate: {thing}"), soft_wrap=True)
        console.print(_table(verdicts, units))
        for verdict in verdicts:
            state = "certified" if verdict.certified else "not certified"
            console.print(folded(f"{verdict.name}: {state}, {verdict.said(units)}"), soft_wrap=True)
    last = next((verdict for verdict in reversed(verdicts) if not verdict.certified), None)
    if last:
        report_error(f"{subject.design.name}: not certified with {last.name}: {last.said(units)}")
        raise typer.Exit(1)


def _table(verdicts: list[Verdict], units: UnitSystem) -> Table:
    rows: list[tuple[str, list[float] | None]] = []
    for verdict in verdicts:
        values = None
        if verdict.half_width is not None and verdict.feedback is not None:
            values = [*verdict.half_width, *verdict.feedback]
        rows.append((verdict.name, values))
    return quantity_table("Half-widths of the invariant set", HALF_WIDTHS, rows, units)
