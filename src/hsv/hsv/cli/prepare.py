"""The command ``hsv prepare``: what ``hsv run`` does before it starts the nodes, for other launchers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import (
    ComposedOption,
    ExternalOption,
    JsonOption,
    LiveOption,
    LivePortOption,
    NamespaceOption,
    NewBagOption,
    RealTimeFactorOption,
    ScenarioArgument,
    StepTimeoutOption,
    live_port_of,
)
from hsv.cli.output import console, print_json


def prepare(
    scenario: ScenarioArgument = "case1",
    live: LiveOption = False,
    live_port: LivePortOption = None,
    real_time_factor: RealTimeFactorOption = None,
    composed: ComposedOption = False,
    external: ExternalOption = False,
    bag: NewBagOption = None,
    namespace: NamespaceOption = "/",
    step_timeout: StepTimeoutOption = None,
    folder: Annotated[
        Path | None, typer.Option(help="Folder for the parameter files; default: a new temporary one.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Prepare a flight for another launcher: check the scenario, create the bag, write the parameter files.

    The nodes to start and their parameter files are printed. After the flight, the launcher must remove the folder of
    these files and call hsv conclude; hsv run does both by itself.

    Example: hsv prepare case1 --json
    """
    import shutil
    import tempfile

    from hsv.bags.description import LANDED, LIVE, ROOT, checked_namespace, graph
    from hsv.cli.targets import check_folder
    from hsv.graph.launcher import claim_graph
    from hsv.graph.preparation import prepare as prepare_run

    if folder:
        check_folder(folder, "folder")
    namespace, port = checked_namespace(namespace), live_port_of(live, live_port)
    # Not held on: each node claims what it publishes when it starts.
    claim_graph(graph(), namespace).close()
    target = folder or Path(tempfile.mkdtemp(prefix="hsv_run_"))
    try:
        prepared = prepare_run(
            scenario,
            bag=bag,
            real_time_factor=real_time_factor,
            step_timeout=step_timeout,
            folder=target,
            composed=composed,
            external=external,
            live_port=port,
        )
    except BaseException:
        if not folder:
            shutil.rmtree(target)
        raise
    nodes = prepared.nodes
    if json:
        print_json(
            {
                "scenario": prepared.scenario.name,
                "run_id": prepared.run_id,
                "bag": str(prepared.bag),
                "namespace": namespace,
                "folder": str(target),
                "parameter_files": [str(path) for path in prepared.parameter_files],
                "nodes": [
                    {
                        "name": node.name,
                        "package": node.package,
                        "executable": node.executable,
                        "ends_run": node is nodes[-1],
                        "in_flight": node is not LIVE,
                    }
                    for node in nodes
                ],
                "landed_exit_codes": LANDED,
                "last_step": prepared.steps,
            }
        )
        return
    words = " ".join(f"--params-file {path}" for path in prepared.parameter_files)
    words += f" -r __ns:={namespace}" if namespace != ROOT else ""
    for node in nodes:
        console.print(f"ros2 run {node.package} {node.executable} --ros-args {words}", soft_wrap=True)
    console.print(f"bag {prepared.bag}", soft_wrap=True)
