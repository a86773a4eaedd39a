"""What makes a package of the workspace be built again, and what does not."""

import pytest

from hsv_setup.routes import WHEELS
from hsv_setup.workspace import Package, packages


def write(path, text=""):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.fixture
def python_package(tmp_path):
    for name in (
        "package.xml",
        "setup.py",
        "setup.cfg",
        "flyer/__init__.py",
        "flyer/node.py",
        "flyer/core/loop.h",
        "launch/a.launch.py",
    ):
        write(tmp_path / name)
    return Package("flyer", tmp_path, is_python=True)


@pytest.fixture
def message_package(tmp_path):
    for name in ("package.xml", "CMakeLists.txt", "msg/State.msg"):
        write(tmp_path / name)
    return Package("flyer_msgs", tmp_path, is_python=False)


@pytest.mark.parametrize("name", ["flyer/node.py", "flyer/new.py", "launch/a.launch.py", "flyer/__pycache__/node.pyc"])
def test_linked_files_need_no_build(python_package, name):
    before = python_package.key(WHEELS)
    write(python_package.path / name, "changed")
    assert python_package.key(WHEELS) == before


@pytest.mark.parametrize(
    "name", ["package.xml", "setup.py", "setup.cfg", "flyer/core/loop.h", "flyer/core/new.c", "launch/new.launch.py"]
)
def test_what_is_read_or_newly_linked_needs_a_build(python_package, name):
    before = python_package.key(WHEELS)
    write(python_package.path / name, "changed")
    assert python_package.key(WHEELS) != before


def test_a_removed_data_file_needs_a_build(python_package):
    before = python_package.key(WHEELS)
    (python_package.path / "launch/a.launch.py").unlink()
    assert python_package.key(WHEELS) != before


@pytest.mark.parametrize("name", ["package.xml", "CMakeLists.txt", "msg/State.msg", "msg/New.msg", "srv/New.srv"])
def test_every_file_of_an_interface_package_counts(message_package, name):
    before = message_package.key(WHEELS)
    write(message_package.path / name, "changed")
    assert message_package.key(WHEELS) != before


def test_the_workspace_is_found():
    found = {package.name: package.is_python for package in packages()}
    assert found["hsv"]
    assert not found["hsv_msgs"]
    assert {"hsv_plant", "hsv_ctrl", "hsv_bringup"} <= set(found)
