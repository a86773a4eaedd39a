from pathlib import Path
from xml.etree import ElementTree

from setuptools import setup

manifest = ElementTree.parse(Path(__file__).resolve().with_name("package.xml"))

setup(
    name="hsv_node",
    version=manifest.findtext("version"),
    packages=["hsv_node"],
    package_data={"hsv_node": ["fastdds.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_node"]),
        ("share/hsv_node", ["package.xml"]),
    ],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    maintainer="HSV bench maintainers",
    maintainer_email="maintainers@hsv-bench.invalid",
    description="What every node of the bench shares: lockstep links, parameters, message conversion, start and stop.",
    license="Apache-2.0",
)
