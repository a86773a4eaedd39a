from pathlib import Path
from xml.etree import ElementTree

from setuptools import setup

manifest = ElementTree.parse(Path(__file__).resolve().with_name("package.xml"))

setup(
    name="hsv_bench",
    version=manifest.findtext("version"),
    packages=["hsv_bench"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_bench"]),
        ("share/hsv_bench", ["package.xml"]),
    ],
    zip_safe=False,
    maintainer="HSV bench maintainers",
    maintainer_email="maintainers@hsv-bench.invalid",
    description="Bare ROS 2 processes that the graph is measured against.",
    license="Apache-2.0",
    entry_points={"console_scripts": ["ring = hsv_bench.ring:main"]},
)
