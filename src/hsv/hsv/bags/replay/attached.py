"""Parameters of a recorded flight: the attached ones, and their changes in flight."""

from __future__ import annotations

import mimetypes
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from hsv.bags.columns import expecting_fields
from hsv.bags.description import (
    ACTUATOR,
    COMMAND,
    FAULT_INJECTOR,
    NOMINAL,
    NOMINAL_TRAJECTORY,
    NOTCH_FILTER,
    PLANT,
    REFERENCE,
    STATE,
    TOPICS,
    TUBE_MPC,
    TUBE_STATUS,
)
from hsv.bags.flight import input_columns
from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS, PACE_PARAMETERS, RECORDER_PARAMETERS
from hsv.bags.messages import StepMessages
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.steps import cut_off, expected_stamps, joined
from hsv.base.errors import DesignError, ParameterError, RecordingError
from hsv.base.parameters import validate
from hsv.control.controller import CONTROLLER_PARAMETERS
from hsv.control.design import TAU, ControlDesign, change_parameters, rigid_factors, scheduled_changes
from hsv.control.design_file import CERTIFICATE_PARAMETERS, design_files, find_design, read_design, read_parameters
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.control.reference_trajectory import COLUMNS
from hsv.flight.assembly import blamed_on
from hsv.flight.blocks import Signals
from hsv.flight.scenario import parse_scenario, scenario_text
from hsv.model.faults.injector import FaultInjector
from hsv.model.vehicle import vehicle_label

DESIGN, SCENARIO = "design.yaml", "scenario.yaml"
"""Names of the attachments with the parameters of the design and of the scenario; the latter override the former."""

_OF_THE_RUN = {
    p.name for p in (*PACE_PARAMETERS, *RECORDER_PARAMETERS, *CERTIFICATE_PARAMETERS, *LOCKSTEP_PARAMETERS)
} - {p.name for p in (*CONTROLLER_PARAMETERS, ESTIMATOR_ENABLED)}
"""Parameters of the execution, such as pace and files, which do not change the flight."""

LEAST_ACTIVE_TIME = 10.0
"""Minimum simulated time (s) for which the controller must have been active, so that a replay proves something."""

ACTIVE_INPUT = 1e-6
"""Smallest deviation (1, rad) of a command from the reference input that counts as an action of the controller."""


def supply(bag: Bag, design: Path | None, scenario: str | None) -> None:
    """Attach a design and a scenario to an opened bag, as if it had been flown with them; its files do not change.

    Args:
        bag: Any bag of a flight.
        design: Parameter file of the design; default: the design of ``scenario``.
        scenario: Name of a shipped scenario, or path of a TOML file.
    """
    files = {}
    if scenario is not None:
        text = scenario_text(scenario)
        parsed = parse_scenario(text, Path(scenario).stem)
        files = {"scenario.toml": text, SCENARIO: ParameterSections(parsed.parameters()).to_yaml()}
        with blamed_on(parsed):
            design = design or find_design(parsed.design)
    if design is not None:
        read_design(design)
        files |= design_files(design)
    for name, content in files.items():
        bag.attachments[name] = content.encode()
        bag.media_types[name] = mimetypes.guess_type(name)[0] or "text/plain"


def flown_parameters(bag: Bag, design: Path | None = None) -> ParameterSections:
    """Return the parameters of the nodes in a recorded run, with the changes in flight of faults, tau and commands.

    A ``design`` file replaces the attached design. Missing or wrong parameters raise a RecordingError or DesignError.
    """
    for name in (DESIGN, SCENARIO):
        if name not in bag.attachments:
            raise RecordingError(
                f"{bag.path}: no attachment {name}: ros2 bag record and convert keep none, expected --scenario "
                "NAME|FILE and, where the flight had another design than the scenario's, --design FILE"
            )
    designed, scenario = (_attached(bag, name) for name in (DESIGN, SCENARIO))
    values = designed.overlaid(scenario)
    with expecting_fields(bag.path):
        try:
            # For these nodes only: another node may have another design, which is not certified for the same factors.
            changed = {
                FAULT_INJECTOR.name: _faults_as_flown(bag, values.of(FAULT_INJECTOR.name)),
                TUBE_MPC.name: _tau_as_flown(bag, values),
                NOMINAL_TRAJECTORY.name: _commands_as_flown(bag),
            }
        except (DesignError, ParameterError) as error:
            raise RecordingError(f"{bag.path}: attached {error}") from error
    if design is not None:
        values = ParameterSections(read_parameters(design)).overlaid(scenario)
    return values.overlaid(ParameterSections({}, changed))


