"""The manifests declare what the packages import, and agree with the changelog and versions."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from catkin_pkg.package import parse_package
from packaging.specifiers import SpecifierSet

import hsv
from release import MAINTAINER, released

ROOT = Path(__file__).parents[2]


def manifests(root):
    """Return the manifests of all packages of a checkout."""
    return sorted([*root.glob("src/*/package.xml"), *root.glob("ros_ws/src/hsv_*/package.xml")])


MANIFESTS = manifests(ROOT)
DISTRIBUTION = {"cffi": "1.16.0", "jinja2": "3.1.2", "numpy": "1.26.4", "rich": "13.7.1", "yaml": "6.0.1"}
"""Versions in Ubuntu 24.04 by imported module. A module that is too old there gets no rosdep key in the manifests."""

KEYS = {name: f"python3-{name}" for name in DISTRIBUTION}
"""rosdep keys by imported module."""

WITHOUT_KEY = {"clarabel", "control", "cvxpy", "distributed", "fmpy", "foxglove", "gymnasium", "lz4", "markupsafe"}
WITHOUT_KEY |= {"matplotlib", "mcap", "pandas", "pint", "piqp", "pyarrow", "pydantic", "rosbags", "scipy", "tomli_w"}
WITHOUT_KEY |= {"typer", "websockets", "zstandard"}
"""Modules for which no rosdep key names a suitable Debian package; see docs/installation.md."""


def imported(folder):
    """Return the modules that a package imports from outside the standard library and itself."""
    found = set()
    for path in folder.rglob("*.py"):
        if path.name == "setup.py" or path.parent == folder / "test":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                found.add(node.module.split(".")[0])
    return found - sys.stdlib_module_names - {folder.name}


@pytest.mark.parametrize("manifest", MANIFESTS, ids=lambda path: path.parent.name)
def test_a_package_declares_what_it_imports_and_nothing_else(manifest):
    package = parse_package(str(manifest))
    warnings: list[str] = []
    package.validate(warnings=warnings)
    assert not warnings
    needed = {KEYS.get(module, module) for module in imported(manifest.parent) - WITHOUT_KEY}
    declared = {dependency.name for dependency in package.exec_depends}
    if not (manifest.parent / "CMakeLists.txt").exists():
        assert declared == needed
    assert package.build_depends == [] or package.name == "hsv" or package.get_build_type() == "ament_cmake"


@pytest.mark.parametrize(
    "manifest", [*MANIFESTS, *ROOT.glob("examples/*/package.xml")], ids=lambda path: path.parent.name
)
def test_a_package_names_its_authors_its_maintainer_and_its_license(manifest):
    package = parse_package(str(manifest))
    assert package.authors and package.maintainers and package.licenses == ["Apache-2.0"]
    assert MAINTAINER in manifest.read_text(encoding="utf-8")
    assert (manifest.parent / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


@pytest.mark.parametrize(("module", "version"), DISTRIBUTION.items())
def test_a_key_stands_for_a_version_that_suffices(module, version):
    bounds = re.findall(rf'"({module.replace("yaml", "pyyaml")})([<>=][^"]*)"', (ROOT / "src/hsv/setup.py").read_text())
    assert [name for name, bound in bounds if SpecifierSet(bound).contains(version)]


def test_modules_without_a_key_are_named_in_the_documentation():
    page = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    assert all(f"`{module.replace('_', '-')}`" in page for module in WITHOUT_KEY)


@pytest.mark.long
def test_colcon_test_runs_the_smoke_test_of_each_package_of_nodes(tmp_path):
    colcon = [sys.executable, "-m", "colcon", "--log-base", str(tmp_path / "log")]
    place = ["--test-result-base", str(tmp_path / "results")]
    subprocess.run([*colcon, "test", "--return-code-on-test-failure", *place], cwd=ROOT / "ros_ws", check=True)
    found = subprocess.run([*colcon, "test-result", "--all", *place], capture_output=True, text=True, check=True).stdout
    for package, tests in {"hsv_bringup": 2, "hsv_ctrl": 1, "hsv_node": 1, "hsv_plant": 1}.items():
        assert re.search(rf"{package}.*pytest.xml: {tests} tests?, 0 errors, 0 failures", found), found


def test_all_packages_have_one_version_which_the_library_and_the_citation_say():
    versions = {parse_package(str(manifest)).version for manifest in MANIFESTS}
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert versions == {hsv.__version__} == {citation["version"]}


@pytest.fixture
def checkout(tmp_path):
    """Return a copy of the files that a release changes, with an entry to release."""
    for manifest in manifests(ROOT):
        folder = tmp_path / manifest.parent.relative_to(ROOT)
        folder.mkdir(parents=True)
        shutil.copy(manifest, folder)
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    changes = re.sub(r"^## Unreleased\n\n(?=## )", "## Unreleased\n\n### Added\n- Something\n\n", changes, flags=re.M)
    (tmp_path / "CHANGELOG.md").write_text(changes, encoding="utf-8")
    shutil.copy(ROOT / "CITATION.cff", tmp_path)
    return tmp_path


def test_every_file_has_the_version_afterwards(checkout):
    for path, text in released(checkout, "90.1.2", "2030-04-05").items():
        path.write_text(text, encoding="utf-8")
    for manifest in manifests(checkout):
        assert parse_package(str(manifest)).version == "90.1.2"
    assert "## Unreleased\n\n## 90.1.2 - 2030-04-05\n\n### " in (checkout / "CHANGELOG.md").read_text(encoding="utf-8")
    citation = yaml.safe_load((checkout / "CITATION.cff").read_text(encoding="utf-8"))
    assert (citation["version"], citation["date-released"]) == ("90.1.2", "2030-04-05")


@pytest.mark.parametrize("version", ["1.2", "v1.2.3", "0.0.1", ""])
def test_a_version_that_is_none_or_not_above_is_refused(checkout, version):
    with pytest.raises(ValueError, match=r"^version = "):
        released(checkout, version, "2030-04-05")


@pytest.mark.parametrize("name", ["CHANGELOG.md", "CITATION.cff"])
def test_a_file_with_nothing_to_release_is_named(checkout, name):
    (checkout / name).write_text("empty\n", encoding="utf-8")
    with pytest.raises(ValueError, match=re.escape(str(checkout / name))):
        released(checkout, "90.1.2", "2030-04-05")
