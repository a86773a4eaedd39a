from pathlib import Path
from xml.etree import ElementTree

from setuptools import setup

manifest = ElementTree.parse(Path(__file__).resolve().with_name("package.xml"))

setup(
    name="hsv_plant",
    version=manifest.findtext("version"),
    packages=["hsv_plant"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_plant"]),
        ("share/hsv_plant", ["package.xml"]),
    ],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": ["plant = hsv_plant.plant:main", "fault_injector = hsv_plant.fault_injector:main"]
    },
)
