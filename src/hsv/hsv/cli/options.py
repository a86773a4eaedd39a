"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from hsv.base.units import UnitSystem

BagArgument = Annotated[Path, Argument(help="Bag directory, or its .mcap file.")]
DesignArgument = Annotated[
    str, Argument(help="Design: a parameter file with its certificate next to it, or a shipped name.")
]
ScenarioArgument = Annotated[str, Argument(help="Name of a shipped scenario, or path of a TOML file.")]

ForceOption = Annotated[bool, Option("--force", help="Overwrite existing files.")]
GraphNamespaceOption = Annotated[str, Option("--namespace", help="Namespace of the graph, such as /veh1.")]
JsonOption = Annotated[bool, Option("--json", help="Print JSON, with the unit in every key.")]
ListJsonOption = Annotated[bool, Option("--json", help="Print JSON, with a unit for every number.")]
SuppliedDesignOption = Annotated[Path | None, Option("--design", help="Design of a bag without attachments.")]
SuppliedScenarioOption = Annotated[str | None, Option("--scenario", help="Scenario of a bag without attachments.")]
TrustOption = Annotated[bool, Option("--trust", help="Run code that the file names, such as controllers.")]
UnitsOption = Annotated[
    UnitSystem, Option(help="SI with degrees and percent, strict SI, or the paper's ft, ft/s, deg.")
]
