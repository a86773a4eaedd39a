"""Functions for notebooks and scripts: load a scenario, change it, fly it, measure, plot.

All of them are also names of the package :mod:`hsv`::

    import hsv

    case = hsv.load("case1", {"vehicle.perturbation.mass": "+5 %"})
    flight = hsv.fly(case)
    flight.metrics["altitude_settling_time"]
    hsv.plot(flight)
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, cast, overload

from hsv import __all__ as __all__
from hsv.base.errors import ParameterError, require
from hsv.base.units import UnitSystem, unit_system
from hsv.control.linear_model import LinearModel as LinearModel
from hsv.control.linear_model import linearise as linearise
from hsv.flight.assembly import assemble_flight
from hsv.flight.campaign.variants import fly_variants
from hsv.flight.closed_loop import fly as fly_components
from hsv.flight.flight import Flight
from hsv.flight.margins import loop as loop
from hsv.flight.metrics import METRICS
from hsv.flight.scenario import Scenario
from hsv.flight.scenario import load_scenario as load
from hsv.model.trim import Trim, trim_at
from hsv.model.vehicle import DEFAULT_VEHICLE, load_vehicle

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def fly(scenario: Scenario | str) -> Flight:
    """Simulate a scenario, given as an object, a name or a path, in this process.

    Raises:
        ScenarioError: A field or the design is wrong; the message names it.
        RunError: A custom controller failed; the message names it, and the step if known.
    """
    require("scenario", scenario, (str, Scenario), "a scenario of hsv.load, its name, or its path as text")
    return fly_components(assemble_flight(load(scenario) if isinstance(scenario, str) else scenario))


def sweep(
    name: str, field: str, values: Iterable[object], changes: Mapping[str, object] | None = None
) -> Iterator[tuple[object, Flight]]:
    """Simulate a scenario with one field set to each of ``values``; yield each value with its flight.

    ``dict(hsv.sweep(...))`` keeps all flights, of 2.5 MB each for 200 s. The flights are simulated side by side where
    possible.

    Args:
        name: Name of a shipped scenario, or path.
        field: Field that varies, as in a scenario file, for example ``"fault[0].effectiveness"``.
        values: Values as written in a scenario file, with their units.
        changes: Values of further fields, the same in every flight.

    Raises:
        ScenarioError: A field or the design is wrong; the message names it.
        RunError: A custom controller failed.
    """
    require("scenario", name, str, "a name, or a path as text")
    require("field", field, str, 'a field as text, such as "seed"')
    require("values", values, Iterable, "a list of values")
    given = [*values]
    scenarios = (load(name, {**(changes or {}), field: value}) for value in given)
    return zip(given, fly_variants(scenarios), strict=True)


@overload
def compare(runs: Mapping[str, Flight]) -> dict[str, dict[str, float]]: ...


@overload
def compare(runs: Mapping[str, DataFrame], metrics: Sequence[str] = ()) -> DataFrame: ...


def compare(runs: Mapping[str, Flight] | Mapping[str, DataFrame], metrics: Sequence[str] = ()) -> Any:
    """Compare several flights, or several campaigns.

    Args:
        runs: Flights by label, or campaigns of :func:`montecarlo` or :func:`read_campaign` by label.
        metrics: Metrics that are compared between campaigns; empty: those with limits.

    Returns:
        Of flights, the metrics (SI) by name and then by label; a metric that a flight does not define, for example
        because there is no fault, is missing for this flight. Of campaigns, the table of ``hsv compare``, see
        :func:`hsv.flight.campaign.comparison.compare_campaigns`.

    Raises:
        CampaignError: The campaigns cannot be compared; the message says why.
    """
    if isinstance(runs, Mapping) and any(hasattr(run, "columns") for run in runs.values()):
        from hsv.flight.campaign.comparison import compare_campaigns

        return compare_campaigns(cast("Mapping[str, DataFrame]", runs), metrics)
    flights = cast("Mapping[str, Flight]", runs)
    _require_flights(flights)
    measured = {label: flight.metrics for label, flight in flights.items()}
    rows = {name: {label: m[name] for label, m in measured.items() if name in m} for name in METRICS}
    return {name: row for name, row in rows.items() if row}


def montecarlo(
    scenario: Scenario | str,
    samples: int = 1000,
    *,
    seed: int = 1,
    sampling: str = "uniform",
    corners: bool = False,
    scale: float = 1.0,
    factor: Mapping[str, Sequence[object]] | None = None,
    workers: int = 1,
) -> DataFrame:
    """Fly a campaign; return a table with one row per flight: varied values, outcome, metrics and fingerprint.

    The arguments are the options of ``hsv montecarlo``. The table is that of :func:`read_campaign`. A script that uses
    several workers must call this function under ``if __name__ == "__main__"``.

    Args:
        scenario: A scenario of :func:`load`, the name of a shipped scenario, or a path.
        samples: Number of flights, for each point of a grid; a power of two for ``sobol``, ignored for corners.
        seed: Seed from which all samples and the noise are drawn: the same seed, the same vehicles and noise.
        sampling: ``uniform``, ``latin_hypercube`` or ``sobol``.
        corners: Whether to fly all combinations of extreme values.
        scale: Factor on the bounds of the vehicle's uncertain parameters; with 0 these bounds are not used.
        factor: Values of further fields by name, as in a scenario file: a pair of the least and the largest value, or
            a list with the values of a grid. A pair is a tuple.
        workers: Number of processes: 1 to fly in this process, 0 for one per processor.

    Raises:
        CampaignError, ScenarioError, DesignError: A setting is wrong; the message names it.
    """
    from hsv.flight.campaign.campaign import plan
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.run import run_campaign
    from hsv.flight.campaign.store import ResultStore
    from hsv.flight.campaign.summary import Results

    method = "corners" if corners else sampling
    campaign = plan(scenario, method=method, samples=samples, seed=seed, scale=scale, factors=factor)
    with TemporaryDirectory() as folder, make_executor(workers) as executor:
        path = Path(folder, "campaign.parquet")
        run_campaign(campaign, ResultStore(path, campaign), executor)
        return Results(path).frame()


def read_campaign(path: Path | str) -> DataFrame:
    """Return the result file of a campaign as a table with one row per flight, without running code that it names.

    ``attrs["units"]`` has the SI unit of each column, ``attrs["limits"]`` the limits (SI) of its metrics, and
    ``attrs["vehicles"]`` the number of flights at each point of the grid. The columns are described in
    docs/montecarlo.md.

    Raises:
        CampaignError: The file is missing, damaged, not the result of a campaign, or of an unknown format.
    """
    from hsv.flight.campaign.summary import Results

    require("path", path, (str, Path), "the path of a result file")
    return Results(Path(path)).frame()


def trim(
    altitude: float | str = "",
    velocity: float | str = "",
    climb_rate: float | str = 0.0,
    acceleration: float | str = 0.0,
    *,
    vehicle: str = "",
    coupling: str = "",
) -> Trim:
    """Return the equilibrium at an altitude and a velocity: level, or climbing and accelerating.

    Each of the first four arguments is a number in SI units or a text with a unit, such as ``"85500 ft"``. The states
    and inputs of the result are in its ``quantities``, by name, with their SI units.

    Args:
        altitude: Altitude (m); empty: as in the published trim, or the middle of the envelope if that trim is outside.
        velocity: Velocity (m/s); empty: likewise from the published trim or the middle of the envelope.
        climb_rate: Climb rate (m/s).
        acceleration: Acceleration (m/s^2).
        vehicle: Name of a shipped vehicle, or path; empty: the paper's vehicle.
        coupling: Name of a set of inertial coupling, or a multiple of ``derived``; empty: the vehicle's first set.

    Raises:
        QuantityError, VehicleError: An argument is wrong; the message names it.
        TrimError: There is no equilibrium, or only one outside the input limits.
    """
    described = load_vehicle(vehicle or DEFAULT_VEHICLE)
    return trim_at(described.coupled(coupling), *described.condition(altitude, velocity), climb_rate, acceleration)


def plot(
    flights: Flight | Mapping[str, Flight],
    *,
    units: str = UnitSystem.metric,
    panels: Sequence[str] = (),
    start: str = "",
    end: str = "",
    size: str = "",
) -> Figure:
    """Return a figure of one or several flights: the paper's eight plots over time, or six if all vehicles are rigid.

    Only the first flight's reference is drawn, dotted, and its time from the first fault on is shaded.

    Args:
        flights: One flight, or several by label.
        units: ``metric`` (SI with degrees), ``si`` or ``paper`` (feet and degrees).
        panels: Names of states and inputs to plot, or their beginnings; empty: the paper's panels.
        start: First time to plot, with unit; empty: from the start.
        end: Last time to plot, with unit; empty: to the end.
        size: Width and height, such as ``85x60mm``; empty: as large as the panels need.

    Raises:
        QuantityError: ``units`` is none of these, or a time cannot be read.
        ParameterError: A panel is unknown, the window is empty, or the size is none; the message names it.
    """
    # Imported here, because the import takes a second, and not every script plots.
    from hsv.pages.plots import Layout, flight_figure

    shown = {"flight": flights} if isinstance(flights, Flight) else flights
    _require_flights(shown)
    return flight_figure(shown, unit_system(units), layout=Layout.of(panels, start, end, size))


def _require_flights(flights: object) -> None:
    """Raise a ParameterError unless ``flights`` is a mapping with at least one flight, and with nothing else."""
    require("flights", flights, Mapping, "flights by label")
    assert isinstance(flights, Mapping)
    if not flights:
        raise ParameterError("flights = {}: expected at least one flight")
    for label, flight in flights.items():
        require(f"flights[{label!r}]", flight, Flight, "a flight of hsv.fly")
