"""The command ``hsv export-controller``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import JsonOption
from hsv.cli.output import console, new_table, print_json
from hsv.cli.targets import check_folder, writing


def export_controller(
    design: Annotated[str, typer.Argument(help="Name of a design in offline_design/, or path of its parameter file.")],
    out: Annotated[Path, typer.Option(help="Folder for the C files; new, or with such files only.")],
    json: JsonOption = False,
) -> None:
    """Write the notch filter, nominal trajectory and tube law of a design as C99; print the cost of a step.

    Example: hsv export-controller baseline --out controller
    """
    from hsv.base.errors import ParameterError
    from hsv.control.design_file import find_design, read_design
    from hsv.control.export import controller_files, step_bounds

    loaded = read_design(find_design(design))
    texts = controller_files(loaded)
    check_folder(out, "out")
    others = sorted({path.name for path in out.iterdir()} - texts.keys()) if out.exists() else []
    if others:
        raise ParameterError(
            f"out = {str(out)!r}: holds {others[0]}, expected a new folder, or {', '.join(texts)} only"
        )
    out.mkdir(parents=True, exist_ok=True)
    paths = [out / name for name in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        with writing(path, "out"):
            path.write_text(text, encoding="utf-8")
    bounds = step_bounds(loaded)
    if json:
        written = [{"path": str(path), "size_bytes": path.stat().st_size} for path in paths]
        print_json({"written": written, "most_in_a_step": {name: vars(bound) for name, bound in bounds.items()}})
        return
    counts = ("multiplications", "additions", "comparisons", "numbers of state")
    table = new_table("most in a step", *counts, right=counts)
    for name, bound in bounds.items():
        table.add_row(name, *map(str, vars(bound).values()))
    console.print(table)
    for path in paths:
        console.print(f"written {path}", soft_wrap=True)
