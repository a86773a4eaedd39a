"""Code blocks on pages of the documentation: fenced blocks, and indented blocks, which most pages have."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]

PAGES = sorted(
    subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
)
"""The paths of all pages, relative to the root of the repository."""

_FENCED = re.compile(r"^```(\S*)[^\n]*\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_INDENTED = re.compile(r"(?:^    .*\n)(?:^    .*\n|^\n(?=    ))*", re.MULTILINE)
_FILE = re.compile(r"# (\S+\.(?:toml|py))\n")


class Block(NamedTuple):
    """A code block: its language, empty if not named, and its text."""

    language: str
    text: str

    @property
    def first_line(self):
        """The first line, without a comment that begins with ``#``."""
        return re.sub(r"\s+#\s.*$", "", self.text.partition("\n")[0])

    @property
    def file(self):
        """The file name in the first line, under which the page tells the reader to save the block."""
        return match[1] if (match := _FILE.match(self.text)) else None


def blocks(page, language=""):
    """Return the fenced blocks of a page in order, all of them or only those of a language."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return [found for found in map(Block._make, _FENCED.findall(text)) if language in ("", found.language)]


def indented(page):
    """Return the indented blocks of a page in order, without their indentation."""
    text = _FENCED.sub("", (ROOT / page).read_text(encoding="utf-8"))
    return [Block("", re.sub("^    ", "", match[0], flags=re.MULTILINE)) for match in _INDENTED.finditer(text)]
