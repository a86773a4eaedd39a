"""Which installer the set-up uses."""

import os
from pathlib import Path

import pytest

from hsv_setup import console, environment
from hsv_setup.console import Stage
from hsv_setup.routes import JAZZY, WHEELS

WANTED = ["--requirement", "some.txt"]


@pytest.fixture
def stage(tmp_path, monkeypatch):
    monkeypatch.setattr(console, "ROOT", tmp_path)
    monkeypatch.setattr(console, "LOG", tmp_path / "log")
    monkeypatch.setattr(environment, "PYTHON", program(tmp_path / "python3", 'echo "$PIP_SETTINGS"'))
    monkeypatch.setattr(environment, "_UV", program(tmp_path / "uv", 'exit "$UV_EXIT"'))
    return Stage("Trial", "trial")


def program(path: Path, line: str) -> Path:
    """Write a program in the place of another one."""
    path.write_text(f"#!/bin/sh\n{line}\n")
    path.chmod(0o755)
    return path


def installed_with(stage, route, uv_exit):
    """Return which installers are called, and for what, where uv ends with the exit code ``uv_exit``."""
    environment._install(route, WANTED, {"PATH": os.defpath, "UV_EXIT": uv_exit}, stage)
    lines = [line.split() for line in stage.log.read_text().splitlines() if line.startswith("+ ")]
    return [
        (Path(words[1]).name, word)
        for words in lines
        for word in ("install", "uninstall")
        if word in words and (word == "uninstall" or words[-2:] == WANTED)
    ]


def test_uv_installs(stage):
    assert installed_with(stage, WHEELS, "0") == [("uv", "install")]


def test_where_uv_fails_pip_installs_and_uv_is_taken_away(stage):
    assert installed_with(stage, WHEELS, "1") == [("uv", "install"), ("python3", "uninstall"), ("python3", "install")]


def test_beside_an_installed_ros_pip_installs(stage):
    assert installed_with(stage, JAZZY, "0") == [("python3", "install")]


@pytest.mark.parametrize(
    ("settings", "fetched"),
    [("global.timeout='60'", True), (":env:.index-url='https://mirror.example/simple'", False)],
)
def test_uv_is_not_used_where_pip_is_told_an_index(stage, settings, fetched):
    environment._install_installer(WHEELS, {"PATH": os.defpath, "PIP_SETTINGS": settings}, stage)
    said = stage.log.read_text()
    assert ("requirements-setup.txt" in said) == fetched
    assert ("uninstall --yes uv" in said) != fetched
