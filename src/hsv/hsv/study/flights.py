"""The flights that the figures show: real runs of the graph, recorded, read back from their bags, and kept."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

from hsv.errors import RecordingError, RunError
from hsv.graph.description import COMPOSED
from hsv.graph.flight import fly_graph
from hsv.graph.launcher import executable
from hsv.graph.preparation import prepare
from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.closed_loop import fly
from hsv.simulation.metrics import FlightData
from hsv.simulation.scenario import load_scenario
from hsv.study.sources import DIGITS, drop_older, flight_digest

Progress = Callable[[str, int, int], None]
"""Called with what is being done, how much of it is done, and how much there is."""


def graph_is_there() -> bool:
    """Tell whether the node processes are built and sourced, so that flights can be runs of the graph."""
    try:
        executable(COMPOSED)
    except RunError:
        return False
    return True


class Flights:
    """Flies scenarios once and keeps what came out under a digest of all it depends on.

    Where the graph is there a flight is a run of its nodes (all in one process: the same bytes as separate ones) and
    is read from its bag. Elsewhere it is flown in process: the same numbers, bit for bit.
    """

    def __init__(self, folder: Path, *, graph: bool, progress: Progress = lambda what, done, total: None) -> None:
        """Keep flights in ``folder``; ``graph``: fly with the nodes."""
        self._folder = folder
        self._graph = graph
        self._progress = progress
        self._flown: dict[str, FlightData] = {}

    def __getitem__(self, scenario: str) -> FlightData:
        """Return the flight of a shipped scenario.

        Raises:
            ScenarioError, DesignError, ParameterError: A wrong scenario or design, named.
            RunError: A node failed.
        """
        if scenario not in self._flown:
            self._flown[scenario] = self._kept(scenario)
        return self._flown[scenario]

    def _kept(self, scenario: str) -> FlightData:
        self._folder.mkdir(parents=True, exist_ok=True)
        target = self._folder / f"{scenario}_{flight_digest(scenario)[:DIGITS]}"
        return self._from_graph(scenario, target) if self._graph else self._from_process(scenario, target)

    def _from_graph(self, scenario: str, bag: Path) -> FlightData:
        from hsv.recording.flight import flight_data
        from hsv.recording.reader import Bag

        if bag.is_dir():
            try:
                recorded = Bag(bag)
                if recorded.complete:
                    return flight_data(recorded)
            except RecordingError:
                pass  # a run that was interrupted: flown again
            shutil.rmtree(bag)
        # Recorded beside its place and moved there when it is whole.
        workplace = Path(mkdtemp(prefix=f".{bag.name}_", dir=self._folder))
        try:
            prepared = prepare(scenario, bag=workplace / bag.name)
            fly_graph(
                prepared,
                composed=True,
                on_step=lambda step: self._progress(f"flying {scenario}", step, prepared.steps),
            )
            self._progress(f"flying {scenario}", prepared.steps, prepared.steps)
            (workplace / bag.name).rename(bag)
            drop_older(bag)
        finally:
            shutil.rmtree(workplace)
        return flight_data(Bag(bag))

    def _from_process(self, scenario: str, target: Path) -> FlightData:
        path = target.with_name(target.name + ".npz")
        if path.is_file():
            with np.load(path) as kept:
                return _unpacked(kept)
        flight = fly(assemble(flight_parameters(load_scenario(scenario)))).data()
        # The stamps of a bag are whole nanoseconds.
        flight = replace(flight, time=np.round(flight.time * 1e9) * 1e-9)
        new = path.with_suffix(".tmp")
        with new.open("wb") as stream:
            np.savez_compressed(stream, **_packed(flight))
        new.rename(path)
        drop_older(path)
        return flight


def _packed(flight: FlightData) -> dict[str, Any]:
    return {**vars(flight), "fault_start": np.nan if flight.fault_start is None else flight.fault_start}


def _unpacked(kept: Any) -> FlightData:
    fault_start = float(kept["fault_start"])
    columns = {name: kept[name] for name in kept if name != "fault_start"}
    return FlightData(**columns, fault_start=None if np.isnan(fault_start) else fault_start)
