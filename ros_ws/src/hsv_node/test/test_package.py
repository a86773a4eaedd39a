"""Smoke test for colcon test, the same in every package: its modules and executables load, and it is documented.

ament_pep257 belongs to a full ROS 2 installation. Style, types and imports are checked by make lint.
"""

from importlib import import_module
from importlib.metadata import distribution
from pathlib import Path
from pkgutil import iter_modules

import pytest

PACKAGE = Path(__file__).parents[1]
SOURCES = str(PACKAGE / PACKAGE.name)


@pytest.mark.parametrize("module", [module.name for module in iter_modules([SOURCES])])
def test_a_module_is_imported(module):
    import_module(f"{PACKAGE.name}.{module}")


def test_executables_load():
    assert all(callable(script.load()) for script in distribution(PACKAGE.name).entry_points)


def test_ament_pep257_finds_nothing():
    pep257 = pytest.importorskip("ament_pep257.main")
    assert pep257.main([SOURCES, "--convention", "google", "--add-ignore", "D105", "D107", "D417"]) == 0
