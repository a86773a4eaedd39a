from setuptools import setup

setup(
    name="hsv_plant",
    version="0.1.0",
    packages=["hsv_plant"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_plant"]),
        ("share/hsv_plant", ["package.xml"]),
    ],
    zip_safe=False,
    maintainer="HSV bench maintainers",
    maintainer_email="maintainers@hsv-bench.invalid",
    description="The vehicle plant and the fault injector.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "plant = hsv_plant.plant:main",
            "fault_injector = hsv_plant.fault_injector:main",
        ],
    },
)
