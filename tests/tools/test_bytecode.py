"""The set-up leaves byte code behind, whether or not Python is told to write any itself."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hsv_setup import bytecode, console
from hsv_setup.console import Stage


@pytest.fixture
def module(tmp_path, monkeypatch):
    monkeypatch.setattr(console, "ROOT", tmp_path)
    monkeypatch.setattr(console, "LOG", tmp_path / "log")
    monkeypatch.setattr(bytecode, "ROOT", tmp_path)
    monkeypatch.setattr(bytecode, "SOURCES", (tmp_path / "src",))
    monkeypatch.setattr(bytecode, "_STAMP", tmp_path / "stamp")
    path = tmp_path / "src" / "flyer.py"
    path.parent.mkdir()
    path.write_text("ALTITUDE = 26000.0\n")
    return path


def test_sources_are_compiled_again_only_when_one_has_changed(module):
    env = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    assert not bytecode.sources_are_current()
    bytecode.compile_sources(Path(sys.executable), env, Stage("Trial", "trial"))
    compiled = Path(importlib.util.cache_from_source(str(module)))
    assert compiled.is_file() and bytecode.sources_are_current()
    os.utime(module, (0, 0))
    assert bytecode.sources_are_current()
    module.write_text("ALTITUDE = 27000.0\n")
    assert not bytecode.sources_are_current()


def test_byte_code_is_not_taken_for_that_of_a_change_within_the_same_second(module):
    os.utime(module, (1e9, 1e9))
    bytecode.compile_sources(Path(sys.executable), os.environ, Stage("Trial", "trial"))
    module.write_text("ALTITUDE = 27000.0\n")
    os.utime(module, (1e9, 1e9))
    program = "import flyer; print(flyer.ALTITUDE)"
    ran = subprocess.run([sys.executable, "-c", program], cwd=module.parent, capture_output=True, text=True)
    assert ran.stdout == "27000.0\n", ran.stderr


def test_what_is_for_another_python_is_left_out(module):
    broken = module.with_name("template.py")
    broken.write_text("{{ not python }\n")
    bytecode.compile_sources(Path(sys.executable), os.environ, Stage("Trial", "trial"))
    assert Path(importlib.util.cache_from_source(str(module))).is_file()
    assert not Path(importlib.util.cache_from_source(str(broken))).exists()


def test_tests_of_installed_packages_are_left_out_wherever_the_checkout_is(module, monkeypatch):
    environment = module.parents[1] / "tests" / "venv"
    monkeypatch.setattr(bytecode, "VENV", environment)
    package = environment / "lib" / "python3.9" / "site-packages" / "package"
    (package / "tests").mkdir(parents=True)
    paths = package / "flyer.py", package / "tests" / "test_flyer.py"
    for path in paths:
        path.write_text("ALTITUDE = 26000.0\n")
    bytecode.compile_packages(Path(sys.executable), os.environ, Stage("Trial", "trial"))
    assert [Path(importlib.util.cache_from_source(str(path))).is_file() for path in paths] == [True, False]
