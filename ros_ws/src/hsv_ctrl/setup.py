from pathlib import Path
from xml.etree import ElementTree

from setuptools import setup

manifest = ElementTree.parse(Path(__file__).resolve().with_name("package.xml"))

setup(
    name="hsv_ctrl",
    version=manifest.findtext("version"),
    packages=["hsv_ctrl"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_ctrl"]),
        ("share/hsv_ctrl", ["package.xml"]),
    ],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "controller = hsv_ctrl.blocks:controller",
            "notch_filter = hsv_ctrl.blocks:notch_filter",
            "nominal_trajectory = hsv_ctrl.nominal_trajectory:main",
            "robust_mpc = hsv_ctrl.tube_mpc:robust_main",
            "tube_mpc = hsv_ctrl.tube_mpc:main",
        ]
    },
)
