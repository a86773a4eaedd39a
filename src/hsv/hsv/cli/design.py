"""The command ``hsv design``."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hsv.base.units import UnitSystem, in_words, significant
from hsv.cli.options import JsonOption, UnitsOption
from hsv.cli.output import console, folded, new_table, print_json, quantity_table, report_error
from hsv.cli.targets import check_target, writing

if TYPE_CHECKING:
    from rich.table import Table

    from hsv.control.design import ControlDesign
    from hsv.design.baseline import DesignResult
    from hsv.design.inputs import DesignInputs
    from hsv.design.sets.compare import Row


def design(
    name: Annotated[str, typer.Argument(help="Name of a design input in offline_design/, or path of a TOML file.")],
    out: Annotated[
        Path | None, typer.Option(help="Parameter file to write; default: NAME.yaml in this folder.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    compare_sets: Annotated[
        bool, typer.Option("--compare-sets", help="Also compute the set by the other methods, and print a table.")
    ] = False,
    tau: Annotated[
        str, typer.Option(help="Adjustable factor in place of the input's: one number, or five with commas between.")
    ] = "",
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; compare with the parameter file in the folder of the input.")
    ] = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute a controller with its tube offline, and write its parameter file and its certificate.

    Both are written to the current folder or to --out; existing files are not overwritten unless --force is given. With
    --check, the design is compared with the shipped one; on a difference the largest deviation is printed and the exit
    code is 1.

    Example: hsv design baseline; hsv design adjustable --tau 0.8 --out softer.yaml; hsv design baseline --check
    """
    from hsv.base.errors import ParameterError
    from hsv.control.certificate import certificate_path, write_certificate
    from hsv.control.design_file import write_design
    from hsv.design.inputs import find_inputs, read_inputs, with_tau

    source = find_inputs(name)
    inputs = read_inputs(source)
    if tau:
        inputs = with_tau(inputs, _factors(tau))
    if check:
        if out or force or tau or compare_sets:
            raise ParameterError("check: --out, --force, --tau or --compare-sets given, expected --check alone")
        _check(source, inputs, json)
        return
    target = out or Path(f"{source.stem}.yaml")
    for path in (target, certificate_path(target)):
        check_target(path, "out")
        if path.exists() and not force:
            raise ParameterError(f"out = {str(path)!r}: exists, expected a new file, or --force to overwrite it")
    result = _computed(inputs)
    command = f"hsv design {name}" + (f" --tau {tau}" if tau else "")
    with writing(target, "out"):
        write_design(target, result.design, f"Written by: {command}. SI units; see offline_design/README.md.")
    with writing(certificate_path(target), "certificate"):
        write_certificate(certificate_path(target), result.report)
    rows = _compared(result.design, result.report, inputs) if compare_sets else []
    if json:
        compared = {"compared_sets": [row.as_dict() for row in rows]} if compare_sets else {}
        print_json(result.report | compared | {"file": str(target)})
        return
    if inputs.adjustable:
        console.print(_steps(result.report, units))
    else:
        _summary(result.report)
    console.print(f"written              {target}, {certificate_path(target).name}", soft_wrap=True)
    if rows:
        console.print(_table(rows, units))
        for row in rows:
            if row.note:
                console.print(folded(f"{row.name}: {row.note}"), soft_wrap=True)


def _computed(inputs: DesignInputs) -> DesignResult:
    from hsv.cli.progress import stages
    from hsv.design.adjustable import design_adjustable
    from hsv.design.baseline import design_baseline

    with stages() as progress:
        return (design_adjustable if inputs.adjustable else design_baseline)(inputs, progress)


def _check(source: Path, inputs: DesignInputs, json: bool) -> None:
    from hsv.design.verification.agreement import deviations
    from hsv.design.verification.verifier import load_subject

    shipped = load_subject(source.with_suffix(".yaml"))
    found = deviations(_computed(inputs).design, shipped)
    worst = max(found, key=lambda deviation: deviation.scaled)
    if json:
        print_json({"deviations": [vars(deviation) for deviation in found], "ok": worst.ok})
    else:
        table = new_table("parameter", "largest deviation, scaled", "entry")
        for d in found:
            table.add_row(d.parameter, significant(d.scaled), ", ".join(map(str, d.index)) if d.scaled else "")
        console.print(table)
    if not worst.ok:
        report_error(str(worst))
        raise typer.Exit(1)


def _factors(text: str) -> list[float]:
    from hsv.base.errors import DesignError

    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise DesignError(f"tau = {text!r}: expected one number, or five separated by commas") from error


