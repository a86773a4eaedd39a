"""Smoke test for colcon test: the package's modules and executables load; all node packages pass ament_pep257.

ament_pep257 belongs to a full ROS 2 installation; without it, that test is skipped. Style, types and imports
are checked by make lint.
"""

from importlib import import_module
from importlib.metadata import distribution
from pathlib import Path
from pkgutil import iter_modules

import pytest

import hsv_bringup

SOURCES = sorted(path.parent for path in Path(__file__).parents[2].glob("hsv_*/hsv_*/__init__.py"))


def test_modules_and_executables_load():
    for module in iter_modules(hsv_bringup.__path__):
        import_module(f"hsv_bringup.{module.name}")
    assert all(callable(script.load()) for script in distribution("hsv_bringup").entry_points)


def test_ament_pep257_finds_nothing():
    pep257 = pytest.importorskip("ament_pep257.main")
    ignored = ("D105", "D107", "D417")
    assert pep257.main([*map(str, SOURCES), "--convention", "google", "--add-ignore", *ignored]) == 0
