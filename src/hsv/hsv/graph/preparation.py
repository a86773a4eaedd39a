"""Preparation of a run of the graph from a scenario: parameters, attachments, a name for the bag."""

from __future__ import annotations

import datetime
import fcntl
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hsv.bags.description import COMPOSED, CONTROLLER, LIVE, TUBE_MPC, NodeDescription, controller_node, graph
from hsv.bags.infrastructure_parameters import STEP_TIMEOUT
from hsv.bags.parameter_sections import ParameterSections
from hsv.base.errors import DesignError, DocumentError, ParameterError, QuantityError, RecordingError, RunError
from hsv.base.files import open_regular
from hsv.control.controller import NODE
from hsv.control.design import DESIGN_PARAMETERS, NO_DESIGN, digest
from hsv.control.design_file import (
    attached_certificate,
    design_files,
    find_certificate,
    find_design,
    read_certificate,
    read_design,
)
from hsv.flight.assembly import assemble_flight, blamed_on, own_parameters
from hsv.flight.scenario import Scenario, parse_scenario, scenario_text, with_controller
from hsv.flight.tables import read_changes
from hsv.graph.exclusive import ports
from hsv.graph.launcher import executable
from hsv.plugins.controllers import library_record
from hsv.plugins.library import library_digest


class RunFolder(tempfile.TemporaryDirectory[str]):
    """A temporary folder for the files of a run; a new one removes those of runs that were killed.

    A run holds the lock of the file ``lock`` in its folder, which the system releases when the run has ended.
    """

    def __init__(self) -> None:
        for lock in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*/lock"):
            with suppress(OSError, DocumentError):
                if lock.parent.lstat().st_uid == os.getuid():
                    with open_regular(lock) as stream:
                        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
                        shutil.rmtree(lock.parent)
        super().__init__(prefix=_PREFIX)
        new = Path(self.name, "new")
        self._held = new.open("wb")
        fcntl.flock(self._held, fcntl.LOCK_EX)
        new.rename(Path(self.name, "lock"))  # locked before it has its name, so that no other run removes it

    def cleanup(self) -> None:
        """Remove the folder."""
        self._held.close()
        super().cleanup()


_PREFIX = "hsv_run_"


@dataclass(frozen=True)
class PreparedRun:
    """A checked scenario, ready to fly, with nodes, bag and parameter files; later files override earlier ones."""

    scenario: Scenario
    bag: Path
    parameter_files: tuple[Path, ...]
    nodes: tuple[NodeDescription, ...]
    steps: int
    """Number of the last step if the flight does not diverge."""
    step_timeout: float
    """Wall time (s) after which a silent node ends the run."""
    folder: RunFolder | None
    """Temporary folder of the parameter files, removed after the flight; ``None`` if the caller gave a folder."""


@dataclass(frozen=True)
class RunOptions:
    """Options of the execution of a run, which do not change the numbers of the flight."""

    real_time_factor: float | None = None
    """Ratio of simulated to wall time; 0: as fast as possible; None: 1 with a live view, otherwise 0."""
    step_timeout: float = STEP_TIMEOUT
    """Wall time (s) after which a silent node ends the run."""
    composed: bool = False
    """Whether all nodes share one process."""
    external: bool = False
    """Whether a controller that is started by hand replaces that of the scenario."""
    live_port: int | None = None
    """Port of the live view's Foxglove server; its page has the next port. 0: any free ports; None: no live view."""
    paused: bool = False
    """Whether the flight starts paused."""

    def __post_init__(self) -> None:
        """Raise a QuantityError if a number is out of range."""
        if self.real_time_factor is not None and not 0.0 <= self.real_time_factor <= 1000.0:
            raise QuantityError(f"real-time-factor = {self.real_time_factor}: expected 0 (as fast as possible) to 1000")
        if not 0.1 <= self.step_timeout <= 1e6:
            raise QuantityError(f"step-timeout = {self.step_timeout}: expected at least 0.1 (seconds)")


