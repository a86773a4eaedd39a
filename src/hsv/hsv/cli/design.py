"""The command ``hsv design``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from hsv.cli.options import JsonOption
from hsv.cli.output import check_target, console, print_json

if TYPE_CHECKING:
    from hsv.control.design_file import ControlDesign
    from hsv.design.inputs import DesignInputs
    from hsv.design.sets.compare import Row


def design(
    name: Annotated[str, typer.Argument(help="Name of a design input in offline_design/, or path of a TOML file.")],
    out: Annotated[Path | None, typer.Option(help="Parameter file to write; default: beside the input.")] = None,
    compare_sets: Annotated[
        bool, typer.Option("--compare-sets", help="Also compute the set in the other ways, and print a table.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Compute a controller offline, with its tube; write its parameter file and, beside it, its certificate.

    Example: hsv design baseline
    """
    from hsv.cli.progress import stages
    from hsv.control.design_file import write_design
    from hsv.design.baseline import design_baseline
    from hsv.design.certificate import certificate_path, write_certificate
    from hsv.design.inputs import find_inputs, read_inputs

    if out:
        check_target(out, "out")
    source = find_inputs(name)
    inputs = read_inputs(source)
    with stages() as progress:
        result = design_baseline(inputs, progress)
    target = out or source.with_suffix(".yaml")
    write_design(target, result.design, f"Written by: hsv design {name}. SI units; see offline_design/README.md.")
    write_certificate(certificate_path(target), result.report)
    rows = _compared(result.design, result.report, inputs) if compare_sets else []
    if json:
        compared = {"compared_sets": [row.as_dict() for row in rows]} if compare_sets else {}
        print_json(result.report | compared | {"file": str(target)})
        return
    feedback, tube = result.report["feedback"], result.report["tube"]
    console.print(f"vertices             {result.report['vertices']}")
    console.print(f"spectral radius A+BF {max(feedback['spectral_radii']):.6f} (rigid states, worst vertex)")
    console.print(f"(24) eigenvalue      {min(feedback['lmi_smallest_eigenvalues']):.3g} (least over the vertices)")
    console.print(f"nominal gains        {len(result.report['nominal'])}")
    console.print(f"invariant set        {tube['invariant_set']['kind']}, certified at every vertex")
    level = tube["flights"]["worst_level"]
    if level is not None:
        console.print(f"worst level          {level:.3f} (of 1, over {tube['flights']['flights']} flights)")
    console.print(f"written              {target}, {certificate_path(target).name}")
    if rows:
        console.print(_table(rows))
        for row in rows:
            if row.note:
                console.print(f"{row.name}: {row.note}", markup=False)


def _compared(design: ControlDesign, report: dict[str, Any], inputs: DesignInputs) -> list[Row]:
    from hsv.design.disturbance import DisturbanceSet
    from hsv.design.sets.compare import compare_sets
    from hsv.design.tube_problem import tube_problem

    disturbance = report["tube"]["disturbance"]
    problem = tube_problem(design, DisturbanceSet.from_report(disturbance["channels"]))
    delta = disturbance["boxes"]["delta"]
    return compare_sets(design, problem, delta, inputs.disturbance.inflation, inputs.invariant_set)


def _table(rows: list[Row]) -> Table:
    from hsv.units import to_paper

    table = Table(title="Invariant sets: half-widths about the centre", title_justify="left", box=None, pad_edge=False)
    columns = {
        "h ft": "m",
        "V ft/s": "m/s",
        "alpha deg": "rad",
        "theta deg": "rad",
        "q deg/s": "rad/s",
        "FZ fuel": "1",
        "FZ elevator deg": "rad",
        "size": "1",
    }
    table.add_column("set")
    for name in columns:
        table.add_column(name, justify="right")
    for row in rows:
        cells = ["-"] * len(columns)
        if row.half_width is not None and row.feedback is not None and row.size is not None:
            values = [*row.half_width[:5], *row.feedback, row.size]
            cells = [f"{to_paper(float(v), unit)[0]:.3g}" for v, unit in zip(values, columns.values(), strict=True)]
        table.add_row(row.name, *cells)
    return table
