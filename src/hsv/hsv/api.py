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
from typing import TYPE_CHECKING

from hsv.base.units import UnitSystem, unit_system
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly as fly_components
from hsv.flight.flight import Flight
from hsv.flight.metrics import METRICS
from hsv.flight.scenario import Scenario
from hsv.flight.scenario import load_scenario as load

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Flight", "Scenario", "compare", "fly", "load", "plot", "sweep"]


def fly(scenario: Scenario | str) -> Flight:
    """Return the flight of a scenario, or of the one with this name or path, in this process.

    Raises:
        ScenarioError: Names the field that is wrong, or what is wrong with the design.
        RunError: A controller of one's own failed; it is named, with the step.
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
    return flight_figure({label: flight.data() for label, flight in shown.items()}, unit_system(units))