def _summary(report: dict[str, Any]) -> None:
    feedback, tube = report["feedback"], report["tube"]
    console.print(f"vertices             {report['vertices']}")
    console.print(f"spectral radius A+BF {max(feedback['spectral_radii']):.6f} (rigid states, worst vertex)")
    console.print(f"(24) eigenvalue      {min(feedback['lmi_smallest_eigenvalues']):.3g} (least over the vertices)")
    console.print(f"nominal gains        {len(report['nominal'])}")
    console.print(f"invariant set        {tube['invariant_set']['kind']}, certified at every vertex")
    level = tube["flights"]["worst_level"]
    if level is not None:
        console.print(f"worst level          {level:.3f} (of 1, over {tube['flights']['flights']} flights)")


def _steps(report: dict[str, Any], units: UnitSystem) -> Table:
    """Return the seven steps of Algorithm 1 with what came of each."""
    import numpy as np

    from hsv.control.tube_factor import compact
    from hsv.model.dynamics import STATE_UNITS

    feedback, tube, adjustable = report["feedback"], report["tube"], report["adjustable"]
    accuracy, model = report["model"]["accuracy"], report["model"]
    sections = ", ".join(f"{section['zero_frequency']:g} rad/s" for section in report["inputs"]["notch"])
    half_widths = zip(tube["invariant_set"]["half_width"], STATE_UNITS, strict=False)  # of the rigid states only
    sizes = [in_words(value, unit, units) for value, unit in half_widths]
    fuel, elevator = adjustable["input_bound"]
    bounds = f"{in_words(fuel, '1', units)}, {in_words(elevator, 'rad', units)}"
    beyond = adjustable["complete_fault"]
    parts = adjustable["full_state"]["largest_real_part"]
    least = np.array(adjustable["tau"])
    tau = ", ".join(f"{value:g}" for value in compact(least))
    span = f"{tau} to 1" if least.min() < 1.0 else tau
    rows = {
        "notch filter": f"centre {sections}",
        "extended states coupling model": f"{9 + 2 * len(report['inputs']['notch'])} states, the filter's among them",
        "co-designed polytopic model": f"{' x '.join(str(n) for n in model['vertices'])} vertices, Bode within "
        f"{significant(accuracy['bode_magnitude_error_db'])} dB, "
        f"{in_words(radians(accuracy['bode_phase_error_deg']), 'rad', units)}",
        "feedback gain F'": f"spectral radius {max(feedback['spectral_radii']):.5f}; one Lyapunov function for tau "
        f"{span}, whole fault",
        "adjustable factor tau, set Z'": f"tau {tau}; {', '.join(sizes)}",
        "nominal gain K'": f"{len(report['nominal'])} gains, |u_n| at most {bounds}",
        "control law u'": f"worst level {tube['flights']['worst_level']:.3f} of 1 in W', "
        f"{beyond['worst_level']:.3f} with the whole fault, {beyond['flights']} flights each",
    }
    table = new_table("step", "name", "value", title="Algorithm 1", head=False)
    for number, (name, value) in enumerate(rows.items(), 1):
        table.add_row(f"({number})", name, value)
        if number == 4:
            table.add_row(
                "",
                "",
                f"full-state F' would cancel the notch: rightmost pole {parts['full_state']['derived']:+.2f} / s "
                f"with derived coupling, {parts['structured']['derived']:+.2f} / s as designed",
            )
    return table


def _compared(design: ControlDesign, report: dict[str, Any], inputs: DesignInputs) -> list[Row]:
    from hsv.design.disturbance import DisturbanceSet
    from hsv.design.sets.compare import compare_sets
    from hsv.design.tube_problem import tube_problem

    disturbance = report["tube"]["disturbance"]
    problem = tube_problem(design, inputs.flown_vehicle, DisturbanceSet.from_report(disturbance["channels"]))
    delta = disturbance["boxes"]["delta"]
    return compare_sets(design, problem, delta, inputs.disturbance.inflation, inputs.invariant_set)


def _table(rows: list[Row], units: UnitSystem) -> Table:
    from hsv.cli.certify import HALF_WIDTHS

    found: list[tuple[str, list[float] | None]] = []
    for row in rows:
        values = None
        if row.half_width is not None and row.feedback is not None and row.size is not None:
            values = [*row.half_width[:5], *row.feedback, row.size]
        found.append((row.name, values))
    title = "Invariant sets: half-widths about the centre"
    return quantity_table(title, {**HALF_WIDTHS, "size": "1"}, found, units)
