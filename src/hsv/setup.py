from setuptools import find_packages, setup

setup(
    name="hsv",
    version="0.1.0",
    packages=find_packages(include=["hsv", "hsv.*"]),
    package_data={
        "hsv": [
            "py.typed",
            "**/*.toml",
            "bench/*.c",
            "campaign/template/*",
            "recording/layouts/*",
            "recording/report/plotly/*",
            "recording/report/template/*",
        ]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv"]),
        ("share/hsv", ["package.xml"]),
    ],
    python_requires=">=3.11,<3.13",
    install_requires=[
        "clarabel",
        "cvxpy",
        "dask",
        "distributed",
        "jinja2",
        "lz4",
        "markupsafe",
        "matplotlib",
        "mcap",
        "numba",
        "numpy",
        "pint",
        "piqp",
        "pyarrow",
        "pydantic",
        "pyyaml",
        "rich",
        "rosbags",
        "scipy",
        "tomli-w",
        "typer",
        "zstandard",
    ],
    zip_safe=False,
    maintainer="HSV bench maintainers",
    maintainer_email="maintainers@hsv-bench.invalid",
    description="Model, design, control and recording of a flexible air-breathing hypersonic vehicle.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": ["hsv = hsv.cli.main:main"],
        "hsv.controllers": [
            "tube_mpc = hsv.control.tube_law:TubeLaw",
            "robust_mpc = hsv.control.robust_mpc:RobustMpc",
        ],
    },
)
