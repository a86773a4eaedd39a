"""Launch the whole graph of the bench on a full ROS 2 installation, from the same description as ``hsv run``.

ros2 launch hsv_bringup sil.launch.py scenario:=case1
"""

from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from hsv.graph.preparation import PreparedRun, prepare
from launch import LaunchContext, LaunchDescription

_prepared: list[PreparedRun] = []
"""Kept for as long as the launch file runs: with it goes the folder of parameter files."""


def _nodes(context: LaunchContext) -> list[object]:
    prepared = prepare(
        LaunchConfiguration("scenario").perform(context),
        real_time_factor=float(LaunchConfiguration("real_time_factor").perform(context)),
    )
    _prepared.append(prepared)
    nodes = [
        Node(
            package=node.package,
            executable=node.executable,
            output="screen",
            parameters=[str(path) for path in prepared.parameter_files],
        )
        for node in prepared.nodes
    ]
    # Whoever ends first ends the run: the plant when the flight is over, any other node when something went wrong.
    watch = [
        RegisterEventHandler(OnProcessExit(target_action=node, on_exit=[EmitEvent(event=Shutdown())])) for node in nodes
    ]
    return [*nodes, *watch]


def generate_launch_description() -> LaunchDescription:
    """Return the six nodes of the graph with the parameters of a scenario."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("scenario", default_value="case1", description="name or path of a scenario"),
            DeclareLaunchArgument(
                "real_time_factor", default_value="0.0", description="0: as fast as possible, 1: real time"
            ),
            OpaqueFunction(function=_nodes),
        ]
    )
