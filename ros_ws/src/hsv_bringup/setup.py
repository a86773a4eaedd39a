from pathlib import Path
from xml.etree import ElementTree

from setuptools import setup

manifest = ElementTree.parse(Path(__file__).resolve().with_name("package.xml"))

setup(
    name="hsv_bringup",
    version=manifest.findtext("version"),
    packages=["hsv_bringup"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_bringup"]),
        ("share/hsv_bringup", ["package.xml"]),
        ("share/hsv_bringup/config", ["config/lossy_network.xml"]),
        ("share/hsv_bringup/launch", ["launch/sil.launch.py"]),
    ],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "composed = hsv_bringup.composed:main",
            "recorder = hsv_bringup.recorder:main",
            "live = hsv_bringup.live:main",
            "client = hsv_bringup.commands:main",
            "player = hsv_bringup.player:main",
            "ring = hsv_bringup.ring:main",
        ]
    },
)