def _attached(bag: Bag, name: str) -> ParameterSections:
    """Return the attached parameters that affect the flight; a vehicle file's path becomes the vehicle's name."""
    sections = ParameterSections.parse(bag.text(name), f"{bag.path}: {name}")
    for flat in (sections.shared, *sections.own.values()):
        if "vehicle.name" in flat:
            flat["vehicle.name"] = vehicle_label(str(flat["vehicle.name"]))
    return sections.only(sections.names - _OF_THE_RUN)


def controller_of(values: ParameterSections) -> str:
    """Return the name of the controller in these parameters, without loading it."""
    return str(validate(CONTROLLER_PARAMETERS, values.of(PLANT.name))["controller"])


def estimated(values: ParameterSections) -> bool:
    """Return whether an estimator is enabled in these parameters."""
    return bool(validate((ESTIMATOR_ENABLED,), values.of(NOTCH_FILTER.name))[ESTIMATOR_ENABLED.name])


def complete_steps(bag: Bag, topics: Iterable[str] = ()) -> int:
    """Return the number of steps before the first step that is missing on one of ``topics``.

    Default of ``topics``: all step topics in the bag.
    """
    stamps = [bag.times(topic) for topic in topics or [topic for topic in TOPICS if topic in bag.roles]]
    expected = expected_stamps(bag)
    present = np.all([np.isin(expected, stamp) for stamp in stamps], axis=0)
    return min(*map(len, stamps), len(present) if present.all() else int(np.argmin(present)))


def broken_off(bag: Bag) -> bool:
    """Return whether the flight's end may be unrecorded: run interrupted or killed, bag cut off or recovered."""
    status = bag.columns(STATE)["status"]
    return not len(status) or int(status[-1]) == 0 or cut_off(bag)


def refuse_vacuous(bag: Bag) -> None:
    """Raise a RecordingError if commands differ from reference inputs for under 10 s: a replay would prove nothing."""
    command, nominal = joined(bag, (COMMAND, NOMINAL)).values()
    deviation = input_columns(command) - input_columns(nominal, "reference_input.")
    active = np.abs(deviation).max(axis=1, initial=0.0) > ACTIVE_INPUT
    stamps = nominal["header.stamp"] * 1e-9
    period = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
    seconds = np.count_nonzero(active) * period
    if seconds < LEAST_ACTIVE_TIME:
        raise RecordingError(
            f"{bag.path}: the controller was active for {seconds:.2f} s, "
            f"expected at least {LEAST_ACTIVE_TIME:g} s: a replay would prove nothing"
        )


def _faults_as_flown(bag: Bag, values: dict[str, Any]) -> dict[str, Any]:
    """Return fault parameters that reproduce the recorded active faults; empty if the attached ``values`` do so."""
    injector = FaultInjector.from_parameters(values)
    command = np.zeros(2)
    changed = False
    messages, signals = StepMessages(ACTUATOR, bag.types), Signals()
    for data in bag.track(ACTUATOR).data:
        messages.unpack(data, signals)
        recorded = signals.active_faults
        planned = injector.acting(signals.step)
        if planned != recorded:
            changed = True
            for fault, _ in set(planned) - set(recorded):
                injector.clear(fault.channel, fault.type)
            for fault, since in recorded:
                if (fault, since) not in planned:
                    injector.inject(fault)
        injector.step(signals.step, command)
    return injector.parameters() if changed else {}


def _commands_as_flown(bag: Bag) -> dict[str, Any]:
    """Return the parameters of the last reference commanded in flight; empty without commands in flight."""
    published = bag.decode(REFERENCE) if REFERENCE in bag.roles else ()
    flown = [message for _, message in published if message.status == bag.constant(REFERENCE, "FLOWN")]
    if not flown or flown[-1].step == 0:
        return {}
    return {f"reference.{name}": np.asarray(getattr(flown[-1], name)).tolist() for name in COLUMNS}


def _tau_as_flown(bag: Bag, sections: ParameterSections) -> dict[str, Any]:
    """Return parameters that reproduce the recorded tube factors; empty if ``sections`` do so, or without tube MPC."""
    if controller_of(sections) != TUBE_MPC.name:
        return {}
    recorded_status = [status for _, status in bag.decode(TUBE_STATUS)]
    values = sections.of(TUBE_MPC.name)
    design = ControlDesign.from_parameters(values)
    schedule = [(0, design.tau), *scheduled_changes(values, design.tau_minimum, design.period)]
    flown: list[tuple[int, np.ndarray]] = []
    planned = []
    for status in recorded_status:
        recorded = rigid_factors(status.tau, TAU.name)
        if not flown or np.any(recorded != flown[-1][1]):
            flown.append((status.step, recorded))
        planned.append(np.all(recorded == [tau for start, tau in schedule if start <= status.step][-1]))
    if all(planned):
        return {}
    return {TAU.name: flown[0][1].tolist(), **change_parameters(flown[1:], design.period)}
