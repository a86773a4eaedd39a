"""The flights of the paper's study, flown once and kept: single ones, and those of many vehicles with their measures.

Everything that is kept carries a digest of all it depends on in its name.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

from hsv.bags.description import COMPOSED
from hsv.base.errors import RecordingError, RunError
from hsv.base.processes import Progress
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.corners import Corner
from hsv.flight.flight import Flight
from hsv.flight.metrics import FlightData, flight_metrics
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import TubeLevels, fly_perturbed
from hsv.flight.sources import DIGITS, code_digest, digest_of, drop_older, flight_digest, kept, measuring_code
from hsv.graph.flight import fly_graph
from hsv.graph.launcher import executable
from hsv.graph.preparation import RunOptions, prepare
from hsv.model.plant import FlightStatus
from hsv_paper.designs import design

Table = dict[str, np.ndarray]
"""Columns (flights) by measure, the nominal vehicle first; NaN where a flight does not define the measure."""

AFTER = 20.0
"""Seconds after the fault over which errors are averaged."""

RINGING = (10.0, 20.0)
"""Seconds after the fault between which only vibration remains."""

SETTLED = 0.05
"""Share of its largest distance from its last value within which an angle or the pitch rate counts as settled."""

LAST = 1.0
"""Seconds before the end, several periods of both modes: a rate above its decay level then has not decayed."""


@dataclass(frozen=True)
class Point:
    """Flat parameters of a flight, and the vehicles that fly it: relative changes of parameters, nominal first."""

    values: Mapping[str, Any]
    over: Sequence[Corner]


class Flights:
    """Flies scenarios once, as runs of the graph or in this process: the numbers are the same, bit for bit.

    A run of the graph takes its time, so its bag is kept. All nodes run in one process, which gives the same bytes as
    separate processes.
    """

    def __init__(
        self, folder: Path, progress: Progress = lambda what, done, total: None, *, graph: bool = False
    ) -> None:
        """Keep bags and tables in ``folder``; ``graph``: fly single flights with the nodes."""
        self._folder = folder
        self._graph = graph
        self._progress = progress
        self._flown: dict[str, FlightData] = {}

    def __getitem__(self, scenario: str) -> FlightData:
        """Return the flight of a shipped scenario.

        Raises:
            ScenarioError, DesignError, ParameterError: A scenario or design is wrong; the message names it.
            RunError: A node failed.
        """
        if scenario not in self._flown:
            self._flown[scenario] = self._from_graph(scenario) if self._graph else in_process(scenario)
        return self._flown[scenario]

    def tables(self, name: str, points: Sequence[Point], *, keep: bool = True) -> list[Table]:
        """Return the measures of all flights at each point of a sweep, flown once.

        Args:
            name: Name of the sweep, in progress and file name.
            points: What is flown.
            keep: Keep the tables; not where flights depend on code outside this library.
        """

        def flown() -> list[Table]:
            total, done, found = sum(len(point.over) for point in points), 0, []
            for point in points:
                found.append(fly_over(point, lambda n, before=done: self._progress(name, before + n, total)))
                done += len(point.over)
            return found

        if not keep:
            return flown()
        asked = [[dict(point.values), [dict(corner) for corner in point.over]] for point in points]
        text = json.dumps([asked, _half_width()], sort_keys=True, default=np.ndarray.tolist)
        digest = digest_of([text.encode(), code_digest().encode(), *measuring_code(__name__)])
        path = self._folder / f"{name.replace(' ', '_')}_{digest[:DIGITS]}.npz"
        return kept(path, flown, _save, _load)

    def _from_graph(self, scenario: str) -> FlightData:
        from hsv.bags.flight import flight_data
        from hsv.bags.reader import Bag

        self._folder.mkdir(parents=True, exist_ok=True)
        bag = self._folder / f"{scenario}_{flight_digest(scenario, graph=True)[:DIGITS]}"
        if bag.is_dir():
            try:
                recorded = Bag(bag)
                if recorded.complete:
                    return flight_data(recorded)
            except RecordingError:
                pass  # an interrupted run is flown again
            shutil.rmtree(bag)
        # Recorded in a temporary folder and moved when it is complete.
        workplace = Path(mkdtemp(prefix=f".{bag.name}_", dir=self._folder))
        try:
            prepared = prepare(scenario, RunOptions(composed=True), bag=workplace / bag.name)
            fly_graph(prepared, on_step=lambda step: self._progress(f"flying {scenario}", step, prepared.steps))
            (workplace / bag.name).rename(bag)
            drop_older(bag)
        finally:
            shutil.rmtree(workplace)
        return flight_data(Bag(bag))


def graph_is_there() -> bool:
    """Return whether the node processes are built and sourced, so that flights can be runs of the graph."""
    try:
        executable(COMPOSED)
    except RunError:
        return False
    return True


def in_process(scenario: str) -> FlightData:
    """Return the flight of a shipped scenario, computed in this process."""
    flight = fly(assemble(flight_parameters(load_scenario(scenario)))).data()
    # The stamps of a bag are integer nanoseconds.
    return replace(flight, time=np.round(flight.time * 1e9) * 1e-9)


def fly_over(point: Point, progress: Any = lambda done: None) -> Table:
    """Return the measures of the flights of all vehicles of a point, flown in as many threads as processors."""
    parts = assemble(dict(point.values))
    levels = TubeLevels(parts)

    def measures(corner: Corner, flight: Flight) -> dict[str, float]:
        data = flight.data()
        level = levels.worst(data)
        return {
            "diverged": float(flight.status is FlightStatus.DIVERGED),
            "end_time": float(data.time[-1]),
            **({} if level is None else {"tube_level": level}),
            **flight_measures(data),
        }

    rows = fly_perturbed(parts, point.over, measures, progress)
    names = list(dict.fromkeys(name for row in rows for name in row))
    return {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}


def flight_measures(flight: FlightData) -> dict[str, float]:
    """Return the metrics of a flight with those of the study (SI); undefined ones are omitted.

    Errors of different rigid-body states are compared relative to the half-widths of the baseline's invariant set.
    """
    values = flight_metrics(flight)
    deviation = np.abs(flight.state - flight.reference)
    values["attitude_from_reference"] = float(deviation[:, 2:4].max())
    if flight.fault_start is None or flight.time[-1] < flight.fault_start + AFTER:
        return values
    since = flight.time - flight.fault_start
    after, window = since >= 0.0, (since >= 0.0) & (since <= AFTER)
    ringing = (since >= RINGING[0]) & (since <= RINGING[1])
    error = (flight.state - flight.reference - flight.deviation)[window, :5]
    values["post_fault_altitude_error"] = float(deviation[after, 0].max())
    values["rigid_error"] = float(np.sqrt(np.mean((error / _half_width()) ** 2)))
    values["pitch_rate_error"] = float(np.sqrt(np.mean(error[:, 4] ** 2)))
    values["pitch_rate_ringing"] = float(np.ptp(flight.state[ringing, 4]))
    for mode, column in ((1, 5), (2, 7)):
        values[f"elastic_coordinate_{mode}_span"] = float(np.ptp(flight.state[after, column]))
        values[f"elastic_rate_{mode}_span"] = float(np.ptp(flight.state[after, column + 1]))
        values[f"elastic_rate_{mode}_ringing"] = float(np.ptp(flight.state[ringing, column + 1]))
    values["attitude_settling_time"] = _settling_time(since[after], flight.state[after, 2:4])
    values["pitch_rate_settling_time"] = _settling_time(since[after], flight.state[after, 4:5])
    for name in ("elastic_rate_1", "elastic_rate_2", "elastic"):
        decay = values[f"{name}_decay_time"]
        values[f"{name}_settling_time"] = decay if decay < since[-1] - LAST else np.inf
    return values


def _half_width() -> np.ndarray:
    tube = design("baseline").tube
    assert tube is not None
    return tube.half_width[:5]


def _settling_time(time: np.ndarray, states: np.ndarray) -> float:
    """Return the last time (n) at which one of the states (n, m) is not within :data:`SETTLED` of its last value."""
    distance = np.abs(states - states[-1])
    moving = np.flatnonzero(np.any(distance > SETTLED * distance.max(axis=0), axis=1))
    return float(time[moving[-1]]) if len(moving) else 0.0


def _save(path: Path, tables: list[Table]) -> None:
    columns = {f"{i} {name}": column for i, table in enumerate(tables) for name, column in table.items()}
    np.savez_compressed(path, **columns)  # type: ignore[arg-type]


def _load(path: Path) -> list[Table]:
    tables: dict[int, Table] = {}
    with np.load(path) as columns:
        for key in columns:
            number, _, name = key.partition(" ")
            tables.setdefault(int(number), {})[name] = columns[key]
    return [tables[i] for i in sorted(tables)]
