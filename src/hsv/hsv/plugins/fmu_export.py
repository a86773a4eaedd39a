"""Export of blocks as FMUs for co-simulation (FMI 3.0), with sources and a binary for Linux on x86-64."""

from __future__ import annotations

import hashlib
import platform
import re
import subprocess
import uuid
import zipfile
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.units import base_units
from hsv.model.signals import SIGNALS, SignalType, numbers_of
from hsv.plugins.library import load_block
from hsv.plugins.library_answers import CBlock

_SOURCE = "fmu.c"
_HEADER = "fmu_block.h"
_FLAGS = ("-std=gnu99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-shared", "-fPIC")


class ExportedBlock(NamedTuple):
    """A block to export: its symbol, which is also the name of the FMU, and the texts of its sources by file name."""

    symbol: str
    description: str
    source: str
    """Name of the source file that defines the block"""
    texts: Mapping[str, str]
    period: float
    """Control period T (s)"""
    start: Mapping[str, float] = MappingProxyType({})
    """Start values of inputs, by the names of :func:`hsv.model.signals.numbers_of`; other inputs start at 0"""
    steps_at_start: bool = False
    """Whether step 0 is part of the initialisation, so that there are outputs at the start"""
    stop: float | None = None
    """Default stop time of the simulation (s)"""


def write_fmu(path: Path, block: ExportedBlock) -> None:
    """Compile ``block`` and write it as an FMU to ``path``.

    Raises:
        ParameterError: The machine is not Linux on x86-64, there is no C compiler, or the compiler failed.
        OSError: The file cannot be written.
    """
    from fmpy import __file__ as package

    if (found := (platform.system(), platform.machine())) != ("Linux", "x86_64"):
        raise ParameterError(f"fmu = {str(path)!r}: this is {' '.join(found)}, expected Linux on x86_64 to compile it")
    with TemporaryDirectory() as folder:
        texts = dict(block.texts)
        _write(Path(folder), texts)
        described = load_block(_compile(Path(folder), block.source, path, "-O0"), block.symbol)
        token = str(uuid.uuid5(uuid.NAMESPACE_OID, hashlib.sha256("".join(texts.values()).encode()).hexdigest()))
        texts |= {
            _SOURCE: files("hsv.plugins").joinpath(_SOURCE).read_text(encoding="utf-8"),
            _HEADER: _block_header(block, described, token),
        }
        _write(Path(folder), texts)
        binary = _compile(
            Path(folder), _SOURCE, path, "-fvisibility=hidden", f"-I{Path(package).parent / 'c-code'}"
        ).read_bytes()
    contents = {
        "modelDescription.xml": _model_description(block, described, token),
        f"binaries/x86_64-linux/{block.symbol}.so": binary,
        "sources/buildDescription.xml": _build_description(block.symbol),
        **{f"sources/{name}": text.encode() for name, text in texts.items()},
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            # ZipInfo has a fixed date, so that the same design gives the same file.
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)


def _write(folder: Path, texts: Mapping[str, str]) -> None:
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")


def _compile(folder: Path, source: str, path: Path, *options: str) -> Path:
    library = folder / f"{source}.so"
    try:
        ran = subprocess.run(
            ["cc", *_FLAGS, *options, "-o", library, folder / source], capture_output=True, text=True, check=False
        )
    except FileNotFoundError:
        raise ParameterError(
            f"fmu = {str(path)!r}: there is no C compiler cc, expected one to compile the FMU"
        ) from None
    if ran.returncode:
        first = next((line for line in ran.stderr.splitlines() if "error" in line), ran.stderr[:200].strip())
        raise ParameterError(f"fmu = {str(path)!r}: cc failed, {first}")
    return library


def _numbers(signals: tuple[SignalType, ...]) -> list[tuple[str, str]]:
    return [number for signal in signals for number in numbers_of(signal)]


def _parameter_numbers(block: CBlock) -> list[tuple[str, str, float, float, float, str]]:
    """Return name, unit, value, minimum, maximum and description of each scalar; an array has several."""
    rows = []
    for parameter in block.parameters:
        values, name = np.ravel(parameter.default), parameter.name.partition(".")[2]
        names = numbers_of(SignalType(name, parameter.unit or "1", len(values)))
        limits = parameter.minimum, parameter.maximum, parameter.description
        rows += [(*row, float(value), *limits) for row, value in zip(names, values, strict=True)]
    return rows


