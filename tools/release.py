"""Give all packages the version of a release.

    python3 tools/release.py 1.1.0

The version stands in the package.xml of every package, where colcon, rosdep and bloom read it; setup.py takes it from
there, and so do hsv.__version__ and "hsv --version". This program writes it to all of them and to CITATION.cff, and
heads what is "Forthcoming" (CHANGELOG.rst of every package) and "Unreleased" (CHANGELOG.md) with it and today's date:
all files, or none where one is not as expected.
"""

from __future__ import annotations

import argparse
import datetime
import re
import sys
from pathlib import Path

from hsv_setup.paths import ROOT


class ReleaseError(Exception):
    """A file is not as a release needs it; one line names it."""


def manifests(root: Path) -> list[Path]:
    """Return the package.xml of every package of the checkout at ``root``."""
    return sorted([*root.glob("src/*/package.xml"), *root.glob("ros_ws/src/*/package.xml")])


def released(root: Path, version: str, date: str) -> dict[Path, str]:
    """Return the new text of every file that changes with a release.

    Args:
        root: Of the checkout.
        version: Three numbers, above those of now.
        date: As 2026-11-30.

    Raises:
        ReleaseError: The version, or a file.
    """
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        raise ReleaseError(f"version = {version!r}: expected three numbers, as 1.2.0")
    texts = {}
    for manifest in manifests(root):
        text = _replaced(manifest, r"(?<=<version>)(\d+\.\d+\.\d+)(?=</version>)", version)
        now = re.search(r"<version>(.*)</version>", manifest.read_text(encoding="utf-8"))
        if now and _numbers(now[1]) >= _numbers(version):
            raise ReleaseError(f"version = {version!r}: expected one above {now[1]}, of {manifest}")
        texts[manifest] = text
        changelog = manifest.with_name("CHANGELOG.rst")
        heading = f"{version} ({date})"
        texts[changelog] = _replaced(changelog, r"^Forthcoming\n-+\n(?=\* )", f"{heading}\n{'-' * len(heading)}\n")
    changes, citation = root / "CHANGELOG.md", root / "CITATION.cff"
    texts[changes] = _replaced(changes, r"^## Unreleased\n(?=\n*###)", f"## Unreleased\n\n## {version} - {date}\n")
    texts[citation] = _replaced(citation, r"^version: \S+\ndate-released: \S+$", _cited(version, date))
    return texts


def _replaced(path: Path, pattern: str, text: str) -> str:
    replaced, count = re.subn(pattern, text, path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    if count != 1:
        raise ReleaseError(f"{path}: {count} times what {pattern!r} finds, expected it once")
    return replaced


def _cited(version: str, date: str) -> str:
    return f'version: {version}\ndate-released: "{date}"'


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(map(int, version.split(".")))


def main() -> int:
    """Write all files of a release, or none."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("version", help="of the release, as 1.1.0")
    arguments = parser.parse_args()
    try:
        texts = released(ROOT, arguments.version, datetime.datetime.now(datetime.UTC).date().isoformat())
    except ReleaseError as error:
        print(f"release: {error}", file=sys.stderr)
        return 2
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")
        print(path.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
