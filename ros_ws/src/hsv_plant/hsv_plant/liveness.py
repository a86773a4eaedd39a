"""Finding out which node of a stuck graph does not answer any more."""

from __future__ import annotations

from collections.abc import Sequence

import rclpy
from rcl_interfaces.srv import ListParameters
from rclpy.client import Client
from rclpy.task import Future

from hsv.bags.description import NodeDescription
from hsv.graph.standstill import Standstill
from hsv_node.lockstep import LockstepNode


def unresponsive(node: LockstepNode, peers: Sequence[NodeDescription], wait: float = 2.0) -> list[str]:
    """Return the ``peers`` whose parameter service does not answer while no other does for ``wait`` (s).

    Every node has that service, so that a hung process is told from one that only waits for somebody else.
    """
    # Remappings of the node's command line are not for its helper.
    helper = rclpy.create_node(f"{node.get_name()}_liveness", context=node.context, use_global_arguments=False)
    try:
        clients: dict[str, Client] = {}
        futures: dict[str, Future] = {}
        standstill, answers = Standstill(), 0
        while standstill.look((len(futures), answers)) < wait and answers < len(peers):
            for peer in peers:
                if peer.name not in clients and (name := node.node_in_role(peer)):
                    clients[peer.name] = helper.create_client(ListParameters, f"{name}/list_parameters")
            for peer_name, client in clients.items():
                if peer_name not in futures and client.service_is_ready():
                    futures[peer_name] = client.call_async(ListParameters.Request())
            rclpy.spin_once(helper, timeout_sec=0.05)
            answers = sum(future.done() for future in futures.values())
        return [peer.name for peer in peers if peer.name not in futures or not futures[peer.name].done()]
    finally:
        helper.destroy_node()
