"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.base.errors import ParameterError
from hsv.base.units import UnitSystem

GraphNamespaceOption = Annotated[
    str, typer.Option("--namespace", help="ROS namespace of the graph, such as /veh1; default: none.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, with the unit in every key.")]
ListJsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, with a unit for every number.")]
UnitsOption = Annotated[
    UnitSystem, typer.Option(help="Units: SI with degrees and percent, strict SI, or the paper's ft, ft/s, deg.")
]
AltitudeOption = Annotated[str, typer.Option(help="Altitude with unit, e.g. '85000 ft'.")]
VelocityOption = Annotated[str, typer.Option(help="Velocity with unit, e.g. '7900 ft/s'.")]
CouplingOption = Annotated[
    str,
    typer.Option(
        help="Inertial coupling: a set of the vehicle, by default its first, or a multiple of derived, as 0.65."
    ),
]
VehicleOption = Annotated[
    str, typer.Option(help="Name of a vehicle (hsv vehicles), or path of a TOML file; default: the paper's.")
]
ScenarioArgument = Annotated[str, typer.Argument(help="Name of a shipped scenario, or path of a TOML file.")]
RealTimeFactorOption = Annotated[
    float | None,
    typer.Option(help="Pace: 1 is real time, 0 as fast as possible; default: 0, with --live 1.", show_default=False),
]
LiveOption = Annotated[
    bool, typer.Option("--live", help="Show the flight live, on a page in the browser and in Foxglove.")
]
LivePortOption = Annotated[
    int | None,
    typer.Option(
        help="Port for Foxglove, with --live; the page has the next one. 0: any two that are free; default: 8765.",
        show_default=False,
    ),
]
StepTimeoutOption = Annotated[
    float | None,
    typer.Option(help="Wall time (s) after which a silent node ends the run; default: 10, beside a foreign node 2.5."),
]
NewBagOption = Annotated[Path | None, typer.Option("--bag", help="Bag to write; default: bags/<scenario>_<UTC>.")]
ComposedOption = Annotated[bool, typer.Option("--composed", help="All nodes in one process: faster, same bytes.")]
ExternalOption = Annotated[bool, typer.Option("--external", help="Wait for a controller node that you start by hand.")]
NamespaceOption = Annotated[
    str, typer.Option(help="ROS namespace of all nodes and topics, such as /veh1: several graphs fly in one domain.")
]
ReportOption = Annotated[bool, typer.Option(help="Write the report into the bag's folder.")]
BagArgument = Annotated[Path, typer.Argument(help="Bag directory, or its .mcap file.")]
SuppliedDesignOption = Annotated[
    Path | None, typer.Option("--design", help="Design YAML file of the flight, for a bag without attachments.")
]
SuppliedScenarioOption = Annotated[
    str | None,
    typer.Option("--scenario", help="Scenario (name or TOML file) of the flight, for a bag without attachments."),
]
TrustOption = Annotated[
    bool, typer.Option("--trust", help="Allow running code that the file names, such as a controller class.")
]
FlightsOption = Annotated[Path, typer.Option(help="Folder in which the study's flights are stored and reused.")]
WorkersOption = Annotated[
    int, typer.Option(help="Number of processes on this machine; 0: one per processor, 1: fly in this process.")
]
SchedulerOption = Annotated[str, typer.Option(help="Address of a Dask scheduler whose workers are used instead.")]


def live_port_of(live: bool, port: int | None) -> int | None:
    """Return the port of the live view, ``None`` where there is none.

    Raises:
        ParameterError: A port is given for no live view.
    """
    if port is not None and not live:
        raise ParameterError(f"live-port = {port}: expected with --live only")
    return (8765 if port is None else port) if live else None