def _block_header(block: ExportedBlock, described: CBlock, token: str) -> str:
    inputs, parameters = _numbers(described.inputs), _parameter_numbers(described)
    values = [*(block.start.get(name, 0.0) for name, _ in inputs), *(row[2] for row in parameters)]
    sizes = {
        "INPUTS": len(inputs),
        "PARAMETERS": len(parameters),
        "OUTPUTS": len(_numbers(described.outputs)),
        "STATE": described.state_size,
        "STEP_AT_START": int(block.steps_at_start),
    }
    return (
        f'#pragma once\n#include "{block.source}"\n\n#define FMU_BLOCK {block.symbol}\n#define FMU_TOKEN "{token}"\n'
        f"#define FMU_PERIOD {block.period.hex()}\n"
        f"enum {{ {', '.join(f'FMU_{name} = {size}' for name, size in sizes.items())} }};\n"
        "/* Inputs and parameters before the first step. */\n"
        f"static const double fmu_start_values[] = {{{', '.join(float(value).hex() for value in values)}}};\n"
    )


def _model_description(block: ExportedBlock, described: CBlock, token: str) -> bytes:
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=block.symbol,
        instantiationToken=token,
        description=block.description,
        generationTool="hsv",
        variableNamingConvention="structured",
    )
    period = repr(block.period)
    simulation = {"modelIdentifier": block.symbol, "fixedInternalStepSize": period}
    simulation |= dict.fromkeys(("canGetAndSetFMUState", "canSerializeFMUState"), "true")
    ElementTree.SubElement(root, "CoSimulation", simulation)
    inputs, outputs, parameters = _numbers(described.inputs), _numbers(described.outputs), _parameter_numbers(described)
    units = ElementTree.SubElement(root, "UnitDefinitions")
    named: list[tuple[Any, ...]] = [("time", "s"), *inputs, *parameters, *outputs]
    for unit in dict.fromkeys(str(row[1]) for row in named):
        definition = ElementTree.SubElement(units, "Unit", name=unit)
        exponents = base_units(unit)
        # FMI allows integer exponents only; the units of the elastic states have others.
        if all(float(power).is_integer() for power in exponents.values()):
            ElementTree.SubElement(definition, "BaseUnit", {name: f"{power:g}" for name, power in exponents.items()})
    ElementTree.SubElement(ElementTree.SubElement(root, "LogCategories"), "Category", name="logStatusError")
    experiment = {"startTime": "0", "stepSize": period}
    experiment |= {} if block.stop is None else {"stopTime": repr(block.stop)}
    ElementTree.SubElement(root, "DefaultExperiment", experiment)
    variables = ElementTree.SubElement(root, "ModelVariables")

    def variable(name: str, unit: str, causality: str, **others: str) -> None:
        known = SIGNALS.get(re.split(r"[.\[]", name)[0])
        attributes = {"name": name, "valueReference": str(len(variables)), "causality": causality, "unit": unit}
        attributes |= {"description": known.meaning} if known else {}
        ElementTree.SubElement(variables, "Float64", attributes | others)

    for name, unit in inputs:
        variable(name, unit, "input", start=repr(block.start.get(name, 0.0)))
    for name, unit, value, low, high, meaning in parameters:
        limits = {"min": repr(low), "max": repr(high)} if np.isfinite((low, high)).all() else {}
        variable(name, unit, "parameter", description=meaning, variability="tunable", start=repr(value), **limits)
    first = len(variables)
    for name, unit in outputs:
        variable(name, unit, "output")
    variable("time", "s", "independent", description="time of the simulation")
    structure = ElementTree.SubElement(root, "ModelStructure")
    for kind in ("Output", "InitialUnknown"):
        for reference in range(first, first + len(outputs)):
            ElementTree.SubElement(structure, kind, valueReference=str(reference))
    return _written(root)


def _build_description(symbol: str) -> bytes:
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=symbol)
    # fmu.c includes all other sources.
    sources = ElementTree.SubElement(configuration, "SourceFileSet", language="C99", compiler="gcc")
    sources.set("compilerOptions", "-std=gnu99 -O3 -ffp-contract=off -fno-math-errno -fvisibility=hidden")
    ElementTree.SubElement(sources, "SourceFile", name=_SOURCE)
    return _written(root)


def _written(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True))
