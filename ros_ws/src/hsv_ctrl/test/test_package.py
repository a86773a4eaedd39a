"""Smoke test for colcon test: every module and executable of the package loads."""

from importlib import import_module
from importlib.metadata import distribution
from pkgutil import iter_modules

import hsv_ctrl


def test_modules_and_executables_load():
    for module in iter_modules(hsv_ctrl.__path__):
        import_module(f"hsv_ctrl.{module.name}")
    assert all(callable(script.load()) for script in distribution("hsv_ctrl").entry_points)
