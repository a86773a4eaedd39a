"""Replay of a single flight of a campaign, in this process or by the graph of node processes over DDS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hsv.bags.description import TUBE_STATUS
from hsv.base.errors import CampaignError, ControllerError
from hsv.control.design_file import find_design, read_parameters
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.flight.assembly import require_path_inside
from hsv.flight.campaign.sample_runner import Outcome, outcomes_of
from hsv.flight.campaign.summary import Results


@dataclass(frozen=True)
class ReplayedFlight:
    """A replayed flight: its outcomes in the campaign and in the replay (SI), and the bag of a replay over DDS."""

    flight: int
    recorded: Outcome
    repeated: Outcome
    bag: Path | None = None

    @property
    def differing(self) -> list[str]:
        """Names of the outcomes that are not equal, without tolerance; two NaN are equal."""
        return [name for name in self.recorded if not _same(self.recorded[name], self.repeated.get(name))]


def replay_in_process(results: Results, flight: int) -> ReplayedFlight:
    """Repeat a flight of a campaign, given by its number, in this process with the design stored in the results.

    Raises:
        CampaignError: There is no such flight.
        ParameterError: The results name code to load, but are not trusted.
    """
    row, runner = results.row(flight), results.sample_runner
    try:
        flown = runner.fly(flight, [*results.sample(flight).values()])
        repeated = runner.outcome((flown, runner.tube_level(flown)))
    except ControllerError as error:
        repeated = runner.outcome(error)
    return ReplayedFlight(flight, _outcome(row, results), repeated)


def replay_over_dds(
    results: Results, flight: int, bag: Path, progress: Callable[[int, int], None] = lambda step, steps: None
) -> ReplayedFlight:
    """Repeat a flight of a campaign, given by its number, with the node processes; record it to a new directory.

    ``progress`` is called with the step reached and the last step.

    Raises:
        CampaignError, DesignError: There is no such flight, or the design file has changed since or is missing.
        ParameterError: The results name code or a design in another folder, but are not trusted.
        RecordingError: ``bag`` exists already or cannot be made.
        RunError: A process failed; its last error line is in the message.
    """
    from hsv.bags.flight import equipment_topics, flight_data, flight_fingerprint, measurement_errors
    from hsv.bags.reader import Bag
    from hsv.bags.steps import joined
    from hsv.graph.flight import fly_graph
    from hsv.graph.preparation import prepare

    row, runner = results.row(flight), results.sample_runner
    require_design(results)
    prepared = prepare(f"{results.campaign.scenario_name}_flight_{flight}", text=results.file(flight), bag=bag)
    fly_graph(prepared, on_step=lambda step: progress(step, prepared.steps))
    recorded = Bag(bag)
    data = flight_data(recorded)
    # Stamps are rounded to nanoseconds, the campaign's times are not: integrals over time would differ in the last bit.
    data = replace(data, time=np.arange(len(data.time)) * runner.period)
    fingerprint = flight_fingerprint(recorded)
    repeated = runner.measured(data, runner.tube_level(data), fingerprint)
    exact = not (
        measurement_errors(joined(recorded, equipment_topics(recorded)))
        or prepared.scenario.settings.get(ESTIMATOR_ENABLED.name)
    )
    if repeated["tube_level"] is not None and exact:
        # The level that the controller published. It belongs to the state that the controller receives, which is the
        # true state of the campaign only without measurement errors and without an estimator.
        repeated["tube_level"] = float(np.max(recorded.columns(TUBE_STATUS)["level"]))
    return ReplayedFlight(flight, _outcome(row, results), repeated, bag)


def require_design(results: Results) -> None:
    """Refuse results if the file of their design no longer holds the design that the campaign flew.

    Raises:
        CampaignError, DesignError: The file holds another design, or is missing.
        ParameterError: The results name a design in another folder, but are not trusted.
    """
    name = results.campaign.scenario.design
    if not name:
        return
    require_path_inside(name, "design", results.path, results.trust)
    if read_parameters(find_design(name)) != results.campaign.design:
        raise CampaignError(
            f"design {name!r}: not the one that the campaign flew, which hsv montecarlo scenario --design writes"
        )


def _outcome(row: dict[str, Any], results: Results) -> Outcome:
    outcomes = outcomes_of(results.campaign.scenario)
    return {name: row[name] for name in ("diverged", "crashed", *outcomes, "not_reached", "fingerprint") if name in row}


def _same(a: float | bool | str | None, b: float | bool | str | None) -> bool:
    return a == b or (isinstance(a, float) and isinstance(b, float) and math.isnan(a) and math.isnan(b))
