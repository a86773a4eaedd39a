"""The parameter reference of the documentation: ``python -m hsv.graph.reference > docs/parameters.md``."""

from __future__ import annotations

from collections.abc import Iterable

from hsv.bags.description import CARRIED
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
Made by `python -m hsv.graph.reference > docs/parameters.md` from the tables that the nodes declare. All values are in
SI units. A value of the wrong type or outside its range ends the node before it joins the graph, with one line and exit
code 2; floats need a decimal point (`-p duration:=200.0`). So does an unknown parameter, and the line
names the most similar one; only the sections of a file for all nodes (`/**`) may contain parameters of other nodes.
Parameters cannot be changed once a node runs, unless the last column says otherwise.

The output of `ros2 param dump` for a node can be passed to it with `--params-file` and gives the same flight; the
recorder then needs another `bag.directory`, and the files of `bag.attachments` must still exist.

`use_sim_time` may be true for every node except the plant, which publishes the clock; it does not change a bit, because
nodes react to messages only. ROS takes the time from `/clock`; in a namespace, also pass `-r /clock:=/veh1/clock`.
"""

_LOOP = """## The loop
The blocks that a step passes through, in this order. Each is stepped by the node of the same name; the controller is
stepped by the node with the name of the controller.

"""

_SIGNALS = """
The signals and the topics whose messages contain them. A size that depends on the flight is omitted.

"""

_FAULTS = """## Types of faults
Their channels and parameters, as in `fault.parameters`. Every type also has the parameters of the last rows.

"""


def reference() -> str:
    """Return the page: the loop, its signals, one table per node, and the types of faults."""
    parts = [_HEADER, _LOOP + _loop() + _SIGNALS + _signals(), "## Every node\n" + _table(LOCKSTEP_PARAMETERS)]
    parts += [f"## {node}\n" + _table(table) for node, table in NODE_PARAMETERS.items()]
    return "\n".join([*parts, _FAULTS + _faults()])


def _loop() -> str:
    rows = [
        "| block | inputs of the step | inputs of the previous step | outputs | state |",
        "| --- | --- | --- | --- | --- |",
    ]
    for block in LOOP:
        groups = block.inputs, block.delayed, block.outputs, block.state
        rows.append(f"| {block.name} | {' | '.join(', '.join(s.name for s in group) for group in groups)} |")
    return "\n".join(rows) + "\n"


def _signals() -> str:
    rows = ["| signal | numbers | unit | topics |", "| --- | --- | --- | --- |"]
    for signal in (signal for block in LOOP for signal in block.outputs):
        topics = ", ".join(f"`{topic}`" for topic, carried in CARRIED.items() if signal in carried)
        rows.append(f"| {signal.name} | {'' if signal.size == VARYING else signal.size} | {signal.unit} | {topics} |")
    return "\n".join(rows) + "\n"


def _table(parameters: Iterable[Parameter]) -> str:
    vehicle = {p.name for p in VEHICLE_PARAMETERS if p.name != "vehicle.name"}
    brought = {p.name for p in (*DESIGN_PARAMETERS, *NOMINAL_PARAMETERS)}
    rows = ["| parameter | default | expected | meaning | in flight |", "| --- | --- | --- | --- | --- |"]
    for p in parameters:
        default = {"[]": "from the design" if p.name in brought else "empty", "": "empty"}.get(
            str(p.default), f"`{p.default}`"
        )
        if p.name in vehicle:
            default = "from the vehicle"
        rows.append(f"| {p.name} | {default} | {p.constraint} | {p.description} | {'' if p.read_only else 'yes'} |")
    return "\n".join(rows) + "\n"


def _faults() -> str:
    rows = ["| type | channel | parameter | default | expected |", "| --- | --- | --- | --- | --- |"]
    for name, kind in FAULT_KINDS.items():
        own = [(channel, p, p.of(channel)) for channel in kind.channels for p in kind.parameters]
        rows += [
            f"| {name} | {on} | {p.name} | {p.default if p.default is not None else ''} | {q.constraint} |"
            for on, p, q in own
        ]
    for p in OCCURRENCE_PARAMETERS:
        rows.append(f"| any | any | {p.name} | {p.default} | {p.of('engine').constraint} |")
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    print(reference(), end="")
