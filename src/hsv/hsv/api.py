"""The library in five lines, for notebooks and scripts: load a scenario, change it, fly it, measure, draw.

Everything here is a name of the package itself::

    import hsv

    case = hsv.load("case1", {"vehicle.perturbation.mass": "+5 %"})
    flight = hsv.fly(case)
    flight.metrics["altitude_settling_time"]
    hsv.plot(flight)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from hsv import __all__ as __all__
from hsv.base.units import UnitSystem, unit_system
from hsv.control.linear_model import LinearModel as LinearModel
from hsv.control.linear_model import linearise as linearise
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly as fly_components
from hsv.flight.flight import Flight
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
        ScenarioError: Names the field that is wrong, or what is wrong with the design.
        RunError: A custom controller failed; the message names it and the step.
    """
    return fly_components(assemble_flight(load(scenario) if isinstance(scenario, str) else scenario))


def sweep(
    name: str, field: str, values: Iterable[object], changes: Mapping[str, object] | None = None
) -> dict[object, Flight]:
    """Return the flights of a scenario with one field at each of ``values``, by value.

    Args:
        name: Name of a shipped scenario, or path.
        field: Field that varies, as in a scenario file, for example ``"fault[0].effectiveness"``.
        values: Values as written in a scenario file, with their units.
        changes: Further fields that differ from the file, the same in every flight.

    Raises:
        ScenarioError, RunError: As :func:`fly`.
    """
    return {value: fly(load(name, {**(changes or {}), field: value})) for value in values}


def compare(flights: Mapping[str, Flight]) -> dict[str, dict[str, float]]:
    """Return the metrics of flights side by side, SI: by metric, then by the label of the flight.

    A flight that does not define a metric (no step, no fault) is not in its row, nor is a row without any.
    """
    measured = {label: flight.metrics for label, flight in flights.items()}
    rows = {name: {label: m[name] for label, m in measured.items() if name in m} for name in METRICS}
    return {name: row for name, row in rows.items() if row}


def montecarlo(
    scenario: str,
    samples: int = 1000,
    *,
    seed: int = 1,
    method: str = "uniform",
    scale: float = 1.0,
    factors: Mapping[str, tuple[object, object]] | None = None,
    workers: int = 1,
) -> DataFrame:
    """Return the flights of a campaign as a table: a row per flight with its sample, end, metrics and fingerprint.

    The units (SI) of its columns are in ``attrs["units"]``. A script that uses several workers must call this under
    ``if __name__ == "__main__"``.

    Args:
        scenario: Name of a shipped scenario, or path.
        samples: Number of flights; not used for corners.
        seed: Determines all samples.
        method: ``uniform``, ``latin_hypercube``, ``sobol`` or ``corners`` (all combinations of extreme values).
        scale: Factor on the bounds of the uncertain parameters; 0 leaves them alone.
        factors: Least and largest value, as a file has them, by field of the scenario.
        workers: Processes; 1: this process, 0: one per processor.

    Raises:
        CampaignError, ScenarioError, DesignError: Names the setting that is wrong.
    """
    from hsv.flight.campaign.campaign import plan
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.run import run_campaign
    from hsv.flight.campaign.store import ResultStore
    from hsv.flight.campaign.summary import Results

    campaign = plan(scenario, method=method, samples=samples, seed=seed, scale=scale, factors=factors)
    with TemporaryDirectory() as folder, make_executor(workers) as executor:
        path = Path(folder, "campaign.parquet")
        run_campaign(campaign, ResultStore(path, campaign), executor)
        return Results(path).frame()


def trim(
    altitude: float | str = "",
    velocity: float | str = "",
    climb_rate: float | str = 0.0,
    acceleration: float | str = 0.0,
    *,
    vehicle: str = "",
    coupling: str = "",
) -> Trim:
    """Return the equilibrium at a condition of numbers (SI) or of texts with units, such as ``"85500 ft"``.

    Its ``quantities`` are state and input by name, with their units.

    Args:
        altitude: m, or a text with its unit; empty: the published one, or the middle of the vehicle's envelope.
        velocity: m/s, or a text with its unit; likewise.
        climb_rate: m/s, or a text with its unit.
        acceleration: m/s^2, or a text with its unit.
        vehicle: Name or path; empty: the paper's.
        coupling: Set of inertial coupling, or a multiple of the derived one; empty: the vehicle's own.

    Raises:
        QuantityError, TrimError, VehicleError: Names the argument that is wrong, or says that nothing balances there.
    """
    described = load_vehicle(vehicle or DEFAULT_VEHICLE)
    return trim_at(described.coupled(coupling), *described.condition(altitude, velocity), climb_rate, acceleration)


def plot(flights: Flight | Mapping[str, Flight], *, units: str = UnitSystem.metric) -> Figure:
    """Return the paper's eight panels over time, of one flight or of several by label.

    Dotted is the reference, shaded what follows the first fault.

    Args:
        flights: One, or several by label.
        units: ``metric`` (SI with degrees), ``si`` or ``paper`` (feet and degrees).

    Raises:
        QuantityError: ``units`` are none of these.
    """
    # Drawing takes a second to import, and a script may do without.
    from hsv.pages.plots import flight_figure

    shown = {"flight": flights} if isinstance(flights, Flight) else flights
    return flight_figure(shown, unit_system(units))
