"""Commands on models and designs: trim, linear models, design, verification, certification, governor and export."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text
from typer import Argument, Option

from hsv.base.errors import DesignError, ParameterError, QuantityError
from hsv.base.files import json_text
from hsv.base.units import UnitSystem, in_words, significant
from hsv.cli import output
from hsv.cli.options import (
    DesignArgument,
    ForceOption,
    JsonOption,
    ScenarioArgument,
    UnitsOption,
    check_folder,
    check_new,
    check_target,
    writing,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from rich.table import Table

    from hsv.certificate.checks import Check, Subject
    from hsv.control.design import ControlDesign
    from hsv.control.linear_model import LinearModel
    from hsv.model.lpv.linearisation import Mode
    from hsv.plugins.fmu_export import ExportedBlock

_DESIGN_SECONDS = {"baseline": 175.0, "adjustable": 294.0}
"""Measured computation times (s) of these two designs, with 1025 flights each."""

AltitudeOption = Annotated[
    str, Option(help="Altitude with unit, e.g. '85500 ft'; default: a published point, or the envelope's middle.")
]
VelocityOption = Annotated[str, Option(help="Velocity with unit, e.g. '7900 ft/s'; default likewise.")]
CouplingOption = Annotated[
    str, Option(help="Inertial coupling: a set of the vehicle, or a multiple of derived, as 0.65.")
]
VehicleOption = Annotated[str, Option(help="Vehicle, by name or path of a TOML file; default: the paper's.")]

UNIT_SYSTEMS = {
    UnitSystem.metric: "SI with degrees",
    UnitSystem.si: "SI",
    UnitSystem.paper: "ft, ft/s, deg, slug^0.5 ft",
}
HALF_WIDTHS = {"h": "m", "V": "m/s", "alpha": "rad", "theta": "rad", "q": "rad/s", "FZ fuel": "1", "FZ elevator": "rad"}
"""Headings of a table of invariant sets, with SI units: half-widths of the rigid states and of the feedback F Z."""


def trim(
    altitude: AltitudeOption = "",
    velocity: VelocityOption = "",
    climb_rate: Annotated[str, Option(help="Climb rate with unit, e.g. '10 ft/s'.")] = "0 m/s",
    acceleration: Annotated[str, Option(help="Acceleration with unit, e.g. '4 ft/s^2'.")] = "0 m/s^2",
    vehicle: VehicleOption = "",
    coupling: CouplingOption = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute the equilibrium at an altitude and a velocity (paper eq. 5): level, or climbing and accelerating.

    Example: hsv trim --altitude "85500 ft" --velocity "7900 ft/s" --units paper
    """
    from hsv.model.dynamics import forces
    from hsv.model.trim import trim_at
    from hsv.model.vehicle import DEFAULT_VEHICLE, load_vehicle

    described = load_vehicle(vehicle or DEFAULT_VEHICLE)
    parameters = described.coupled(coupling)
    found = trim_at(parameters, *described.condition(altitude, velocity), climb_rate, acceleration)
    units_of_forces = {"lift": "N", "drag": "N", "thrust": "N", "pitching_moment": "N m", "dynamic_pressure": "Pa"}
    acting = zip(units_of_forces.items(), forces(found.state, found.input, parameters), strict=True)
    quantities = found.quantities | {name: (value, unit) for (name, unit), value in acting}
    if json:
        output.print_json(output.to_json(quantities, units) | {"largest_residual_si": found.residual})
    else:
        output.print_table("Trim", quantities, units, digits=5)


