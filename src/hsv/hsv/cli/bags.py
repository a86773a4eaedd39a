"""Commands on bags: replay, comparison, export, repair, and republishing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text
from typer import Option

from hsv.base.errors import ParameterError, RecordingError, RunError, one_of
from hsv.base.units import significant
from hsv.cli import output
from hsv.cli.options import BagArgument, JsonOption, SuppliedDesignOption, SuppliedScenarioOption, TrustOption

if TYPE_CHECKING:
    from hsv.bags.diff import Comparison, Difference
    from hsv.bags.replay.engine import ProcessComparison


def replay(
    bag: BagArgument,
    node: Annotated[str, Option(help="Replay this node only.")] = "",
    parameters: Annotated[Path | None, Option(help="Parameter file to test in place of the attached design.")] = None,
    design: SuppliedDesignOption = None,
    scenario: SuppliedScenarioOption = None,
    rerun: Annotated[bool, Option("--rerun", help="Repeat the whole loop, not each node.")] = False,
    over_dds: Annotated[bool, Option("--over-dds", help="Repeat the whole loop with the node processes.")] = False,
    trust: TrustOption = False,
    json: JsonOption = False,
) -> None:
    """Feed every node's algorithm with its recorded inputs, and compare its outputs with the recorded ones.

    The exit code is 1 if an output differs by more than the tolerance of its node. A run in which the controller was
    hardly active is rejected.

    Example: hsv replay bags/case1_20260101T000000Z --parameters offline_design/baseline.yaml
    """
    from hsv.bags.description import CONTROLLER, controller_node
    from hsv.bags.reader import Bag
    from hsv.bags.replay import engine
    from hsv.bags.replay.attached import controller_of, estimated, flown_parameters, refuse_vacuous, supply
    from hsv.flight.assembly import require_trust

    opened = Bag(bag)
    supply(opened, design, scenario)
    refuse_vacuous(opened)
    values = flown_parameters(opened, parameters)
    controller = controller_of(values)
    # The parameters of every node need the controller; in the bag, those of some nodes may lack it.
    values = values.updated({"controller": controller})
    processes = engine.processes_of(controller, estimated(values))
    if node and node not in processes:
        raise ParameterError(f"node = {node!r}: expected {one_of(processes, node)}")
    if node and (rerun or over_dds):
        raise ParameterError(f"node = {node!r}: the whole loop is repeated, expected no --rerun or --over-dds")
    if controller_node(controller).foreign and over_dds:
        raise ParameterError(
            f"controller = {controller!r}: a separate node, which a bag does not start: expected --rerun without "
            "--over-dds, which uses its recorded commands"
        )
    if rerun or node in ("", CONTROLLER.name):
        require_trust(controller, bag, trust)
    names = [node] if node else list(processes)
    results = []
    with output.stages() as progress:
        if over_dds:
            from hsv.graph.replay_over_dds import replay as fly_again

            compared = fly_again(opened, controller, values, progress)
        elif rerun:
            compared = iter(engine.rerun(opened, controller, values, progress))
        else:
            compared = (engine.replay(opened, processes[name], values, progress) for name in names)
        for result in compared:
            results.append(result)
            if not json:
                _print_replay(result)
    failed = [result.process.node.name for result in results if not result.passed]
    if json:
        output.print_json(
            {"bag": str(bag), "passed": not failed, "processes": [_replay_json(result) for result in results]}
        )
    output.print_bag_warnings(opened)
    if failed:
        raise RunError(f"{', '.join(failed)}: differs from the recording in {bag}")


def _print_replay(result: ProcessComparison) -> None:
    messages = sum(topic.actual_count for topic in result.topics)
    line = f"{result.process.node.name:18} {messages:7} messages  "
    padding = sum(topic.different_padding for topic in result.topics)
    different = sum(topic.different_bytes for topic in result.topics) - padding
    largest = [(value, t.topic, name) for t in result.topics for name, value in t.largest.items()]
    if result.identical:
        remark = f" except the padding of {padding}" if padding else ""
        output.say(Text.assemble(line, (f"identical in every byte{remark}", "green")))
    elif not result.passed:
        first = min((t.first for t in result.topics if t.first), key=lambda d: d.step)
        output.say(Text.assemble(line, ("differ", "bold red"), f" {first}"))
    elif largest:
        value, topic, name = max(largest)
        within = f"equal within {result.process.tolerance:g}, {different} differ in bytes"
        output.say(f"{line}{within}: largest {value:.3g} in {topic} {name}")
    else:
        output.say(f"{line}equal in every number, but {different} differ in bytes (sign of zero or NaN)")


def _replay_json(result: ProcessComparison) -> dict[str, Any]:
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
                "first_difference": _difference(topic.first, "recorded", "replayed"),
            }
            for topic in result.topics
        ],
    }


def _difference(difference: Difference | None, expected: str, actual: str) -> dict[str, Any] | None:
    """Return a difference as JSON, or None; ``expected`` and ``actual`` are the keys of its two values."""
    if difference is None:
        return None
    return {
        "step": difference.step,
        "time_s": difference.time_ns * 1e-9,
        "field": difference.field,
        expected: difference.expected,
        actual: difference.actual,
    }


def diff(
    first: BagArgument,
    second: BagArgument,
    tolerance: Annotated[float, Option(help="Absolute and relative tolerance; 0: compare every bit.")] = 0.0,
    json: JsonOption = False,
) -> None:
    """Compare two bags step by step: print the first difference, and the largest difference of every field.

    The exit code is 0 if all step topics are equal, and 1 if not, or if a topic is in one of the bags only.

    Example: hsv diff bags/case1_20260101T000000Z bags/case1_20260102T000000Z
    """
    from hsv.bags.description import TOPICS
    from hsv.bags.diff import compare
    from hsv.bags.reader import Bag

    if not 0.0 <= tolerance < math.inf:
        raise ParameterError(f"tolerance = {tolerance}: expected a finite number, not below zero")
    bags = Bag(first), Bag(second)
    # A topic that is in neither bag is not a difference.
    topics = [topic for topic in TOPICS if all(topic in bag.roles for bag in bags)]
    alone = {topic: bag for bag in bags for topic in TOPICS if topic in bag.roles and topic not in topics}
    if not topics:
        raise RecordingError(f"{bags[1].path}: no step topic that {bags[0].path} has, too")
    compared = [compare(bags[0].track(topic), bags[1].track(topic), tolerance=tolerance) for topic in topics]
    earliest = min((c.first for c in compared if c.first), key=lambda d: d.time_ns, default=None)
    units = {
        c.topic: {
            name: bags[0].units(c.topic)[name].together(math.prod(bags[0].columns(c.topic)[name].shape[1:]))
            for name in c.largest
        }
        for c in compared
        if c.largest
    }
    if json:
        found = _difference(earliest, "first", "second")
        output.print_json(
            {
                "equal": earliest is None and not alone,
                "identical": all(c.identical for c in compared) and not alone,
                "in_one_only": {bag.name_of(topic): str(bag.path) for topic, bag in alone.items()},
                "first_difference": found and earliest and {"topic": earliest.topic, **found},
                "largest_difference": {c.topic: c.largest for c in compared if c.largest},
                "units": units,
                "messages": {c.topic: [c.expected_count, c.actual_count] for c in compared},
                "messages_of_the_same_step": {c.topic: c.common_count for c in compared},
            }
        )
    else:
        output.say(*(f"{bag.name_of(topic)} is in {bag.path} only" for topic, bag in alone.items()))
        _print_comparison(compared, earliest, units)
    output.print_bag_warnings(*bags)
    raise typer.Exit(1 if earliest or alone else 0)


def _print_comparison(
    compared: list[Comparison], earliest: Difference | None, units: dict[str, dict[str, str]]
) -> None:
    count = sum(c.actual_count for c in compared)
    common = sum(c.common_count for c in compared)
    if earliest is None:
        padding = sum(c.different_padding for c in compared)
        identical = f"identical{f' in every byte except the padding of {padding}' if padding else ''}"
        output.say(
            f"{count} messages: {identical if all(c.identical for c in compared) else 'equal within the tolerance'}"
        )
    else:
        output.say(output.folded(f"first difference at t = {earliest.time_ns * 1e-9:.2f} s: {earliest}"))
        if common < max(sum(c.expected_count for c in compared), count):
            equal = "" if any(c.largest for c in compared) else ", and they are equal"
            output.say(f"{common} messages of the same steps are compared{equal}")
    table = output.new_table("topic", "field", "largest difference")
    for comparison in compared:
        for name, value in comparison.largest.items():
            unit = units[comparison.topic][name]
            number = f"{significant(value)} {'(mixed units)' if ',' in unit else unit}".rstrip()
            table.add_row(comparison.topic, name, "no number" if math.isnan(value) else number)
    if table.row_count:
        output.console.print(table)


def export(
    bag: BagArgument,
    form: Annotated[str, Option("--format", help="csv, parquet, npz, or mat for MATLAB and Octave.")] = "",
    csv: Annotated[bool, Option("--csv", help="A folder of CSV files, one per topic.")] = False,
    parquet: Annotated[bool, Option("--parquet", help="A folder of Parquet files, one per topic.")] = False,
    npz: Annotated[bool, Option("--npz", help="One .npz file.")] = False,
    scene: Annotated[bool, Option("--scene", help="A copy of the bag with the vehicle in 3-D, and a layout.")] = False,
    exaggeration: Annotated[float | None, Option(help="Factor on the bending in the scene.")] = None,
    topic: Annotated[
        list[str] | None, Option(help="Topic to export, repeatable; default: all with a message per step.")
    ] = None,
    out: Annotated[Path | None, Option(help="What to write; default: in the bag's folder.")] = None,
    json: JsonOption = False,
) -> None:
    """Write the topics of a bag as tables with field names and units (SI), or a copy of the bag with a 3-D scene.

    Foxglove and Lichtblick open the copy; import the layout there, which has the topic names of the bag. A mat file is
    for MATLAB and Octave: a structure per topic, with the units in its field "units".

    Example: hsv export bags/case1_20260101T000000Z --format mat --topic /hsv/state
    """
    from hsv.bags import export as tables
    from hsv.bags.description import TOPICS
    from hsv.bags.reader import Bag

    formats = [*tables.Format]
    if form and form not in formats:
        raise ParameterError(f"format = {form!r}: expected {one_of(formats, form)}")
    flags = {"csv": csv, "parquet": parquet, "npz": npz, form: bool(form)}
    if out and not scene and not any(flags.values()) and out.suffix[1:] in formats:
        flags[out.suffix[1:]] = True
    chosen = [tables.Format(name) for name, given in flags.items() if given]
    if len(chosen) + scene != 1:
        raise ParameterError("format: choose --csv, --parquet, --npz, --scene or --format mat, or a suffix of --out")
    opened = Bag(bag)
    if scene:
        from hsv.pages.airframe.geometry import airframe
        from hsv.pages.scene_file import scene_path, write_scene

        if topic:
            raise ParameterError("topic: expected with a table, --scene holds every topic")
        most = airframe().largest_exaggeration
        if exaggeration is not None and not 0.0 <= exaggeration <= most:
            raise ParameterError(f"exaggeration = {exaggeration:g}: expected a number from 0 to {most:g}")
        out = out or scene_path(opened)
        written = [out, write_scene(opened, out, exaggeration)]
    else:
        if exaggeration is not None:
            raise ParameterError("exaggeration: expected with --scene, tables hold what was recorded")
        # Tables are written into the bag's folder, so that bags/* contains bags only.
        home = opened.folder.absolute()
        out = out or home / (f"{home.name}.{chosen[0]}" if chosen[0].single else chosen[0])
        written = tables.export(opened, topic or [name for name in TOPICS if name in opened.roles], chosen[0], out)
    output.print_written(written, json)
    output.print_bag_warnings(opened)


def recover(
    bag: BagArgument,
    out: Annotated[Path | None, Option(help="Bag to write; default: the old name with _recovered.")] = None,
    json: JsonOption = False,
) -> None:
    """Write a new bag from the intact data of a truncated or damaged one, which is not modified.

    The loss is reported in messages and in seconds of simulated time.

    Example: hsv recover bags/case1_20260101T000000Z
    """
    from hsv.bags.reader import Bag
    from hsv.bags.recover import recover as mend
    from hsv.bags.steps import irregularities, loss_in_words, lost_seconds

    recovery = mend(bag, out)
    kept = Bag(recovery.path)
    start, end = kept.span
    seconds = (end - start) * 1e-9
    lost: float | None
    try:
        lost, missing = lost_seconds(kept), irregularities(kept)
    except RecordingError as error:
        if not recovery.changed:
            raise
        # A definition is damaged: its messages are kept, but cannot be decoded.
        lost, missing = None, [str(error).removeprefix(f"{kept.path}: ")]
    loss = recovery.bag.loss
    if json:
        output.print_json(
            {
                "path": str(recovery.path),
                "changed": recovery.changed,
                "messages": recovery.messages,
                "duration_s": seconds,
                "lost_messages": loss.messages,
                "lost_messages_counted": loss.counted,
                "lost_attachments": loss.attachments,
                "lost_s": lost,
                "loss": loss_in_words(loss) + missing,
            }
        )
        return
    complete = "" if recovery.changed else "already complete: "
    output.say(f"{recovery.path}: {complete}{recovery.messages} messages, {seconds:.2f} s")
    if recovery.changed:
        output.say(*loss_in_words(loss))
        if lost != 0.0:
            output.say(f"{'an unknown time' if lost is None else f'{lost:.2f} s'} lost: {'; '.join(missing)}")


def play(
    bag: BagArgument,
    rate: Annotated[float, Option(help="Pace: 1 is as recorded, 10 ten times as fast.")] = 1.0,
    topic: Annotated[list[str] | None, Option(help="Topic to publish, can be repeated; default: all.")] = None,
    clock: Annotated[bool, Option(help="Publish the clock.")] = True,
    namespace: Annotated[str, Option(help="ROS namespace to publish in; default: that of the bag.")] = "",
    delay: Annotated[float, Option(help="Wall time (s) that subscribers get to discover the player.")] = 1.0,
) -> None:
    """Republish a bag over DDS, for a viewer or a node under test.

    Example: hsv play bags/case1_20260101T000000Z --rate 10 --topic /hsv/state
    """
    from hsv.bags.description import PLAYER
    from hsv.bags.reader import Bag
    from hsv.graph.launcher import become

    output.print_bag_warnings(Bag(bag))
    words = [str(bag), "--rate", str(rate), "--delay", str(delay), *(["--topics", *topic] if topic else [])]
    become(PLAYER, [*words, *([] if clock else ["--no-clock"])], namespace)
