"""The package's metadata. All of it is here: colcon's --symlink-install shows setuptools this file and no other."""

from itertools import chain
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

manifest = ElementTree.parse(Path(__file__).resolve().with_name("package.xml"))

# Lower bounds are the oldest versions that tests/packaging/test_wheel.py flies; upper ones, the next release that may
# break what is used. Both hold the pins of constraints*.txt.
REQUIRED = [
    "cffi>=1.16,<3",
    "lz4>=4.3.3,<5",
    "mcap>=1.3,<2",
    "numpy>=1.26,<3",
    "pint>=0.24.4,<0.27",
    "piqp>=0.6,<0.8",
    "pydantic>=2.10,<3",
    "pyyaml>=6.0.1,<7",
    "rich>=13.7,<16",
    "rosbags>=0.11,<0.12",
    "scipy>=1.13,<2",
    "tomli-w>=1.0,<2",
    "typer>=0.20,<0.30",
    "zstandard>=0.23,<0.26",
]
EXTRAS = {
    "campaign": ["distributed>=2025.1,<2027", "pyarrow>=18,<27"],
    "design": ["clarabel>=0.10,<0.12", "cvxpy>=1.6,<2"],
    "fmi": ["fmpy>=0.3.22,<0.4"],
    "gym": ["gymnasium>=1.1,<2"],
    "live": ["foxglove-sdk>=0.20,<0.31", "websockets>=14,<18"],
    "notebook": ["control>=0.10,<0.11", "pandas>=2.2,<4"],
    "report": ["jinja2>=3.1,<4", "markupsafe>=2.1.3,<4", "matplotlib>=3.9,<4"],
}

setup(
    name="hsv",
    version=manifest.findtext("version"),
    packages=find_packages(include=["hsv", "hsv.*"]),
    package_data={
        "hsv": [
            "py.typed",
            "**/*.toml",
            "plugins/*.c",
            "flight/*.c",
            "plugins/include/*.h",
            "core/*.[ch]",
            "core/web/*.c",
            "designs/*",
            "pages/template/*",
            "pages/plotly/*",
        ]
    },
    data_files=[("share/ament_index/resource_index/packages", ["resource/hsv"]), ("share/hsv", ["package.xml"])],
    cffi_modules=["hsv/core/build.py:ffibuilder"],
    # The extension uses Python's stable interface, so one wheel serves all versions from this one on.
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
    python_requires=">=3.11,<3.13",
    install_requires=REQUIRED,
    extras_require={**EXTRAS, "all": sorted(chain.from_iterable(EXTRAS.values()))},
    zip_safe=False,
    maintainer=manifest.findtext("maintainer"),
    maintainer_email=manifest.find("maintainer").get("email"),
    description="Model, design, control and recording of a flexible air-breathing hypersonic vehicle.",
    license="Apache-2.0",
    entry_points={"console_scripts": ["hsv = hsv.cli.entry:main"]},
)
