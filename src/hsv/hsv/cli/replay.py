"""The command ``hsv replay``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from hsv.cli.bag_warnings import print_bag_warnings
from hsv.cli.options import BagArgument, JsonOption, SuppliedDesignOption, SuppliedScenarioOption, TrustOption
from hsv.cli.output import console, print_json

if TYPE_CHECKING:
    from hsv.bags.replay.engine import ProcessComparison


def replay(
    bag: BagArgument,
    node: Annotated[str, typer.Option(help="Replay this node only.")] = "",
    parameters: Annotated[
        Path | None, typer.Option(help="Parameter YAML file to test instead of the attached design.")
    ] = None,
    design: SuppliedDesignOption = None,
    scenario: SuppliedScenarioOption = None,
    rerun: Annotated[
        bool, typer.Option("--rerun", help="Repeat the whole loop instead of each node separately.")
    ] = False,
    over_dds: Annotated[bool, typer.Option("--over-dds", help="Run the real node processes.")] = False,
    trust: TrustOption = False,
    json: JsonOption = False,
) -> None:
    """Feed every node's algorithm with its recorded inputs, and compare its outputs with the recorded ones.

    The exit code is 1 if anything differs. A run in which the controller was hardly active is rejected.

    Example: hsv replay bags/case1_20260101T000000Z --parameters offline_design/baseline.yaml
    """
    from hsv.bags.description import CONTROLLER, controller_node
    from hsv.bags.former import require_interface_version
    from hsv.bags.reader import Bag
    from hsv.bags.replay import engine
    from hsv.bags.replay.attached import controller_of, estimated, flown_parameters, refuse_vacuous, supply
    from hsv.bags.replay.processes import processes_of
    from hsv.base.errors import ParameterError, RunError
    from hsv.cli.progress import stages
    from hsv.flight.trust import require_trust

    opened = Bag(bag)
    require_interface_version(opened)
    supply(opened, design, scenario)
    refuse_vacuous(opened)
    values = flown_parameters(opened, parameters)
    controller = controller_of(values)
    # Of all nodes: a section of one node in the bag's parameters brings no other, unseen.
    values = values.updated({"controller": controller})
    processes = processes_of(controller, estimated(values))
    if node and node not in processes:
        raise ParameterError(f"node = {node!r}: expected one of {', '.join(processes)}")
    if node and rerun:
        raise ParameterError(f"node = {node!r}: a rerun repeats the whole loop, expected one of --node and --rerun")
    if controller_node(controller).foreign and rerun and over_dds:
        raise ParameterError(
            f"controller = {controller!r}: a separate node, which a bag does not start: expected --rerun without "
            "--over-dds, which uses its recorded commands"
        )
    if rerun or node in ("", CONTROLLER.name):
        require_trust(controller, bag, trust)
    failed = []
    report = []
    with stages() as progress:
        if over_dds:
            from hsv.graph import replay_over_dds as real

            compared = (
                real.rerun(opened, controller, values, progress)
                if rerun
                else real.replay_all(opened, [node] if node else list(processes), controller, values, progress)
            )
        elif rerun:
            compared = iter(engine.rerun(opened, controller, values, progress))
        else:
            names = [node] if node else list(processes)
            compared = (engine.replay(opened, processes[name], values, progress) for name in names)
        for result in compared:
            report.append(_as_json(result))
            if not result.passed:
                failed.append(result.process.node.name)
            if not json:
                _print(result)
    if json:
        print_json({"bag": str(bag), "passed": not failed, "processes": report})
    print_bag_warnings(opened)
    if failed:
        raise RunError(f"{', '.join(failed)}: differs from the recording in {bag}")


def _print(result: ProcessComparison) -> None:
    messages = sum(topic.actual_count for topic in result.topics)
    line = f"{result.process.node.name:18} {messages:7} messages  "
    padding = sum(topic.different_padding for topic in result.topics)
    if result.identical:
        remark = f" except the padding of {padding}" if padding else ""
        console.print(Text.assemble(line, (f"identical in every byte{remark}", "green")), soft_wrap=True)
        return
    different = sum(topic.different_bytes for topic in result.topics) - padding
    if not result.passed:
        first = min((t.first for t in result.topics if t.first), key=lambda d: d.step)
        console.print(Text.assemble(line, ("differ", "bold red"), f" {first}"), soft_wrap=True)
        return
    largest = [(value, t.topic, name) for t in result.topics for name, value in t.largest.items()]
    if largest:
        value, topic, name = max(largest)
        console.print(
            f"{line}equal within {result.process.tolerance:g}, {different} differ in bytes: largest {value:.3g} in "
            f"{topic} {name}",
            soft_wrap=True,
        )
    else:
        console.print(
            f"{line}equal in every number, but {different} differ in bytes (sign of zero or NaN)", soft_wrap=True
        )


def _as_json(result: ProcessComparison) -> dict[str, Any]:
    return {
        "node": result.process.node.name,
        "passed": result.passed,
        "identical": result.identical,
        "tolerance": result.process.tolerance,
        "reason": result.process.reason,
        "topics": [
            {
                "topic": topic.topic,
                "recorded": topic.expected_count,
                "replayed": topic.actual_count,
                "different_bytes": topic.different_bytes,
                "different_padding": topic.different_padding,
                "largest_difference": topic.largest,
                "first_difference": topic.first
                and {
                    "step": topic.first.step,
                    "time_s": topic.first.time_ns * 1e-9,
                    "field": topic.first.field,
                    "recorded": topic.first.expected,
                    "replayed": topic.first.actual,
                },
            }
            for topic in result.topics
        ],
    }
