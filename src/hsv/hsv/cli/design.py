"""Commands on designs: design, verification, certification and governor."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text
from typer import Argument, Option

from hsv.base.errors import DesignError, ParameterError, QuantityError
from hsv.base.units import UnitSystem, quantity_text, significant
from hsv.cli import output
from hsv.cli.options import (
    DesignArgument,
    ForceOption,
    JsonOption,
    ScenarioArgument,
    UnitsOption,
    check_new,
    writing,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from hsv.certificate.checks import Check, Subject
    from hsv.control.design import ControlDesign

_DESIGN_SECONDS = {"baseline": 175.0, "adjustable": 294.0}
"""Measured computation times (s) of these two designs, with 1025 flights each."""

HALF_WIDTHS = {"h": "m", "V": "m/s", "alpha": "rad", "theta": "rad", "q": "rad/s", "FZ fuel": "1", "FZ elevator": "rad"}
"""Headings of a table of invariant sets, with SI units: half-widths of the rigid states and of the feedback F Z."""


def design(
    name: Annotated[str, Argument(help="Name of a design input in offline_design/, or path of a TOML file.")],
    out: Annotated[Path | None, Option(help="Parameter file to write; default: NAME.yaml.")] = None,
    force: ForceOption = False,
    tau: Annotated[str, Option(help="Adjustable factor: one number, or five with commas between.")] = "",
    check: Annotated[bool, Option("--check", help="Only compare with the shipped parameter file.")] = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute a controller with its tube offline, and write its parameter file and its certificate.

    The certificate is written next to the parameter file; existing files are not overwritten unless --force is given. A
    design for a share of the disturbances W is written, too, and the exit code is 1.
    With --check, nothing is written: the design is compared with the shipped one, and if the largest deviation is above
    the tolerance, it is printed and the exit code is 1.

    Example: hsv design baseline; hsv design adjustable --tau 0.8 --out softer.yaml; hsv design baseline --check
    """
    from hsv.certificate.checks import load_subject
    from hsv.certificate.coverage import only_share
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
    if check and (out or force or tau):
        raise ParameterError("check: --out, --force or --tau given, expected --check alone")
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
    if json:
        output.print_json(result.report | {"file": str(target)})
    else:
        _summary(result.report)
        output.say(f"written {target}, {certificate_path(target).name}")
    if partly := only_share(result.report):
        output.report_error(f"{inputs.name}: {partly}")
        raise typer.Exit(1)


