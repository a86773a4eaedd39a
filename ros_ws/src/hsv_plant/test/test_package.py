"""Smoke test for colcon test: every module and executable of the package loads."""

from importlib import import_module
from importlib.metadata import distribution
from pkgutil import iter_modules

import hsv_plant


def test_modules_and_executables_load():
    for module in iter_modules(hsv_plant.__path__):
        import_module(f"hsv_plant.{module.name}")
    assert all(callable(script.load()) for script in distribution("hsv_plant").entry_points)
