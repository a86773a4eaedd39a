"""The vehicle of a scenario, with its equipment, faults and reference, as a C block with the API of ``hsv_block.h``."""

from __future__ import annotations

from importlib.resources import files

from hsv.flight.assembly import assemble_flight, without_code
from hsv.flight.closed_loop import Components
from hsv.flight.scenario import Scenario
from hsv.model.faults.table import COMMAND as COMMAND_SIDE
from hsv.model.plant import plant_faults
from hsv.model.signals import COMMAND, numbers_of
from hsv.plugins.c_export import HEADER, constant, constant_array, core_headers
from hsv.plugins.fmu_export import ExportedBlock
from hsv.plugins.library import include_folder

SOURCE = "vehicle.c"
NUMBERS = "scenario.h"


def exported_vehicle(scenario: Scenario) -> ExportedBlock:
    """Return the vehicle of ``scenario`` as a block in C, from which an FMU is made."""
    components = assemble_flight(without_code(scenario))
    plant = components.plant
    source = files("hsv.flight").joinpath("export.c").read_text(encoding="utf-8")
    header = (include_folder() / HEADER).read_text(encoding="utf-8")
    texts = {SOURCE: source, NUMBERS: scenario_header(components), HEADER: header, **core_headers(source)}
    names = [name for name, _ in numbers_of(COMMAND)]
    start = dict(zip(names, plant.initial.input.tolist(), strict=True))
    stop = plant.steps * plant.period
    return ExportedBlock("vehicle", scenario.title, SOURCE, texts, plant.period, start, steps_at_start=True, stop=stop)


def scenario_header(components: Components) -> str:
    """Return the text of the C header with a scenario's numbers, in structs of core.h and arrays."""
    plant, injector = components.plant, components.fault_injector
    payloads = injector.link_state()
    lines = [
        "/* Numbers of a scenario, written by hsv export-vehicle; SI units and radians, see core.h. */",
        "#pragma once",
        '#include "core.h"',
        "#include <math.h>",
        "",
        f"enum {{ FINAL_STEP = {plant.steps}, COMMAND_LINK_PAYLOADS = {len(payloads)} }};",
        constant_array("initial_state", "double", plant.initial.state),
        constant_array("command_link_memory", "double", payloads),
        *constant("plant_data", plant.data),
        *constant("memory_data", plant.memory()),
        *constant("faults_data", plant_faults(injector.known, plant.period)),
        *constant("command_faults", injector.rows((COMMAND_SIDE,))),
        *constant("command_link_data", injector.link),
        *constant("reference_data", components.nominal_trajectory.reference.data),
    ]
    return "\n".join(lines) + "\n"
