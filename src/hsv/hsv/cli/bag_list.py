"""The table of all recorded flights in a folder, for ``hsv list bags``."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from hsv.bags.flight import flight_data, flight_fingerprint
from hsv.bags.info import ending
from hsv.bags.reader import Bag
from hsv.base.errors import HsvError, ParameterError, one_of
from hsv.base.units import UnitSystem
from hsv.cli import output
from hsv.cli.options import check_target, writing
from hsv.flight.limits import in_units, limits_kept, verdicts
from hsv.flight.metrics import METRICS, spaced
from hsv.flight.scenario import parse_scenario


def list_bags(folder: Path, metrics: Sequence[str], target: Path | None, units: UnitSystem, json: bool) -> None:
    """Print a row for each bag in ``folder``, with the values of ``metrics``; write the table, in SI, to ``target``."""
    for name in metrics:
        if name not in METRICS:
            raise ParameterError(f"metric = {name!r}: expected {one_of(METRICS, name)}")
    if not folder.is_dir():
        raise ParameterError(f"folder = {str(folder)!r}: expected a folder with bags")
    if target:
        check_target(target, "csv", ".csv")
    bags = [each for each in sorted(folder.iterdir()) if each.suffix == ".mcap" or any(each.glob("*.mcap*"))]
    rows = [_row(bag, metrics, units) for bag in bags]
    if not rows:
        raise ParameterError(f"folder = {str(folder)!r}: holds no bag")
    if target:
        text = StringIO()
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        with writing(target, "csv"):
            target.write_text(text.getvalue(), encoding="utf-8")
    if json:
        output.print_json({"bags": rows})
        return

    def cell(name: str, value: Any) -> str:
        if value is None:
            return "-"
        if name in METRICS:
            return in_units(name, value, units)
        return f"{value:g}" if name == "time_s" else str(value)

    table = output.new_table(*(spaced(name) for name in rows[0]))
    for row in rows:
        # The table has the beginnings of fingerprint and verdict; JSON and CSV have both whole.
        shown = row | {"fingerprint": (row["fingerprint"] or "-")[:11], "verdict": row["verdict"].partition(":")[0]}
        table.add_row(*(cell(name, value) for name, value in shown.items()))
    output.console.print(table)


def _row(path: Path, metrics: Sequence[str], units: UnitSystem) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(("bag", "scenario", "time_s", "verdict", "fingerprint", *metrics))
    row["bag"] = path.name
    try:
        bag = Bag(path)
        data, name = flight_data(bag), bag.custom_data.get("scenario", "")
        row |= {"scenario": name or "-", "time_s": float(data.time[-1]), "fingerprint": flight_fingerprint(bag)}
        row |= {metric: data.metrics.get(metric) for metric in metrics}
        scenario, finished = parse_scenario(bag.text("scenario.toml"), name), ending(bag) == "finished"
        judged = verdicts(scenario, data.metrics, data.missing, ended=finished)
        row["verdict"] = limits_kept(judged, units) if finished else ending(bag)
    except HsvError as error:
        row["verdict"] = f"{error}"
    return row
