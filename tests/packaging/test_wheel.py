"""The package, installed by pip without ROS in virtual environments with the newest and oldest libraries allowed.

Needs a package index; without one, the tests are skipped with this reason.
"""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
from importlib.metadata import PathDistribution
from pathlib import Path
from zipfile import Path as ZipPath
from zipfile import ZipFile

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
BAG = ROOT / "bags" / "reference" / "case1"
BUILD_SDIST = "import sys; from setuptools import build_meta; print(build_meta.build_sdist(sys.argv[1]))"

pytestmark = pytest.mark.long


def run(*command, cwd=None):
    """Run a command with an empty environment except for the settings of the package index."""
    handed_on = {
        name: value for name, value in os.environ.items() if name.startswith("PIP_") or "proxy" in name.lower()
    }
    env = {"PATH": os.defpath, "HOME": os.environ.get("HOME", "/"), "LANG": "C.UTF-8", **handed_on}
    return subprocess.run([str(word) for word in command], cwd=cwd, env=env, capture_output=True, text=True)


def checked(*command, cwd=None):
    ran = run(*command, cwd=cwd)
    assert ran.returncode == 0, f"{command}: {ran.stdout}{ran.stderr}"
    return ran.stdout


@pytest.fixture(scope="module")
def index():
    """Skip the tests if pip finds no package index."""
    asked = run(sys.executable, "-m", "pip", "index", "versions", "setuptools")
    if asked.returncode:
        pytest.skip(f"no package index: {asked.stderr.strip().splitlines()[-1]}")


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    """Build the source distribution from a copy of the sources, including the link that leads out of them."""
    folder = tmp_path_factory.mktemp("sources")
    made = shutil.ignore_patterns("__pycache__", "*.egg-info", "build")
    shutil.copytree(ROOT / "src" / "hsv", folder / "src" / "hsv", symlinks=True, ignore=made)
    shutil.copytree(ROOT / "offline_design", folder / "offline_design")
    said = checked(sys.executable, "-c", BUILD_SDIST, folder, cwd=folder / "src" / "hsv")
    return folder / said.splitlines()[-1]


@pytest.fixture(scope="module")
def wheel(sdist, index):
    """Build the wheel from the source distribution only."""
    folder = sdist.parent / "wheel"
    checked(sys.executable, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", folder, sdist)
    (wheel,) = folder.glob("hsv-*.whl")
    return wheel


@pytest.fixture
def environment(tmp_path):
    """Return a function that creates a virtual environment, installs into it, and returns its ``bin`` folder."""

    def make(*words):
        checked(sys.executable, "-m", "venv", tmp_path / "venv")
        folder = tmp_path / "venv" / "bin"
        checked(folder / "python3", "-m", "pip", "install", "--quiet", *words)
        assert run(folder / "python3", "-c", "import rclpy").returncode == 1
        return folder

    return make


def fly(folder, cwd):
    """Fly Case 1 and check that the flight has the published fingerprint."""
    table = tomllib.loads((ROOT / "src/hsv/hsv/flight/fingerprints.toml").read_text(encoding="utf-8"))
    flown = json.loads(checked(folder / "hsv", "simulate", "case1", "--json", cwd=cwd))
    assert flown["fingerprint"] == table["case1"]["fingerprint"]


def test_both_distributions_hold_every_file_of_the_package(sdist, wheel):
    listed = checked("git", "-C", ROOT, "ls-files", "src/hsv/hsv", "offline_design").split()
    link = "src/hsv/hsv/designs"
    expected = {name.replace("offline_design", link).removeprefix("src/hsv/") for name in listed if name != link}
    with tarfile.open(sdist) as archive:
        in_sdist = {name.partition("/")[2] for name in archive.getnames()}
    assert expected <= in_sdist
    assert {"setup.py", "pyproject.toml", "package.xml", "resource/hsv"} <= in_sdist
    in_wheel = set(ZipFile(wheel).namelist())
    # The paper's claims and figures belong to hsv_paper.
    assert not [name for name in in_wheel if "claims" in name or "figures" in name or name.startswith("hsv_paper")]
    assert {name for name in in_wheel if name.startswith("hsv/")} == expected | {"hsv/core/_core.abi3.so"}
    assert wheel.stem.split("-")[2:4] == ["cp311", "abi3"]  # one wheel for every Python from 3.11 on


def test_a_bare_environment_flies_and_reports(wheel, environment, tmp_path):
    folder = environment(wheel)
    fly(folder, tmp_path)
    words = ("report", BAG, "--out", tmp_path / "report.html")
    refused = run(folder / "hsv", *words, cwd=tmp_path)
    assert refused.returncode == 2
    assert refused.stderr == "hsv: error: needs hsv[report]: pip install './src/hsv[report]'\n"

    checked(folder / "python3", "-m", "pip", "install", "--quiet", f"{wheel}[report]")
    checked(folder / "hsv", *words, cwd=tmp_path)
    assert "</html>" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_the_oldest_libraries_allowed_do(wheel, environment, tmp_path):
    (metadata,) = (path for path in ZipPath(wheel).iterdir() if path.name.endswith(".dist-info"))
    oldest = tmp_path / "oldest.txt"
    with oldest.open("w", encoding="utf-8") as stream:
        for requirement in map(Requirement, PathDistribution(metadata).requires or []):
            (lowest,) = (bound.version for bound in requirement.specifier if bound.operator == ">=")
            stream.write(f"{requirement.name}=={lowest}\n")
    folder = environment(f"{wheel}[all]", "--constraint", oldest)
    fly(folder, tmp_path)
    checked(folder / "hsv", "report", BAG, "--out", tmp_path / "report.html")
    checked(folder / "hsv", "montecarlo", "case1", "--samples", "2", "--seed", "1", cwd=tmp_path)
    checked(folder / "hsv", "export", BAG, "--scene", "--out", tmp_path / "scene.mcap", cwd=tmp_path)
