"""The processes that can be replayed, with their tolerances."""

from __future__ import annotations

from dataclasses import dataclass

from hsv.bags.description import STATE, NodeDescription, graph
from hsv.flight.blocks import LOOP, VEHICLE, Block

_TOLERANCES = {
    "plant": (
        1e-10,
        "one period from the recorded state: the vehicle alone is unstable, and a longer flight without its controller "
        "would magnify a difference in the last bit",
    ),
    "notch_filter": (
        1e-12,
        "a stable filter, in which rounding errors decay",
    ),
    "nominal_trajectory": (
        1e-10,
        "a contracting system that runs on its own for the whole flight; laws solved in flight stop at a tolerance",
    ),
    "tube_mpc": (1e-10, "the level in the set is a quadratic form whose terms of both signs nearly cancel"),
    "robust_mpc": (1e-12, "one matrix product without memory"),
    "controller": (1e-10, "a custom controller may call libraries that round as their processor does"),
    "fault_injector": (0.0, "one multiplication, the same on every processor"),
}
"""Absolute and relative tolerance of each node, and the reason for it."""


@dataclass(frozen=True)
class Process:
    """A process under test; its ``node`` description has its inputs and outputs."""

    node: NodeDescription
    block: Block

    @property
    def tolerance(self) -> float:
        """Absolute and relative tolerance within which numbers count as equal."""
        return _TOLERANCES[self.node.name][0]

    @property
    def reason(self) -> str:
        """Reason for the tolerance."""
        return _TOLERANCES[self.node.name][1]

    @property
    def restarts(self) -> bool:
        """Whether every step starts from the recorded state and input of the previous step, as for the plant."""
        return self.block is VEHICLE

    @property
    def inputs(self) -> tuple[str, ...]:
        """Topics that a step subscribes to."""
        return (*self.node.subscribes, STATE) if self.restarts else self.node.subscribes

    @property
    def delayed(self) -> tuple[str, ...]:
        """Topics of which a step uses the message of the previous step; the first step has none."""
        return self.inputs if self.restarts else self.node.delayed

    @property
    def outputs(self) -> tuple[str, ...]:
        """Topics that a step publishes."""
        return self.node.publishes


def processes_of(controller: str, estimator: bool = False) -> dict[str, Process]:
    """Return the processes of a graph with ``controller``, by node, in the order in which a step passes through them.

    A controller that is an external node is not among them, because it cannot be repeated here.
    """
    nodes = graph(controller, estimator)
    found = [Process(node, node.block) for node in nodes if node.block is not None and not node.foreign]
    return {process.node.name: process for process in sorted(found, key=lambda found: LOOP.index(found.block))}
