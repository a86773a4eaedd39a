"""Commands that write code: a controller as C99 or FMU, a vehicle as FMU, and the header for blocks in C."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from hsv.base.errors import ParameterError
from hsv.cli import output
from hsv.cli.options import ForceOption, JsonOption, ScenarioArgument, check_folder, check_new, writing

if TYPE_CHECKING:
    from hsv.plugins.fmu_export import ExportedBlock

FMU_HELP = "FMU for co-simulation, FMI 3.0, to write; needs a C compiler."


def export_controller(
    design: Annotated[str, Argument(help="Name of a design in offline_design/, or path of its parameter file.")],
    out: Annotated[Path | None, Option(help="Folder for the C files; new, or with such files only.")] = None,
    fmu: Annotated[Path | None, Option(help=FMU_HELP)] = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Write the notch filter, nominal trajectory and tube law of a design as C99 or FMU; print the cost of a step.

    Example: hsv export-controller baseline --out controller
    """
    from hsv.control.design_file import find_design, read_design
    from hsv.plugins.c_export import controller_files, exported_controller, step_bounds

    if out is None and fmu is None:
        raise ParameterError("out, fmu: missing, expected --out FOLDER, --fmu FILE or both")
    loaded = read_design(find_design(design))
    texts = controller_files(loaded) if out else {}
    if out:
        check_folder(out, "out")
        others = sorted({path.name for path in out.iterdir()} - texts.keys()) if out.exists() else []
        if others:
            raise ParameterError(
                f"out = {str(out)!r}: holds {others[0]}, expected a new folder, or {', '.join(texts)} only"
            )
    if fmu:
        _write_fmu(fmu, exported_controller(loaded), force)
    for name, text in texts.items():
        assert out
        out.mkdir(parents=True, exist_ok=True)
        with writing(out / name, "out"):
            (out / name).write_text(text, encoding="utf-8")
    bounds = step_bounds(loaded)
    if not json:
        counts = ("multiplications", "additions", "comparisons", "numbers of state")
        table = output.new_table("most in a step", *counts, right=counts)
        for name, bound in bounds.items():
            table.add_row(name, *map(str, vars(bound).values()))
        output.console.print(table)
    costs = {name: vars(bound) for name, bound in bounds.items()}
    written = [*([out / name for name in texts] if out else ()), *([fmu] if fmu else ())]
    output.print_written(written, json, most_in_a_step=costs)


def export_vehicle(
    scenario: ScenarioArgument,
    fmu: Annotated[Path, Option(help=FMU_HELP)],
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Write the vehicle of a scenario, with its equipment, faults and reference, as an FMU.

    Example: hsv export-vehicle case1 --fmu vehicle.fmu
    """
    from hsv.flight.scenario import load_scenario
    from hsv.flight.vehicle_export import exported_vehicle

    _write_fmu(fmu, exported_vehicle(load_scenario(scenario)), force)
    output.print_written([fmu], json)


def _write_fmu(path: Path, block: ExportedBlock, force: bool) -> None:
    from hsv.plugins.fmu_export import write_fmu

    check_new(path, "fmu", force)
    with writing(path, "fmu"):
        write_fmu(path, block)


def include() -> None:
    """Print the folder of hsv_block.h, the header of controllers and other blocks in C, for a compiler's option -I.

    Example: hsv include
    """
    from hsv.plugins.library import include_folder

    print(include_folder())
