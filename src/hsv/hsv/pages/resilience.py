"""Output of a resilience campaign: an HTML page, a Markdown page, and scenario files of the worst flights."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from hsv.base.units import UnitSystem
from hsv.flight.campaign.run import write_whole, writing
from hsv.flight.resilience.faults import OBSERVED, SEVERITIES, TRIED, Moment
from hsv.flight.resilience.flights import ALTITUDE_BAND, ATTITUDE_BAND
from hsv.flight.resilience.summary import Cell, ResilienceResults, boundaries_in_words, survived
from hsv.flight.scenario import scenario_table
from hsv.pages.engine import render

FLIGHTS = "flights"
"""Name of the folder, next to the page, with the scenarios of the worst flights."""

SECTIONS = {"map": "Map of survival", "controllers": "Controllers", "cells": "Numbers", "repeat": "Repeat a flight"}
"""Headings in the order of the page."""


def write_results(results: ResilienceResults, out: Path, command: str) -> list[Path]:
    """Write index.html, result.md and, in flights/, each cell's worst flight as a scenario; return the pages' paths.

    The pages quote the ``command`` that produces the results. A CampaignError names a file that cannot be written.
    """
    with writing(folder := out / FLIGHTS):
        folder.mkdir(parents=True, exist_ok=True)
    for cell in results.cells:
        write_whole(out / flight_file(cell), flight_text(cell).encode())
    pages = {out / "index.html": "resilience.html.j2", out / "result.md": "resilience.md.j2"}
    for path, template in pages.items():
        write_whole(path, resilience_page(results, template, command).encode())
    return list(pages)


def flight_file(cell: Cell) -> str:
    """Return the path of the scenario of a cell's worst flight, relative to the page."""
    return f"{FLIGHTS}/{cell.case.label}_{cell.severity}.toml"


def flight_text(cell: Cell) -> str:
    """Return the scenario file of a cell's worst flight as text."""
    worst, case = cell.worst, cell.case
    subject, fault = case.subject, TRIED[case.fault]
    table = scenario_table(subject.file(case.moment, worst.vehicle, fault, worst.value), subject.name)
    words = f"{case.fault.replace('_', ' ')} ({fault.parameter.replace('_', ' ')} {fault.values_text(worst.value)})"
    table["title"] = (
        f"{subject.name} with {words} from {subject.start(case.moment):g} s, {vehicle_words(worst.vehicle)}"
    )
    return tomli_w.dumps(table)


def vehicle_words(vehicle: int) -> str:
    """Return the name of a vehicle by its number: 0 is the nominal vehicle, the others are corners."""
    return f"corner {vehicle}" if vehicle else "nominal vehicle"


def sentence(results: ResilienceResults) -> str:
    """Return the verdict: how many flights each controller has survived, best controller first."""
    names = [subject.name for subject in results.campaign.subjects]
    counts = {name: survived([cell for cell in results.cells if cell.case.subject.name == name]) for name in names}
    ranked = sorted(counts.items(), key=lambda item: item[1][0] / item[1][1], reverse=True)
    return "Flights survived: " + ", ".join("{} {} of {}".format(name, *count) for name, count in ranked) + "."


def resilience_page(results: ResilienceResults, template: str, command: str) -> str:
    """Return the page that ``template`` makes of the results, as HTML or Markdown; it quotes the ``command``."""
    finished, flown = survived(results.cells)
    return render(
        template,
        command=command,
        campaign=results.campaign,
        squares=results.squares,
        moments=tuple(Moment),
        severities=SEVERITIES,
        tried=TRIED,
        observed=OBSERVED,
        attitude_band=ATTITUDE_BAND,
        altitude_band=ALTITUDE_BAND,
        units=UnitSystem.metric,
        sections=SECTIONS,
        sentence=sentence(results),
        boundaries_in_words=boundaries_in_words,
        corners=max(len(subject.vehicles) for subject in results.campaign.subjects) - 1,
        flight_file=flight_file,
        vehicle_words=vehicle_words,
        survived=finished,
        flights=flown,
    )
