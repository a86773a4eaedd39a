"""Build file of the example as a package of a ROS 2 workspace."""

from setuptools import setup

setup(
    name="hsv_example_node",
    version="0.1.0",
    packages=["hsv_example_node"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_example_node"]),
        ("share/hsv_example_node", ["package.xml"]),
    ],
    entry_points={"console_scripts": ["regulator = hsv_example_node.regulator:main"]},
)
