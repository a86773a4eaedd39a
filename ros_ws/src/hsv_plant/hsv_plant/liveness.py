"""Finding out which node of a stuck graph does not answer any more."""

from __future__ import annotations

from collections.abc import Sequence

import rclpy
from rcl_interfaces.srv import ListParameters
from rclpy.node import Node
from rclpy.task import Future

from hsv.graph.progress import Standstill


def unresponsive(node: Node, peers: Sequence[str], wait: float = 2.0) -> list[str]:
    """Return those of ``peers`` whose parameter service does not answer while no other does for ``wait`` (s).

    Every node has that service, so that a hung process is told from one that only waits for somebody else.
    """
    helper = rclpy.create_node(f"{node.get_name()}_liveness", context=node.context)
    try:
        futures: dict[str, Future] = {}
        standstill, answers = Standstill(), 0
        clients = {peer: helper.create_client(ListParameters, f"/{peer}/list_parameters") for peer in peers}
        while standstill.look((len(futures), answers)) < wait and answers < len(peers):
            for peer, client in clients.items():
                if peer not in futures and client.service_is_ready():
                    futures[peer] = client.call_async(ListParameters.Request())
            rclpy.spin_once(helper, timeout_sec=0.05)
            answers = sum(future.done() for future in futures.values())
        return [peer for peer in peers if peer not in futures or not futures[peer].done()]
    finally:
        helper.destroy_node()
