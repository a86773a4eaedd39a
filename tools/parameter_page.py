"""Write docs/parameters.md. Usage, after "source env.sh": python3 tools/parameter_page.py."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hsv.bags.description import TOPIC_FIELDS
from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.base.parameters import Parameter
from hsv.control.design import DESIGN_PARAMETERS
from hsv.control.nominal_trajectory import NOMINAL_PARAMETERS
from hsv.flight.blocks import LOOP
from hsv.graph.node_parameters import NODE_PARAMETERS
from hsv.model.faults.table import FAULT_KINDS, OCCURRENCE_PARAMETERS
from hsv.model.signals import VARYING
from hsv.model.vehicle import VEHICLE_PARAMETERS

_HEADER = """# Parameters of the nodes
Made by `python3 tools/parameter_page.py` from the tables that the nodes declare. All values are in SI units. A value of
the wrong type or outside its range ends the node before it joins the graph, with one line and exit code 2; floats need
a decimal point (`-p duration:=200.0`). So does an unknown parameter, and the line names the most similar one, unless a
file gives it to all nodes (`/**`): then it is ignored with a warning. A file,
unlike `-p`, may contain parameters of other nodes.
Parameters cannot be changed once a node runs, unless the last column says otherwise.

The output of `ros2 param dump` for a node can be passed to it with `--params-file` and gives the same flight; the
recorder then needs another `bag.directory`, and the files of `bag.attachments` must still exist.

`use_sim_time` may be true for every node; it does not change a bit, because nodes react to messages only. ROS takes the
time from `/clock`; in a namespace, also pass `-r /clock:=/veh1/clock`.
"""

_LOOP = """## The loop
The blocks that a step passes through, in this order. Each is stepped by the node of the same name; the controller is
stepped by the node with the name of the controller.

"""

_SIGNALS = """
The signals and the topics whose messages contain them. A size that depends on the flight is omitted.

"""

_FAULTS = """## Types of faults
In the order in which simultaneous faults act.

"""

_FAULT_PARAMETERS = """
Their channels and parameters, as in `fault.parameters`. Every type also has the parameters of the last rows.

"""


def reference() -> str:
    """Return the parameter reference in Markdown: the loop, its signals, one table per node, and the fault types."""
    parts = [_HEADER, _LOOP + _loop() + _SIGNALS + _signals(), "## Every node\n" + _parameters(LOCKSTEP_PARAMETERS)]
    parts += [f"## {node}\n" + _parameters(table) for node, table in NODE_PARAMETERS.items()]
    return "\n".join([*parts, _FAULTS + _kinds() + _FAULT_PARAMETERS + _faults()])


def _table(columns: str, rows: Iterable[tuple[object, ...]]) -> str:
    titles = columns.split(", ")
    lines = [titles, ["---"] * len(titles), *rows]
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)


def _loop() -> str:
    columns = "block, inputs of the step, inputs of the previous step, outputs, state"
    groups = [(block.inputs, block.delayed, block.outputs, block.state) for block in LOOP]
    words = [[", ".join(signal.name for signal in signals) for signals in row] for row in groups]
    return _table(columns, [(block.name, *row) for block, row in zip(LOOP, words, strict=True)])


def _signals() -> str:
    rows = []
    for signal in (signal for block in LOOP for signal in block.outputs):
        topics = ", ".join(f"`{topic}`" for topic, carried in TOPIC_FIELDS.items() if signal in carried)
        size = "" if signal.size == VARYING else signal.size
        rows.append((signal.name, signal.meaning, size, signal.unit, topics))
    return _table("signal, meaning, numbers, unit, topics", rows)


def _parameters(parameters: Iterable[Parameter]) -> str:
    vehicle = {p.name for p in VEHICLE_PARAMETERS if p.name != "vehicle.name"}
    brought = {p.name for p in (*DESIGN_PARAMETERS, *NOMINAL_PARAMETERS)}
    rows = []
    for p in parameters:
        words = {"[]": "from the design" if p.name in brought else "empty", "": "empty"}
        default = "from the vehicle" if p.name in vehicle else words.get(str(p.default), f"`{p.default}`")
        rows.append((p.name, default, p.constraint, p.description, "" if p.read_only else "yes"))
    return _table("parameter, default, expected, meaning, in flight", rows)


def _kinds() -> str:
    return _table("side, type, meaning", [(kind.side, name, kind.meaning) for name, kind in FAULT_KINDS.items()])


def _faults() -> str:
    rows: list[tuple[object, ...]] = [
        (name, on, p.name, "" if p.default is None else p.default, p.of(on).constraint)
        for name, kind in FAULT_KINDS.items()
        for on in kind.channels
        for p in kind.parameters
    ]
    rows += [("any", "any", p.name, p.default, p.of("engine").constraint) for p in OCCURRENCE_PARAMETERS]
    return _table("type, channel, parameter, default, expected", rows)


if __name__ == "__main__":
    Path(__file__).parents[1].joinpath("docs", "parameters.md").write_text(reference(), encoding="utf-8")
