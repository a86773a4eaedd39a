"""Give all packages the version of a release: python3 tools/release.py 1.1.0.

The version is written to every package.xml, from which setup.py reads it, and to CITATION.cff. In CHANGELOG.md, the
section "Unreleased" gets the version and today's date as its heading. All files change, or none.
"""

from __future__ import annotations

import datetime
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

MAINTAINER = '<maintainer email="maintainers@example.org">HSV bench maintainers</maintainer>'
"""Name and address in every package.xml; to be filled in by the owner of a repository, here and nowhere else."""


def released(root: Path, version: str, date: str) -> dict[Path, str]:
    """Return the new text of every file below ``root`` that a release changes, by path.

    Raises:
        ValueError: The version is not above the present one, or a file does not have the expected text once.
    """
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        raise ValueError(f"version = {version!r}: expected three numbers, as 1.2.0")
    citation = f'version: {version}\ndate-released: "{date}"'
    changes = {
        root / "CHANGELOG.md": (r"^## Unreleased\n(?=\n*###)", f"## Unreleased\n\n## {version} - {date}\n"),
        root / "CITATION.cff": (r"^version: \S+\ndate-released: \S+$", citation),
    }
    for manifest in sorted([*root.glob("src/*/package.xml"), *root.glob("ros_ws/src/hsv_*/package.xml")]):
        changes[manifest] = (r"(?<=<version>)\d+\.\d+\.\d+(?=</version>)", version)
    texts = {}
    for path, (pattern, new) in changes.items():
        text = path.read_text(encoding="utf-8")
        found = re.findall(pattern, text, re.MULTILINE)
        if len(found) != 1:
            raise ValueError(f"{path}: {pattern!r} is found {len(found)} times, expected once")
        if path.name == "package.xml" and [*map(int, found[0].split("."))] >= [*map(int, version.split("."))]:
            raise ValueError(f"version = {version!r}: expected one above {found[0]}, of {path}")
        texts[path] = re.sub(pattern, new, text, flags=re.MULTILINE)
        texts[path] = re.sub("<maintainer .*</maintainer>", MAINTAINER, texts[path])
    return texts


if __name__ == "__main__":
    try:
        texts = released(ROOT, "".join(sys.argv[1:]), datetime.datetime.now(datetime.UTC).date().isoformat())
    except ValueError as error:
        sys.exit(f"release: {error}")
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")
