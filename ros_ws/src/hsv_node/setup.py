from setuptools import setup

setup(
    name="hsv_node",
    version="0.1.0",
    packages=["hsv_node"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/hsv_node"]),
        ("share/hsv_node", ["package.xml"]),
    ],
    zip_safe=False,
    maintainer="HSV bench maintainers",
    maintainer_email="maintainers@hsv-bench.invalid",
    description="What every node of the bench shares: lockstep links, parameters, message conversion, start and stop.",
    license="Apache-2.0",
)
