"""The version of a release: all files, or none."""

import re
import shutil
from pathlib import Path

import pytest
import yaml
from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import parse_package

from release import released

ROOT = Path(__file__).parents[2]


def manifests(root):
    """Return the manifest of every package of a checkout."""
    return sorted([*root.glob("src/*/package.xml"), *root.glob("ros_ws/src/hsv_*/package.xml")])


@pytest.fixture
def checkout(tmp_path):
    """A copy of the files that a release changes, with something in every changelog to release."""
    for manifest in manifests(ROOT):
        folder = tmp_path / manifest.parent.relative_to(ROOT)
        folder.mkdir(parents=True)
        shutil.copy(manifest, folder)
        text = (manifest.parent / "CHANGELOG.rst").read_text(encoding="utf-8")
        head, newest, rest = re.split(r"^(?=\S.*\n-+\n)", text, maxsplit=2, flags=re.MULTILINE)
        if not newest.startswith("Forthcoming"):
            rest, newest = newest + rest, "Forthcoming\n-----------\n* Something\n\n"
        (folder / "CHANGELOG.rst").write_text(head + newest + rest, encoding="utf-8")
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
        changelog = get_changelog_from_path(str(manifest.with_name("CHANGELOG.rst")))
        assert f"{changelog.get_date_of_version('90.1.2'):%Y-%m-%d}" == "2030-04-05"
        assert changelog.get_content_of_version("90.1.2")
    assert "## Unreleased\n\n## 90.1.2 - 2030-04-05\n\n### " in (checkout / "CHANGELOG.md").read_text(encoding="utf-8")
    citation = yaml.safe_load((checkout / "CITATION.cff").read_text(encoding="utf-8"))
    assert (citation["version"], citation["date-released"]) == ("90.1.2", "2030-04-05")


@pytest.mark.parametrize("version", ["1.2", "v1.2.3", "0.0.1", ""])
def test_a_version_that_is_none_or_not_above_is_refused(checkout, version):
    with pytest.raises(ValueError, match=r"^version = "):
        released(checkout, version, "2030-04-05")


@pytest.mark.parametrize("name", ["CHANGELOG.md", "src/hsv/CHANGELOG.rst", "CITATION.cff"])
def test_a_file_with_nothing_to_release_is_named(checkout, name):
    (checkout / name).write_text("empty\n", encoding="utf-8")
    with pytest.raises(ValueError, match=re.escape(str(checkout / name))):
        released(checkout, "90.1.2", "2030-04-05")