def _half_widths(half_width: np.ndarray | None, feedback: np.ndarray | None) -> list[float] | None:
    """Return half-widths of a set: rigid states, then feedback F Z; None if one is unknown."""
    return None if half_width is None or feedback is None else [*half_width[:5], *feedback]


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
        "invariant set": f"{tube['invariant_set']['kind']}, certified at every vertex, given W",
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
    corners: Annotated[bool, Option("--corners", help="Margins at all corners; with --scenario, flights.")] = False,
    exact: Annotated[bool, Option("--exact", help="First prove the inequalities in rational numbers.")] = False,
    seed: Annotated[int | None, Option(min=0, help="Seed of drawn flights and sequences; default: a new one.")] = None,
    flights: Annotated[int | None, Option(min=1, help="Number of flights to draw; default: 192.")] = None,
    verbose: Annotated[bool, Option("--verbose", help="Also print the checks that pass, a line each.")] = False,
    json: JsonOption = False,
) -> None:
    """Recompute what a design and its certificate state, and name the first item that fails.

    Inequalities, sets and bounds are computed by other code than in the design. Vehicle, linearisation, trim,
    actuators, notch filter, flights, their disturbances and corners are the same code, with tests of its own. The
    flights that measure W are flown again, and others are drawn: the seed is printed, and --seed repeats it. Fields
    that no check recomputes are counted, with --verbose listed, and unknown fields are refused. A design for a share
    of W fails.

    Example: hsv verify baseline --seed 1; hsv verify robust --quick --corners;
    hsv verify baseline --scenario case1_qp
    """
    import secrets

    from hsv.certificate.checks import STATED, gathered, load_subject
    from hsv.certificate.exact import UNPROVED, exact_checks
    from hsv.certificate.margin_checks import corner_checks
    from hsv.control.design_file import find_design
    from hsv.flight.flown_checks import DRAWN, bounding_corners, scenario_checks
    from hsv.flight.flown_checks import verify as recompute
    from hsv.flight.scenario import load_scenario

    quick = quick or bool(scenario)
    for name, value in {"seed": seed, "flights": flights}.items():
        if quick and value is not None:
            raise QuantityError(f"{name}: given, expected without --quick and --scenario, which draw no flights")
    subject = load_subject(find_design(file))
    seed = secrets.randbits(32) if seed is None else seed
    with output.stages() as progress:
        long = {"exact arithmetic": partial(exact_checks, subject)} if exact else {}
        if corners and not scenario:
            long["margins at all corners"] = partial(corner_checks, subject, progress)
        checks: dict[str, list[Check]] = {}
        # Each of these checks is printed at once, so that an interruption leaves those that are finished.
        for part, find in long.items():
            checks[part] = []
            for check in gathered(part, find):
                checks[part].append(check)
                if not json:
                    _say_check(check)
        checks |= recompute(subject, quick, progress, seed=seed, flights=flights or DRAWN)
        if scenario:
            over = bounding_corners(subject) if corners else [{}]
            checks["scenario"] = list(scenario_checks(subject, load_scenario(scenario), over, progress))
    rows = [(part, check) for part, made in checks.items() for check in made]
    failing = [(part, check) for part, check in rows if not check.ok]
    unproved = list(UNPROVED) if exact else []
    if json:
        claims = [{"part": part, **vars(check)} for part, check in rows]
        others = ({} if quick else {"seed": seed}) | ({"not_proved": unproved} if exact else {})
        output.print_json({"claims": claims, "stated": STATED, **others, "ok": not failing})
    else:
        for part, made in checks.items():
            shown = [check for check in made if (verbose or not check.ok) and part not in long]
            if made:
                output.say(Text(f"{part}: {sum(check.ok for check in made)} of {len(made)} checks pass", "bold"))
            for check in shown:
                _say_check(check)
        output.say(*(output.folded(f"not proved, {item}") for item in unproved))
        output.say(output.folded(f"not recomputed: {', '.join(STATED) if verbose else f'{len(STATED)} fields'}"))
        if not quick:
            output.say(f"flights and sequences drawn with --seed {seed}")
        output.say(Text(f"{len(rows) - len(failing)} of {len(rows)} checks pass", "bold"))
    if failing:
        part, check = failing[0]
        output.report_error(f"{part}: check fails: {check}")
        raise typer.Exit(1)


def _say_check(check: Check) -> None:
    words = f"{check.shown}{f', expected {check.expected}' if check.expected else ''}"
    if check.expected == "at most 1 tolerance":
        words = f"deviation {check.shown} tolerances (at most 1)"
    line = output.folded(f"{'ok' if check.ok else 'FAIL':4}  {check.name}: {words}", 8)
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
        output.console.print(
            output.quantity_table("Half-widths of the invariant set, given W", HALF_WIDTHS, rows, units)
        )
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
        corners.add_row(f"{t:g} s", quantity_text(h, "m", units), quantity_text(v, "m/s", units))
    output.console.print(corners)
    output.console.print(
        f"corners blended over {reference.blend:g} s on either side; at rest from {reference.end:g} s on"
    )
    heads = ("least", "largest", "lower bound", "upper bound", "largest step in a period")
    table = output.new_table("nominal input", *heads, right=heads)
    for name, unit, values in inputs:
        table.add_row(name.replace("_", " "), *(quantity_text(float(value), unit, units) for value in values))
    output.console.print(table)
    if out:
        output.say(f"written {out}")
