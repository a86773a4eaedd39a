"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.base.units import UnitSystem

BagArgument = Annotated[Path, typer.Argument(help="Bag directory, or its .mcap file.")]
DesignArgument = Annotated[
    str,
    typer.Argument(
        help="Parameter file of a design, with its certificate in the same folder, or the name of a shipped design."
    ),
]
ScenarioArgument = Annotated[str, typer.Argument(help="Name of a shipped scenario, or path of a TOML file.")]

FlightsOption = Annotated[Path, typer.Option(help="Folder in which the study's flights are stored and reused.")]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite existing files.")]
GraphNamespaceOption = Annotated[
    str, typer.Option("--namespace", help="ROS namespace of the graph, such as /veh1; default: none.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, with the unit in every key.")]
ListJsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, with a unit for every number.")]
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
UnitsOption = Annotated[
    UnitSystem, typer.Option(help="Units: SI with degrees and percent, strict SI, or the paper's ft, ft/s, deg.")
]
