"""The command ``hsv resilience``."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hsv.cli.options import JsonOption, SchedulerOption, WorkersOption
from hsv.cli.output import console, errors, print_json, print_matrix, resumable
from hsv.cli.targets import check_folder

if TYPE_CHECKING:
    from hsv.flight.resilience.summary import ResilienceResults


def resilience(
    controllers: Annotated[
        str,
        typer.Option(
            help="Scenarios, by name or path, separated by commas; default: five with Tube-MPC and robust MPC."
        ),
    ] = "",
    faults: Annotated[str, typer.Option(help="Faults to try, separated by commas; default: all (see --list).")] = "",
    out: Annotated[
        Path, typer.Option(help="Folder for the report, the scenarios of the worst flights, and the results.")
    ] = Path("resilience"),
    workers: WorkersOption = 0,
    scheduler: SchedulerOption = "",
    listed: Annotated[bool, typer.Option("--list", help="List the faults with their severities and exit.")] = False,
    json: JsonOption = False,
) -> None:
    """Fly controllers with faults of increasing severity until each is lost, and make a map of what they survive.

    After an interruption, the same command continues where it stopped; controllers and faults can be added later. The
    exit code is 1 if every flight crashed.

    Example: hsv resilience --controllers case1,case1_rmpc --faults elevator_loss,elevator_delay
    """
    from hsv.base.errors import RunError
    from hsv.cli.campaign_summary import announce
    from hsv.cli.output import print_titles
    from hsv.cli.progress import flights as flights_bar
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.resilience.campaign import CONTROLLERS, plan
    from hsv.flight.resilience.faults import TRIED
    from hsv.flight.resilience.run import CaseStore, run_resilience
    from hsv.flight.resilience.summary import ResilienceResults, parameter_words
    from hsv.pages.resilience.page import write_results

    if listed:
        print_titles({name: parameter_words(name) for name in TRIED}, json)
        return
    campaign = plan(_names(controllers) or CONTROLLERS, _names(faults) or tuple(TRIED))
    check_folder(out, "out")
    store = CaseStore(out)
    with (
        resumable(store.folder),
        make_executor(workers, scheduler, lambda: errors.print("waiting for the scheduler's workers")) as flying,
        flights_bar("resilience", sum(case.flights for case in campaign.cases)) as progress,
    ):
        flown = run_resilience(campaign, store, flying, expect=announce, progress=progress)
    results = ResilienceResults.read(campaign, store)
    written = write_results(results, out, _command(controllers, faults))
    if json:
        values = {"cases_flown_now": flown.cases, "flown_in_s": flown.wall_time, "expected_s": flown.expected}
        print_json({"written": list(map(str, written)), **values, "cells": _cells(results)})
    else:
        _show(results)
        if flown.cases:
            console.print(f"flown in {flown.wall_time:.0f} s, expected: {flown.expected:.0f} s")
        console.print(f"written {', '.join(map(str, written))}", soft_wrap=True)
    crashes = [flight.crashed for flight in results.flights]
    if all(crashes):
        raise RunError(f"all {len(crashes)} flights crashed, the first: {crashes[0]}")


def _command(controllers: str, faults: str) -> str:
    """Return the command that makes the same campaign, as a shell takes it."""
    options = (("--controllers", controllers), ("--faults", faults))
    return shlex.join(["hsv", "resilience", *(word for option in options if option[1] for word in option)])


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",")) if text else ()


def _show(results: ResilienceResults) -> None:
    names = [subject.name for subject in results.campaign.subjects]
    faults = results.campaign.faults
    cells = [["{} of {}".format(*results.squares[fault, name].survived) for name in names] for fault in faults]
    print_matrix("flights survived", [fault.replace("_", " ") for fault in faults], names, cells)


def _cells(results: ResilienceResults) -> list[dict[str, Any]]:
    from hsv.flight.resilience.faults import TRIED
    from hsv.pages.resilience.page import flight_file

    found = []
    for (fault, controller), square in results.squares.items():
        for moment, cells in square.cells.items():
            ends = square.boundaries[moment]
            values = {
                name: None if end is None else TRIED[fault].value(end)
                for name, end in (("largest_survived", ends.survived), ("least_lost", ends.lost))
            }
            found += [
                {
                    "controller": controller,
                    "fault": fault,
                    "time": moment.name,
                    "severity": cell.severity,
                    "value": cell.flights[0].value,
                    "unit": TRIED[fault].unit,
                    "survived": cell.survived,
                    "flights": len(cell.flights),
                    "attitude_rad": cell.attitude,
                    "altitude_m": cell.altitude,
                    "recovery_time_s": cell.recovery_time,
                    "time_to_loss_s": cell.time_to_loss,
                    "worst_flight": flight_file(cell),
                    **values,
                }
                for cell in cells
            ]
    return found
