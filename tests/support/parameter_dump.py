"""A script, called with DIRECTORY NODE [NODE...], that writes parameters as ``ros2 param dump`` does."""

import sys
from pathlib import Path

import rclpy
import yaml
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import parameter_value_to_python


def dump(node, name):
    """Return the parameters of node ``name`` (full name) in the format of ``ros2 param dump``."""

    def call(kind, service, request):
        client = node.create_client(kind, f"{name}/{service}")
        while not client.wait_for_service(1.0):
            pass
        future = client.call_async(request)
        rclpy.spin_until_future_complete(node, future)
        return future.result()

    names = sorted(call(ListParameters, "list_parameters", ListParameters.Request()).result.names)
    values = call(GetParameters, "get_parameters", GetParameters.Request(names=names)).values
    tree = {}
    for full, value in zip(names, values, strict=True):
        *groups, last = full.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        plain = parameter_value_to_python(value)
        branch[last] = plain.tolist() if hasattr(plain, "tolist") else plain
    return yaml.dump({name: {"ros__parameters": tree}}, default_flow_style=False)


if __name__ == "__main__":
    rclpy.init()
    dumper = rclpy.create_node("dumper")
    for node_name in sys.argv[2:]:
        Path(sys.argv[1], f"{node_name.rpartition('/')[2]}.yaml").write_text(dump(dumper, node_name))