def linearise(
    altitude: AltitudeOption = "",
    velocity: VelocityOption = "",
    vehicle: VehicleOption = "",
    coupling: CouplingOption = "",
    model: Annotated[str, Option(help="Model: coupled (CM), decoupled (DM), with notch filter (ECM).")] = "CM",
    reading: Annotated[str, Option(help="Pitch rate in eq. 40 (ECM): physical (q) or printed (q').")] = "",
    out: Annotated[Path | None, Option(help="Also write the model to this .mat, .npz or .json file.")] = None,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute the linear model at a trim point, its poles and zeros (paper eq. 6 to eq. 9; ECM: eq. 40 to eq. 43).

    The zeros are those from both inputs to altitude and velocity. Files and JSON have A, B, C and D, the names and
    units of states, inputs and outputs, and the operating point.

    Example: hsv linearise --coupling derived --model ECM --out model.mat
    """
    from hsv.control.linear_model import linearise

    if out:
        check_target(out, "out", ".mat", ".npz", ".json")
    found = linearise(altitude, velocity, vehicle=vehicle, coupling=coupling, model=model, reading=reading)
    if json or out:
        units = output.json_system(units)
    shown = found.in_units(units)
    poles, zeros = found.poles, found.zeros
    described = _described(shown, units) | {"poles": [*map(_mode, poles)], "zeros": [*map(_mode, zeros)]}
    if out:
        with writing(out, "out"):
            if out.suffix == ".json":
                out.write_text(json_text(described, indent=2) + "\n", encoding="utf-8")
            else:
                shown.save(out)
    if json:
        output.print_json(described)
        return
    for name, matrix, columns in (("A", shown.A, shown.states), ("B", shown.B, shown.inputs)):
        cells = [[significant(entry) for entry in row] for row in matrix.tolist()]
        output.print_matrix(f"{name} ({UNIT_SYSTEMS[units]})", list(shown.states), list(columns), cells)
    output.console.print(_modes_table("Poles", poles))
    if zeros:
        output.console.print(_modes_table("Zeros from both inputs to altitude and velocity", zeros))
    if out:
        output.say(f"written {out}")


def _described(model: LinearModel, units: UnitSystem) -> dict[str, Any]:
    """Return a linear model as JSON; its numbers are in ``units``, whose name is in the keys of the matrices."""
    values = {name: value.tolist() if hasattr(value, "tolist") else value for name, value in model.as_dict().items()}
    matrices = {f"{name}_{units}": values.pop(name) for name in "ABCD"}
    points = (("state", model.states), ("input", model.inputs))
    at = {
        f"{name}{'_' * bool(output.unit_key(unit))}{output.unit_key(unit)}": value
        for kind, signals in points
        for (name, unit), value in zip(signals.items(), values.pop(f"operating_{kind}"), strict=True)
    }
    return values | matrices | {"operating_point": at}


def _damping(mode: Mode) -> float | None:
    """Return the damping ratio; None for a pole at the origin, where its sign would be that of a rounding error."""
    return mode.damping_ratio if round(mode.natural_frequency, 9) else None


def _mode(mode: Mode) -> dict[str, float | None]:
    return {
        "real_rad_per_s": mode.pole.real,
        "imag_rad_per_s": mode.pole.imag,
        "natural_frequency_rad_per_s": mode.natural_frequency,
        "damping_ratio": _damping(mode),
    }


def _modes_table(title: str, modes: list[Mode]) -> Table:
    headings = ("real rad/s", "imaginary rad/s", "frequency rad/s", "damping ratio")
    table = output.new_table(*headings, title=title, right=headings)
    for mode in modes:
        damping = _damping(mode)
        table.add_row(
            # A pole at the origin has a rounding error.
            significant(round(mode.pole.real, 9) + 0.0),
            f"±{significant(mode.pole.imag)}" if mode.pole.imag else "0",
            significant(round(mode.natural_frequency, 9)),
            "-" if damping is None else significant(damping),
        )
    return table


def design(
    name: Annotated[str, Argument(help="Name of a design input in offline_design/, or path of a TOML file.")],
    out: Annotated[Path | None, Option(help="Parameter file to write; default: NAME.yaml.")] = None,
    force: ForceOption = False,
    compare_sets: Annotated[bool, Option("--compare-sets", help="Also print star norms and counter-examples.")] = False,
    tau: Annotated[str, Option(help="Adjustable factor: one number, or five with commas between.")] = "",
    check: Annotated[bool, Option("--check", help="Only compare with the shipped parameter file.")] = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute a controller with its tube offline, and write its parameter file and its certificate.

    The certificate is written next to the parameter file; existing files are not overwritten unless --force is given.
    With --check, nothing is written: the design is compared with the shipped one, and if the largest deviation is above
    the tolerance, it is printed and the exit code is 1.

    Example: hsv design baseline; hsv design adjustable --tau 0.8 --out softer.yaml; hsv design baseline --check
    """
    from hsv.certificate.checks import load_subject
    from hsv.control.design_file import certificate_path, write_certificate, write_design
    from hsv.design.adjustable import design_adjustable
    from hsv.design.baseline import design_baseline
    from hsv.design.inputs import find_inputs, read_inputs, with_tau

    source = find_inputs(name)
    inputs = read_inputs(source)
    if tau:
        try:
            inputs = with_tau(inputs, [float(part) for part in tau.split(",")])
        except ValueError as error:
            if isinstance(error, DesignError):
                raise
            raise DesignError(f"tau = {tau!r}: expected one number, or five separated by commas") from error
    if check and (out or force or tau or compare_sets):
        raise ParameterError("check: --out, --force, --tau or --compare-sets given, expected --check alone")
    target = out or Path(f"{source.stem}.yaml")
    # Check the files before the computation, which takes minutes.
    shipped = load_subject(source.with_suffix(".yaml")) if check else None
    for path in () if check else (target, certificate_path(target)):
        check_new(path, "out", force)
    import cvxpy  # noqa: F401  if it is missing, the command ends before it prints the estimate

    size = "adjustable" if inputs.adjustable else "baseline"
    output.print_estimate(_DESIGN_SECONDS[size], json, f" for a design of the size of {size}")
    with output.stages() as progress:
        result = (design_adjustable if inputs.adjustable else design_baseline)(inputs, progress)
    if shipped:
        _check(shipped, result.design, json)
        return
    command = f"hsv design {name}" + (f" --tau {tau}" if tau else "")
    with writing(target, "out"):
        write_design(target, result.design, f"Written by: {command}. SI units; see offline_design/README.md.")
    with writing(certificate_path(target), "certificate"):
        write_certificate(certificate_path(target), result.report)
    rows: list[Any] = []
    if compare_sets:
        from hsv.design import compare, disturbance, tube_problem

        W = disturbance.DisturbanceSet.from_report(result.report["tube"]["disturbance"]["channels"])
        problem = tube_problem.tube_problem(result.design, inputs.flown_vehicle, W)
        rows = compare.compare_sets(result.design, problem, inputs.invariant_set)
    if json:
        compared = {"compared_sets": [row.as_dict() for row in rows]} if rows else {}
        output.print_json(result.report | compared | {"file": str(target)})
        return
    _summary(result.report)
    output.say(f"written {target}, {certificate_path(target).name}")
    if rows:
        title = "Invariant sets: half-widths about the centre"
        sets = [(row.name, _half_widths(row.half_width, row.feedback, row.size)) for row in rows]
        output.console.print(output.quantity_table(title, {**HALF_WIDTHS, "size": "1"}, sets, units))
        output.say(*(output.folded(f"{row.name}: {row.note}") for row in rows if row.note))


def _half_widths(half_width: np.ndarray | None, feedback: np.ndarray | None, *size: float | None) -> list[float] | None:
    """Return half-widths of a set: rigid states, feedback F Z, then any given ``size``; None if one is unknown."""
    if half_width is None or feedback is None or None in size:
        return None
    return [*half_width[:5], *feedback, *(value for value in size if value is not None)]


def _check(shipped: Subject, found: ControlDesign, json: bool) -> None:
    from hsv.design.agreement import deviations

    deviating = deviations(found, shipped)
    worst = max(deviating, key=lambda deviation: deviation.scaled)
    if json:
        output.print_json({"deviations": [vars(deviation) for deviation in deviating], "ok": worst.ok})
    else:
        table = output.new_table("parameter", "largest deviation, scaled", "entry")
        for d in deviating:
            table.add_row(d.parameter, significant(d.scaled), ", ".join(map(str, d.index)) if d.scaled else "")
        output.console.print(table)
    if not worst.ok:
        output.report_error(str(worst))
        raise typer.Exit(1)


def _summary(report: dict[str, Any]) -> None:
    """Print the main numbers of the report on a design, with those of Algorithm 1 if the tube factor is adjustable."""
    feedback, tube, flights = report["feedback"], report["tube"], report["tube"]["flights"]
    lines = {
        "vertices": report["vertices"],
        "feedback gain": f"spectral radius of A + BF at most {max(feedback['spectral_radii']):.6f} (rigid states)",
        "(24)": f"least eigenvalue {min(feedback['lmi_smallest_eigenvalues']):.3g}",
        "nominal gains": len(report["nominal"]),
        "invariant set": f"{tube['invariant_set']['kind']}, certified at every vertex",
        "worst level": f"{flights['worst_level']:.3f} of 1, in {flights['flights']} flights",
    }
    if adjustable := report.get("adjustable"):
        whole, tau = adjustable["complete_fault"], ", ".join(map(significant, dict.fromkeys(adjustable["tau"])))
        lines["factor tau"] = f"from {tau}; worst level {whole['worst_level']:.3f} of 1 with the whole fault"
    output.print_section("design", lines)


def verify(
    file: DesignArgument,
    quick: Annotated[bool, Option("--quick", help="Omit flights and random sequences.")] = False,
    scenario: Annotated[str, Option(help="Fly this scenario, and check level, disturbances, inputs.")] = "",
    corners: Annotated[bool, Option("--corners", help="With --scenario: also corners.")] = False,
    exact: Annotated[bool, Option("--exact", help="First prove the inequalities in rational numbers.")] = False,
    json: JsonOption = False,
) -> None:
    """Recompute what a design and its certificate state, and name the first item that fails.

    The checks share no code with the design. Fields of the certificate that no check recomputes are listed as "stated,
    not checked".

    Example: hsv verify offline_design/baseline.yaml --scenario case1_qp
    """
    from hsv.certificate.checks import gathered, load_subject, unchecked
    from hsv.certificate.exact import UNPROVED, exact_checks
    from hsv.control.design_file import find_design
    from hsv.flight.scenario import load_scenario
    from hsv.flight.verification import bounding_corners, scenario_checks
    from hsv.flight.verification import verify as recompute

    if corners and not scenario:
        raise QuantityError("corners: expected with --scenario only")
    subject = load_subject(find_design(file))
    proofs = []
    # Each proof is printed at once, so that an interruption leaves those that are finished.
    for proof in gathered("exact arithmetic", partial(exact_checks, subject)) if exact else ():
        proofs.append(proof)
        if not json:
            _say_check(proof)
    with output.stages() as progress:
        checks = recompute(subject, quick or bool(scenario), progress)
        if scenario:
            over = bounding_corners(subject) if corners else [{}]
            checks["scenario"] = list(scenario_checks(subject, load_scenario(scenario), over, progress))
    rows = [("exact arithmetic", proof) for proof in proofs]
    rows += [(part, check) for part, made in checks.items() for check in made]
    failing = [(part, check) for part, check in rows if not check.ok]
    stated = unchecked(subject, [check for _, check in rows])
    unproved = list(UNPROVED) if exact else []
    if json:
        claims = [{"part": part, **vars(check)} for part, check in rows]
        not_proved = {"not_proved": unproved} if exact else {}
        output.print_json({"claims": claims, "stated": stated, **not_proved, "ok": not failing})
    else:
        for part, made in checks.items():
            if made:
                output.say(Text(part, "bold"))
            for check in made:
                _say_check(check)
        output.say(*(output.folded(f"not proved, {item}") for item in unproved))
        if stated:
            output.say(output.folded(f"stated, not checked: {', '.join(stated)}"))
        output.say(Text(f"{len(rows) - len(failing)} of {len(rows)} checks pass", "bold"))
    if failing:
        part, check = failing[0]
        output.report_error(f"{part}: check fails: {check}")
        raise typer.Exit(1)


def _say_check(check: Check) -> None:
    expected = f", expected {check.expected}" if check.expected else ""
    line = output.folded(f"{'ok' if check.ok else 'FAIL':4}  {check.name}: {check.shown}{expected}", 8)
    output.say(line if check.ok else Text(line, "bold red"))


def certify(
    file: DesignArgument,
    sensors: Annotated[str, Option(help="Published sensors by name, with their noise and bias.")] = "ideal",
    bias: Annotated[list[str], Option(help="Bias of a rigid state, 'angle_of_attack=0.05 deg'; repeatable.")] = [],  # noqa: B006
    actuators: Annotated[
        str, Option(help="Published actuators, with commas between, or ideal; default: the scenario's or the design's.")
    ] = "",
    gust: Annotated[str, Option(help="Wind from below and from behind of at most this velocity.")] = "0 ft/s",
    turbulence: Annotated[str, Option(help="Standard deviation of turbulence, both ways.")] = "0 ft/s",
    density: Annotated[str, Option(help="Largest difference of the density from the model's.")] = "0 %",
    scenario: Annotated[str, Option(help="Also the actuators, sensors and air of this scenario.")] = "",
    reach: Annotated[float, Option(help="Standard deviations that bound noise and turbulence.")] = 3.0,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Check whether a design remains certified with given hardware and air, and with which margin.

    Each model is added to the disturbances of the certificate separately, and then all together. A new invariant set is
    computed, and the nominal trajectory must fit into the input bounds that remain. For actuators, a line of its own
    tells whether their limits are reached in that set, if it exists. For a scenario, everything that the certificate
    does not cover is listed. The exit code is 1 if the design is not certified.

    Example: hsv certify offline_design/realistic.yaml --sensors fine --turbulence "2 ft/s"
    """
    from hsv.control.design_file import find_design
    from hsv.design.certified import load_certified
    from hsv.design.hardware.models import declared, declared_actuators, described
    from hsv.design.hardware.verdict import certified_with
    from hsv.flight.assembly import uncovered_of
    from hsv.flight.scenario import load_scenario

    subject = load_certified(find_design(file))
    models, unbounded = described(
        subject, sensor_set=sensors, bias=bias, gust=gust, turbulence=turbulence, density=density, reach=reach
    )
    uncovered: Sequence[str] = ()
    if scenario:
        loaded = load_scenario(scenario)
        uncovered = uncovered_of(loaded, subject.design, subject.certificate)
        own, further = declared(subject, loaded, reach)
        models, unbounded = models | own, unbounded + further
        actuators = actuators or declared_actuators(loaded)
    with output.stages() as progress:
        verdicts = certified_with(subject, models, actuators, progress, unbounded)
    if json:
        found = {"verdicts": [verdict.as_dict() for verdict in verdicts], "not_covered": list(uncovered)}
        output.print_json({"design": subject.design.name, **found})
    else:
        output.say(*(output.folded(f"not covered by the certificate: {item}") for item in uncovered))
        rows = [(verdict.name, _half_widths(verdict.half_width, verdict.feedback)) for verdict in verdicts]
        output.console.print(output.quantity_table("Half-widths of the invariant set", HALF_WIDTHS, rows, units))
        for verdict in verdicts:
            state = "certified" if verdict.certified else "not certified"
            output.say(output.folded(f"{verdict.name}: {state}, {verdict.said(units)}"))
    last = next((verdict for verdict in reversed(verdicts) if not verdict.certified), None)
    if last:
        output.report_error(f"{subject.design.name}: not certified with {last.name}: {last.said(units)}")
        raise typer.Exit(1)


def govern(
    scenario: ScenarioArgument = "case1",
    blend: Annotated[str, Option(help="Half the time of a change of climb rate and acceleration.")] = "2 s",
    out: Annotated[Path | None, Option(help="Scenario file to write, with the reference.")] = None,
    force: ForceOption = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Turn the commands of a scenario into the fastest jerk-limited reference that its design permits.

    Steps, ramps and lists of points become ramps along climbing, accelerating trims with blended corners. They are as
    short as possible while the nominal trajectory stays inside U minus F Z and within the rate limits of the actuators.

    Example: hsv govern case1 --blend "2 s" --out governed.toml
    """
    from hsv.base.units import parse_quantity
    from hsv.flight.governed import governed
    from hsv.model.signals import INPUT_NAMES, INPUT_UNITS

    if out:
        check_new(out, "out", force)
    found = governed(scenario, parse_quantity(blend, "s", "blend"))
    if out:
        with writing(out, "out"):
            out.write_text(found.text, encoding="utf-8")
    reference, plan = found.reference, found.reference.plan
    rates = abs(plan[1:] - plan[:-1]).max(axis=0)
    low, high = found.bounds.input_minimum, found.bounds.input_maximum
    inputs = [
        (name, unit, (plan[:, i].min(), plan[:, i].max(), low[i], high[i], rates[i]))
        for i, (name, unit) in enumerate(zip(INPUT_NAMES, INPUT_UNITS, strict=True))
    ]
    if json:
        keys = ("least", "largest", "lower_bound", "upper_bound", "largest_step")
        output.print_json(
            {
                "corners": [{"time_s": t, "altitude_m": h, "velocity_m_s": v} for t, h, v, _ in reference.corners],
                "blend_s": reference.blend,
                "end_s": reference.end,
                "plan": {
                    f"{name}{'_rad' if unit == 'rad' else ''}": dict(zip(keys, values, strict=True))
                    for name, unit, values in inputs
                },
            }
        )
        return
    corners = output.new_table("corner", "altitude", "velocity", right=("altitude", "velocity"))
    for t, h, v, _ in reference.corners:
        corners.add_row(f"{t:g} s", in_words(h, "m", units), in_words(v, "m/s", units))
    output.console.print(corners)
    output.console.print(
        f"corners blended over {reference.blend:g} s on either side; at rest from {reference.end:g} s on"
    )
    heads = ("least", "largest", "lower bound", "upper bound", "largest step in a period")
    table = output.new_table("nominal input", *heads, right=heads)
    for name, unit, values in inputs:
        table.add_row(name.replace("_", " "), *(in_words(float(value), unit, units) for value in values))
    output.console.print(table)
    if out:
        output.say(f"written {out}")


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
    from hsv.plugins.export import controller_files, exported_controller, step_bounds

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
    from hsv.flight.export import exported_vehicle
    from hsv.flight.scenario import load_scenario

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
