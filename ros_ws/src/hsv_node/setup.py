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
)
