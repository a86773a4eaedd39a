"""The parameter reference of the documentation: ``python -m hsv.graph.reference > docs/parameters.md``."""

from __future__ import annotations

from collections.abc import Iterable

from hsv.control.design_parameters import DESIGN_PARAMETERS
from hsv.control.nominal_trajectory import NOMINAL_PARAMETERS
from hsv.graph.description import CARRIED
from hsv.graph.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.graph.node_parameters import NODE_PARAMETERS
from hsv.parameters import Parameter
from hsv.signals import VARYING
from hsv.simulation.blocks import LOOP
from hsv.vehicle.vehicle import VEHICLE_PARAMETERS

_HEADER = """# Parameters of the nodes
Made by `python -m hsv.graph.reference > docs/parameters.md` from the tables that the nodes declare from. SI units. A
value of the wrong type or outside its range ends the node before it joins the graph, with one line and exit code 2;
floats need a decimal point (`-p duration:=200.0`). So does a parameter that the node does not have, with the nearest
one named; only the sections of a file for all nodes (`/**`) may hold what other nodes have. All are fixed once a node
runs, unless the last column says otherwise.

What `ros2 param dump` writes of a node can be given to it again with `--params-file` and flies the same; the recorder
then needs another `bag.directory`, and `bag.attachments` that are still there.

`use_sim_time` may be true for every node but the plant, which makes the clock; it changes no bit, as nodes answer to
messages only. ROS takes the time from `/clock`: in a namespace it needs `-r /clock:=/veh1/clock` besides.
"""

_LOOP = """## The loop
The blocks that a step passes through, in this order; each is stepped by the node of its name, the controller by that of
its own.

"""

_SIGNALS = """
The signals, with the topics whose messages carry them; a size that depends on the flight is left out.

"""


def reference() -> str:
    """Return the page: the loop, its signals, and one table a node."""
    parts = [_HEADER, _LOOP + _loop() + _SIGNALS + _signals(), "## Every node\n" + _table(LOCKSTEP_PARAMETERS)]
    parts += [f"## {node}\n" + _table(table) for node, table in NODE_PARAMETERS.items()]
    return "\n".join(parts)


def _loop() -> str:
    rows = ["| block | needs of the step | of the step before | gives | keeps |", "| --- | --- | --- | --- | --- |"]
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


if __name__ == "__main__":
    print(reference(), end="")