def prepare(
    scenario_name: str,
    options: RunOptions = RunOptions(),
    *,
    text: str = "",
    changes: Sequence[str] = (),
    bags: Path = Path("bags"),
    bag: Path | None = None,
    folder: Path | None = None,
) -> PreparedRun:
    """Check scenario and design, make the bag's directory, and write the parameter files of a run.

    Whatever can be refused is refused here, before a process starts.

    Args:
        scenario_name: Name or path of the scenario.
        options: Options of the execution.
        text: The scenario, as :func:`hsv.flight.scenario.scenario_text` returns it; empty: read by its name.
        changes: Changes of its fields, such as ``duration=50 s``; without ``text`` only.
        bags: Folder for a new bag, named by scenario and time, if ``bag`` is not given.
        bag: Bag to record to, a new directory.
        folder: Directory for the parameter files; if not given, a temporary one that is removed with the result.

    Raises:
        ParameterError: ``live_port`` or the port after it is out of range or in use.
        ScenarioError: Names the field that is wrong, or what is wrong with the design.
        RecordingError: ``bag`` exists already or cannot be made.
    """
    live_ports = None if options.live_port is None else ports(options.live_port)
    real_time_factor = options.real_time_factor
    if real_time_factor is None:
        real_time_factor = 1.0 if live_ports else 0.0
    text = text or scenario_text(scenario_name, read_changes(changes))
    name = Path(scenario_name).stem
    if options.external:
        # The bag gets the changed scenario, which is not the published one.
        text = with_controller(text, NODE, name)
    scenario = parse_scenario(text, name)
    with blamed_on(scenario):
        design_file = find_design(scenario.design) if scenario.design else None
        design = read_design(design_file) if design_file else None
        nodes = ((LIVE,) if live_ports else ()) + _started(scenario.controller, options.composed)
        own = own_parameters(scenario)
        library = library_record(scenario.controller)
    steps = assemble_flight(scenario, design).plant.steps
    temporary = None
    if folder is None:
        temporary = RunFolder()
        folder = Path(temporary.name)
    folder = folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    sections = {CONTROLLER.name: own} if own else {}
    if scenario.controller == TUBE_MPC.name and design and design.tube and not design.actuators:
        sections[TUBE_MPC.name] = _watched(find_certificate(scenario.design))
    files = {
        "scenario.toml": text,
        "scenario.yaml": ParameterSections(scenario.parameters(), sections).to_yaml(),
        "design.yaml": ParameterSections({"design.name": NO_DESIGN}).to_yaml(),
        **(design_files(design_file) if design_file else {}),
    }
    if library and library.source_name:
        files[f"controller_{Path(library.source_name).name}"] = library.source.decode(errors="replace")
    for name, content in files.items():
        (folder / name).write_text(content, encoding="utf-8")
    default = f"{scenario.name}_{datetime.datetime.now(datetime.UTC):%Y%m%dT%H%M%SZ}"
    bag = _new_directory([bag] if bag else [bags / default, *(bags / f"{default}_{n}" for n in range(2, 100))])
    design_hash = design.digest if design else digest({})
    custom_data = {"scenario": scenario.name, "title": scenario.title}
    if changes:
        custom_data["set"] = json.dumps(list(changes))
    custom_data |= provenance(scenario.controller, scenario.design, design_hash, scenario.seed)
    run = {
        "real_time_factor": float(real_time_factor),
        "step_timeout": float(options.step_timeout),
        "paused": options.paused,
        "recorder": True,
        "bag.directory": str(bag.absolute()),
        "bag.attachments": [str(folder / name) for name in files],
        "bag.custom_data": [f"{key}={value}" for key, value in custom_data.items()],
    }
    if design_file and "certificate.json" in files:
        # The permanent path, unlike the folder of this run: parameters dumped from the nodes can be loaded later.
        run["design.certificate"] = str(design_file.with_suffix(".certificate.json").absolute())
    if live_ports:
        run |= {"live.port": live_ports[0], "live.page_port": live_ports[1]}
        run |= {"live.title": scenario.title, "live.bag": str(bag)}
    (folder / "run.yaml").write_text(ParameterSections(run).to_yaml(), encoding="utf-8")
    parameter_files = tuple(folder / name for name in ("design.yaml", "scenario.yaml", "run.yaml"))
    return PreparedRun(scenario, bag, parameter_files, nodes, steps, options.step_timeout, temporary)


def _started(controller: str, composed: bool) -> tuple[NodeDescription, ...]:
    """Return the nodes to start for a flight with ``controller``, in start order; the run ends with the last one."""
    node = controller_node(controller)
    if node.executable and node.foreign:
        try:
            executable(node)
        except RunError as error:
            raise ParameterError(f"controller = {controller!r}: {error}") from None
    nodes = ((node,) if node.foreign else ()) + (COMPOSED,) if composed else graph(controller)
    return tuple(node for node in nodes if node.executable)


def _watched(certificate: Path | None) -> dict[str, Any]:
    """Return the parameter with which the tube law watches W; none without a certificate, or if it is malformed.

    The controller's node refuses a malformed certificate, with a message.
    """
    with suppress(DesignError, LookupError, TypeError):
        if certificate:
            step = read_certificate(certificate)["tube"]["disturbance"]["step"]
            return {"tube.disturbance": [*step["lower"], *step["upper"]]}
    return {}


def provenance(controller: str, name: str, design_hash: str, seed: int) -> dict[str, str]:
    """Return the origin of a flight as custom data of its bag: commit, controller, design, seed and starting time."""
    library = library_digest(controller)
    return {
        "commit": commit(),
        "controller": controller,
        **({"controller_sha256": library} if library else {}),
        "design": name,
        "design_hash": design_hash,
        "seed": str(seed),
        "started": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }


def recorded_files(values: Mapping[str, Mapping[str, Any]], designed: Mapping[str, Any]) -> dict[str, str]:
    """Return parameters and certificate to attach to the bag of a run started by hand, as {file name: text}.

    ``values`` is {node: {parameter: value}}, ``designed`` has the parameters of the node that loaded the design.
    """
    sections = ParameterSections.gathered(values)
    design = {parameter.name for parameter in DESIGN_PARAMETERS}
    files = {
        "design.yaml": sections.only(sections.names & design).to_yaml(),
        "scenario.yaml": sections.only(sections.names - design).to_yaml(),
    }
    certificate = find_certificate(designed.get("design.name", ""), designed.get("design.certificate", ""))
    return files | attached_certificate(certificate)


def _new_directory(candidates: Sequence[Path]) -> Path:
    """Make and return the first of ``candidates`` that does not exist.

    The recorder would make it too late: of two runs with the same bag, the second must be refused before it starts.
    """
    for path in candidates:
        try:
            path.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise RecordingError(f"bag = {str(path)!r}: cannot be made ({error.strerror})") from None
        return path
    raise RecordingError(f"bag = {str(path)!r}: exists already, expected a new directory")


def commit() -> str:
    """Return the commit of this source tree as ``git describe --dirty`` names it; ``unknown`` outside a checkout."""
    command = ["git", "-C", str(Path(__file__).resolve().parent), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
