from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

manifest = ElementTree.parse(Path(__file__).resolve().with_name("package.xml"))

setup(
    name="hsv_paper",
    version=manifest.findtext("version"),
    packages=find_packages(include=["hsv_paper", "hsv_paper.*"]),
    package_data={"hsv_paper": ["**/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_paper"]),
        ("share/hsv_paper", ["package.xml"]),
    ],
    install_requires=["hsv[design,report]"],
    zip_safe=False,
    maintainer=manifest.findtext("maintainer"),
    maintainer_email=manifest.find("maintainer").get("email"),
    description="Figures and claims of the paper, and what its choices are sensitive to.",
    license="Apache-2.0",
    entry_points={"console_scripts": ["hsv-paper = hsv_paper.cli:main"]},
)
