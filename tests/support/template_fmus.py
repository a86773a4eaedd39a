"""FMUs from FMPy's templates, whose outputs keep their start values, and faulty FMUs."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
from fmpy import read_model_description
from fmpy.container_fmu.cli import create_container_fmu
from fmpy.container_fmu.config import Component, Configuration
from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown
from fmpy.template import create_fmu

Edit = Callable[[str], str]


def template_fmu(
    path: Path, inputs: list[str], outputs: dict[str, float], description: Edit = str, model: Edit = str
) -> None:
    """Write an FMI 3.0 FMU from FMPy's template; the edits change its description and its source."""
    made = ModelDescription()
    made.fmiVersion, made.modelName, made.description, made.generationTool = "3.0", "model", "", "FMPy"
    made.generationDateAndTime, made.instantiationToken = "2026-01-01T00:00:00Z", "template"
    made.coSimulation = CoSimulation(modelIdentifier="model")
    rows = [("time", "independent", None), *((name, "input", "0") for name in inputs)]
    rows += [(name, "output", repr(value)) for name, value in outputs.items()]
    for i, (name, causality, start) in enumerate(rows):
        variable = ModelVariable(
            name=name,
            valueReference=i,
            type="Float64",
            start=start,
            causality=causality,
            variability="continuous",
            description="",
        )
        made.modelVariables.append(variable)
        if causality == "output":
            made.outputs.append(Unknown(variable=variable))
    create_fmu(made, path)
    with zipfile.ZipFile(path) as archive:
        xml, source = (archive.read(name).decode() for name in ("modelDescription.xml", "sources/model.c"))
    code, library = path.with_suffix(".c"), path.with_suffix(".so")
    code.write_text(model(source))
    include = Path(fmpy.__file__).parent / "c-code"
    subprocess.run(["cc", "-O0", "-shared", "-fPIC", f"-I{include}", "-o", library, code], check=True)
    with zipfile.ZipFile(path, "w") as archive:
        exact = xml.replace('causality="output"', 'causality="output" initial="exact"')  # the template lacks it
        archive.writestr("modelDescription.xml", description(exact))
        archive.write(library, "binaries/x86_64-linux/model.so")


def container_fmu(path: Path, inner: Path) -> None:
    """Write an FMI 2.0 FMU that contains ``inner``, with the same inputs and outputs; its binary is FMPy's own."""
    described = read_model_description(str(inner))
    component = Component(inner.stem, inner, described)
    made = ModelDescription()
    made.fmiVersion, made.modelName, made.instantiationToken, made.guid = "2.0", "container", "container", "container"
    made.coSimulation = CoSimulation(modelIdentifier="container_fmu")
    made.coSimulation.fixedInternalStepSize = 0.02
    mappings = {}
    for inside in described.modelVariables:
        exact = "exact" if inside.causality == "output" else None
        outside = ModelVariable(
            name=inside.name,
            valueReference=0,
            type="Real",
            causality=inside.causality,
            variability="continuous",
            start=inside.start,
            initial=exact,
        )
        made.modelVariables.append(outside)
        if inside.causality != "independent":
            mappings[outside] = [(component, inside)]
        if exact:
            made.outputs.append(Unknown(variable=outside))
    folder = path.with_suffix("")
    folder.mkdir()
    create_container_fmu(Configuration(False, made, [component], [], mappings), folder, path)
