"""The flights that the figures show: real runs of the graph, recorded, read back from their bags, and kept."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from hsv.bags.description import COMPOSED
from hsv.base.errors import RecordingError, RunError
from hsv.base.processes import Progress
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.metrics import FlightData
from hsv.flight.scenario import load_scenario
from hsv.flight.sources import DIGITS, drop_older, flight_digest
from hsv.graph.flight import fly_graph
from hsv.graph.launcher import executable
from hsv.graph.preparation import RunOptions, prepare


def graph_is_there() -> bool:
    """Tell whether the node processes are built and sourced, so that flights can be runs of the graph."""
    try:
        executable(COMPOSED)
    except RunError:
        return False
    return True


class Flights:
    """Flies scenarios once, by the nodes or in this process: the same numbers, bit for bit.

    A run of the graph takes its time: its bag is kept under a digest of all it depends on, and found again by it. All
    nodes run in one process, which gives the same bytes as separate ones. A flight in this process takes a moment, and
    is flown whenever it is asked for.
    """

    def __init__(self, folder: Path, *, graph: bool, progress: Progress = lambda what, done, total: None) -> None:
        """Keep bags in ``folder``; ``graph``: fly with the nodes."""
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
            self._flown[scenario] = self._from_graph(scenario) if self._graph else _in_process(scenario)
        return self._flown[scenario]

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
                pass  # a run that was interrupted: flown again
            shutil.rmtree(bag)
        # Recorded beside its place and moved there when it is whole.
        workplace = Path(mkdtemp(prefix=f".{bag.name}_", dir=self._folder))
        try:
            prepared = prepare(scenario, RunOptions(composed=True), bag=workplace / bag.name)
            fly_graph(
                prepared,
                on_step=lambda step: self._progress(f"flying {scenario}", step, prepared.steps),
            )
            self._progress(f"flying {scenario}", prepared.steps, prepared.steps)
            (workplace / bag.name).rename(bag)
            drop_older(bag)
        finally:
            shutil.rmtree(workplace)
        return flight_data(Bag(bag))


def _in_process(scenario: str) -> FlightData:
    flight = fly(assemble(flight_parameters(load_scenario(scenario)))).data()
    # The stamps of a bag are whole nanoseconds.
    return replace(flight, time=np.round(flight.time * 1e9) * 1e-9)
