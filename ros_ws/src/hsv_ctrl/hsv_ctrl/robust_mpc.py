"""The robust MPC controller node, the paper's comparison without a tube (section 5.2)."""

from __future__ import annotations

from collections.abc import Sequence

from hsv.bags.description import ROBUST_MPC
from hsv.control.robust_mpc import ROBUST_MPC_PARAMETERS, RobustMpc
from hsv_ctrl.design import declare_design
from hsv_ctrl.tube import TubeNode
from hsv_node.main import run_node


class RobustMpcNode(TubeNode):
    """One gain about the reference; of the nominal trajectory node it takes the reference alone."""

    def __init__(self) -> None:
        super().__init__(ROBUST_MPC)
        self.component = RobustMpc.from_parameters(*declare_design(self, ROBUST_MPC_PARAMETERS))


def main(args: Sequence[str] | None = None) -> int:
    """Run the robust MPC controller node."""
    return run_node(RobustMpcNode, "robust_mpc", args)
