"""The command ``hsv design``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import JsonOption
from hsv.cli.output import check_target, console, print_json


def design(
    name: Annotated[str, typer.Argument(help="Name of a design input in offline_design/, or path of a TOML file.")],
    out: Annotated[Path | None, typer.Option(help="Parameter file to write; default: beside the input.")] = None,
    json: JsonOption = False,
) -> None:
    """Compute a controller offline: polytopic model, feedback gain F, nominal gains K; write its parameter file.

    Example: hsv design baseline
    """
    from hsv.cli.progress import stages
    from hsv.control.design_file import write_design
    from hsv.design.baseline import design_baseline
    from hsv.design.inputs import find_inputs, read_inputs

    if out:
        check_target(out, "out")
    source = find_inputs(name)
    inputs = read_inputs(source)
    with stages() as progress:
        result = design_baseline(inputs, progress)
    target = out or source.with_suffix(".yaml")
    write_design(target, result.design, f"Written by: hsv design {name}. SI units; see offline_design/README.md.")
    if json:
        print_json(result.report | {"file": str(target)})
    else:
        feedback = result.report["feedback"]
        console.print(f"vertices             {result.report['vertices']}")
        console.print(f"spectral radius A+BF {max(feedback['spectral_radii']):.6f} (rigid states, worst vertex)")
        console.print(f"(24) eigenvalue      {min(feedback['lmi_smallest_eigenvalues']):.3g} (least over the vertices)")
        console.print(f"nominal gains        {len(result.report['nominal'])}")
        console.print(f"written              {target}")
