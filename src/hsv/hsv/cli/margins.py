"""The command on stability margins."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from hsv.base.errors import HsvError, ParameterError, QuantityError, RunError
from hsv.cli import output
from hsv.cli.options import ForceOption, JsonOption, check_new, check_target, writing


def margins(
    name: Annotated[str, Argument(help="Design or scenario: a shipped name, or the path of a .yaml or .toml file.")],
    corners: Annotated[bool, Option("--corners", help="Also all corners of the vehicle's bounds.")] = False,
    worst: Annotated[Path | None, Option(help="Write the worst corner as a scenario; with --corners.")] = None,
    flown: Annotated[bool, Option("--flown", help="Also fly both sides of the borders of stability.")] = False,
    out: Annotated[Path | None, Option(help="Also write a page with the curves to this .html file.")] = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Compute the stability margins of a design or of a scenario's loop.

    The loops are broken at the fuel, at the elevator, at both, and at each measurement: disk margin, proved at all
    frequencies, with the gain and phase that it guarantees; gain, phase and delay margins. Each is the worst over the
    vertices of the design, and for the coupled vehicle along the trajectory with the hardware of the scenario.

    Example: hsv margins case1_robust --corners; hsv margins baseline --out margins.html
    """
    from hsv.base.files import is_path
    from hsv.certificate.coverage import region_parameters
    from hsv.certificate.margins import CASES, design_loops
    from hsv.flight.assembly import assemble_flight, flight_parameters
    from hsv.flight.margins import MarginResults, corner_file, flown_borders, scenario_loops
    from hsv.flight.scenario import load_scenario, scenario_names

    if out:
        check_target(out, "out", ".html")
        check_new(out, "out", force)
    if worst:
        check_new(worst, "worst", force)
    of_scenario = name.endswith(".toml") if is_path(name) else name in scenario_names()
    if worst and not (of_scenario and corners):
        raise QuantityError("worst: expected with a scenario and --corners only")
    if of_scenario:
        scenario = load_scenario(name)
        vehicles = {"coupled vehicle": scenario_loops(scenario)}
        design, values = assemble_flight(scenario).controller.design, flight_parameters(scenario)  # type: ignore[attr-defined]
    else:
        subject = _subject(name)
        design, inputs = subject.design, subject.certificate["inputs"]
        vehicles = {f"{case} hardware": design_loops(design, subject.vehicle, inputs, case) for case in CASES}
        values = {**design.to_parameters(), **region_parameters(inputs, subject.vehicle)}
    results = MarginResults.of(name, design, vehicles)
    ends = ("start", "target", "fault")
    with output.stages() as progress:
        for case, around in vehicles.items() if corners else ():
            at_ends = around.at(ends)
            found = at_ends.worst("elevator", at_ends.corners(), partial(progress, f"corners, {case}"))
            results.corners[case] = found
            if found.count < len(at_ends.corners()):
                break
    interrupted = any(found.count < len(vehicles[case].corners()) for case, found in results.corners.items())
    first = next(iter(vehicles.values()))
    if flown and not interrupted:
        results.borders = flown_borders(values, design, first)
    if interrupted:
        worst = None  # the worst of the corners that are done need not be the worst of all
    if worst:
        corner = next(iter(results.corners.values())).corner
        with writing(worst, "worst"):
            worst.write_text(corner_file(scenario, first, corner), encoding="utf-8")
    if out:
        from hsv.pages.margins import write_margin_page

        write_margin_page(results, out)
    if json:
        output.print_json(results.as_dict())
    else:
        _print(results)
        output.say(*(f"written {path}" for path in (worst, out) if path))
    if interrupted:
        raise output.Interrupted("interrupted; the corners are those that were done")
    if not all(border.agrees for border in results.borders):
        raise RunError("flown: a flight does not agree with the computed border")


def _subject(name: str) -> Any:
    from hsv.base.files import is_path
    from hsv.certificate.checks import load_subject
    from hsv.control.design_file import find_design

    try:
        return load_subject(find_design(name))
    except HsvError as error:
        if is_path(name) or name.endswith(".yaml") or "expected" not in str(error):
            raise
        raise ParameterError(f"{str(error).partition(':')[0]}: expected a scenario or a design") from error


def _print(results: Any) -> None:
    for title in results.loops:
        for heading, rows in (
            ("disk margins", results.disk_rows(title)),
            ("gain, phase and delay", results.classical_rows(title)),
        ):
            if rows:
                table = output.new_table(*rows[0], title=f"{title}: {heading}", right=[*rows[0]][1:6])
                table.columns[0].no_wrap = True
                for row in rows:
                    table.add_row(*row.values())
                output.console.print(table)
    for case, found in results.corners.items():
        margin = f"{found.margin:.3f} at {found.frequency:.4g} rad/s" if found.margin else "unstable"
        where = f"{found.place}, {found.corner or 'nominal vehicle'}; unstable: {found.unstable} of {found.count}"
        output.say(f"corners, {case}: elevator {margin} ({where})")
    for border in results.borders:
        inside, outside = border.flown_growth
        words = f"flown growth {inside:.3g} inside, {outside:.3g} 1/s outside"
        turns = f"{border.flown_frequency:.4g} rad/s, computed {border.frequency:.4g}"
        output.say(f"flown, {border.kind} {border.border:.4g}: {words}; {turns}")
